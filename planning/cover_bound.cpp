#include "planning/cover_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace planning {
namespace {

__extension__ using Int128 = __int128;

// One set costs this much; prices per unit of weight are whole numbers.
constexpr std::int64_t kSetCost = std::int64_t{1} << 60;

// Calls buy(atom, units) for the cheapest `goal` units, cheapest first.
template <class Price, class Buy>
void buy_cheapest(const std::vector<std::int64_t>& weight, const std::vector<Price>& price,
                  std::int64_t goal, const Buy& buy) {
  std::vector<std::pair<Price, std::size_t>> order;
  order.reserve(price.size());
  for (std::size_t a = 0; a < price.size(); ++a) order.emplace_back(price[a], a);
  std::ranges::sort(order);
  for (const auto& [_, a] : order) {
    const std::int64_t units = std::min(goal, weight[a]);
    if (units <= 0) return;
    buy(a, units);
    goal -= units;
  }
}

// The right hand side of the bound in units of kSetCost, from whole prices of atoms: exact.
Int128 bound_at(const SetCover& problem, const std::vector<std::int64_t>& price) {
  Int128 bound = 0;
  for (const auto& set : problem.sets) {
    Int128 left = kSetCost;
    for (const int atom : set) {
      const auto a = static_cast<std::size_t>(atom);
      left -= static_cast<Int128>(problem.weight[a]) * price[a];
    }
    bound += std::min<Int128>(left, 0);
  }
  buy_cheapest(problem.weight, price, problem.goal, [&](std::size_t a, std::int64_t units) {
    bound += static_cast<Int128>(units) * price[a];
  });
  return bound;
}

// Seeks the prices with the highest bound: the dual of the linear relaxation
//   least sum of x   where for every atom the x of the sets that hold it sum to z or more,
//                    the z weigh the goal or more, and 0 <= x, z <= 1,
// by the primal-dual hybrid gradient method (Chambolle & Pock 2011) with diagonal steps and
// restarts from the mean. Weights are shares of all, so that it does not matter how walls are cut
// into atoms.
class PriceSearch {
 public:
  explicit PriceSearch(const SetCover& problem)
      : problem_(problem),
        runs_(runs(problem)),
        goal_(share(problem.goal)),
        sum_to_(problem.atoms() + 1) {
    for (const std::int64_t weight : problem.weight) weight_.push_back(share(weight));
    std::vector<double> held(problem.atoms() + 1);  // By how many sets.
    for (const auto& set : runs_) add(held, set, 1);
    std::partial_sum(held.begin(), held.end(), held.begin());
    for (std::size_t a = 0; a < problem.atoms(); ++a) step_y_.push_back(kLean / (1 + held[a]));
    double least = 1;
    for (const auto& set : problem.sets) {
      const double sees = share(weight_of(problem, set));
      step_x_.push_back(sees > 0 ? 1 / (kLean * sees) : 0);
      if (sees > 0) least = std::min(least, 1 / sees);
    }
    now_ = {.x = std::vector<double>(problem.sets.size()),
            .y = std::vector<double>(problem.atoms(), least),
            .z = std::vector<double>(problem.atoms(), 1.0),
            .mu = least};
    best_ = now_.y;
  }

  // Until no fewer than `known` sets are proven, or the rounds are over.
  void improve(int rounds, double known) {
    for (int round = 0; round < rounds && best_bound_ <= known - 1 + kMargin;) {
      Point sum = zero();
      const int period = std::min(kPeriod, rounds - round);
      for (int i = 0; i < period; ++i, ++round) {
        step();
        accumulate(sum, now_, 1.0 / period);
      }
      if (judge(sum.y) > judge(now_.y)) now_ = std::move(sum);
    }
  }

  std::vector<std::int64_t> whole_prices() const {
    std::vector<std::int64_t> whole;
    const double unit = static_cast<double>(kSetCost) / static_cast<double>(total(problem_));
    for (const double price : best_)  // Above the cost of a set there is nothing to gain.
      whole.push_back(std::llround(std::clamp(price * unit, 0.0, 1.0 * kSetCost)));
    return whole;
  }

 private:
  // Steps in y over steps in x and z: found by trial on the shipped sites, not critical.
  static constexpr double kLean = 100;
  static constexpr int kPeriod = 50;
  static constexpr double kMargin = 1e-6;

  struct Point {
    std::vector<double> x, y, z;  // y: the prices, in sets per all of the weight.
    double mu{};
  };

  Point zero() const {
    return {std::vector<double>(now_.x.size()), std::vector<double>(now_.y.size()),
            std::vector<double>(now_.z.size()), 0};
  }
  static void accumulate(Point& sum, const Point& point, double times) {
    const auto add_all = [&](std::vector<double>& to, const std::vector<double>& what) {
      for (std::size_t i = 0; i < to.size(); ++i) to[i] += times * what[i];
    };
    add_all(sum.x, point.x);
    add_all(sum.y, point.y);
    add_all(sum.z, point.z);
    sum.mu += times * point.mu;
  }

  double share(std::int64_t weight) const {
    return static_cast<double>(weight) / static_cast<double>(total_);
  }
  static void add(std::vector<double>& steps, const std::vector<Run>& set, double what) {
    for (const Run& run : set) {
      steps[run.from] += what;
      steps[run.to] -= what;
    }
  }

  // For what all sets cost at these prices.
  void sum_up(const std::vector<double>& y) {
    for (std::size_t a = 0; a < y.size(); ++a) sum_to_[a + 1] = sum_to_[a] + y[a] * weight_[a];
  }
  double price_of(const std::vector<Run>& set) const {
    double price = 0;
    for (const Run& run : set) price += sum_to_[run.to] - sum_to_[run.from];
    return price;
  }

  void step() {
    sum_up(now_.y);
    std::vector<double> held(now_.y.size() + 1);  // By the sets, where x is going.
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
      const double x = std::clamp(now_.x[i] + step_x_[i] * (price_of(runs_[i]) - 1), 0.0, 1.0);
      const double ahead = 2 * x - now_.x[i];
      now_.x[i] = x;
      if (ahead != 0) add(held, runs_[i], ahead);
    }
    double holds = 0, covers = 0;
    for (std::size_t a = 0; a < now_.y.size(); ++a) {
      const double z = std::clamp(now_.z[a] + (now_.mu - now_.y[a]) / (2 * kLean), 0.0, 1.0);
      const double ahead = 2 * z - now_.z[a];
      now_.z[a] = z;
      holds += held[a];
      covers += weight_[a] * ahead;
      now_.y[a] = std::max(0.0, now_.y[a] + step_y_[a] * (ahead - holds));
    }
    now_.mu = std::max(0.0, now_.mu + kLean * (goal_ - covers));
  }

  // The bound at these prices, and at these made so low that no set costs more than 1.
  double judge(const std::vector<double>& y) {
    sum_up(y);
    double most = 1, saved = 0, bought = 0;
    for (const auto& set : runs_) {
      const double price = price_of(set);
      most = std::max(most, price);
      saved += std::min(0.0, 1 - price);
    }
    buy_cheapest(problem_.weight, y, problem_.goal,
                 [&](std::size_t a, std::int64_t units) { bought += y[a] * share(units); });
    const double plain = bought + saved, lowered = bought / most;
    if (std::max(plain, lowered) > best_bound_) {
      best_bound_ = std::max(plain, lowered);
      best_ = y;
      if (lowered > plain)
        for (double& price : best_) price /= most;
    }
    return std::max(plain, lowered);
  }

  const SetCover& problem_;
  std::int64_t total_ = total(problem_);
  std::vector<std::vector<Run>> runs_;
  double goal_;
  std::vector<double> sum_to_;  // Of what the first atoms cost.
  std::vector<double> weight_, step_x_, step_y_;
  Point now_;
  std::vector<double> best_;
  double best_bound_ = 0;
};

}  // namespace

int stations_at_least(const SetCover& problem, int known, int rounds) {
  if (problem.goal <= 0) return 0;
  PriceSearch search(problem);
  search.improve(rounds, known);
  const Int128 bound = bound_at(problem, search.whole_prices());
  return static_cast<int>(std::max<Int128>(1, (bound + kSetCost - 1) / kSetCost));
}

}  // namespace planning
