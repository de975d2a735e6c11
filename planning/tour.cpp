#include "planning/tour.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "planning/lin_kernighan.hpp"

namespace planning {
namespace {

constexpr double kSameCost = 1e-6;  // Relative. Two ways along the same road differ by rounding.
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Order = std::vector<int>;

// Costs between the nodes to be visited, renumbered so that the start is 0. An open tour is a
// closed one whose way back is free.
class Costs {
 public:
  Costs(const TourProblem& problem, const std::vector<int>& nodes)
      : n_(static_cast<int>(nodes.size())), cost_(nodes.size() * nodes.size()) {
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j < n_; ++j) {
        const auto from = static_cast<std::size_t>(nodes[static_cast<std::size_t>(i)]);
        const auto to = static_cast<std::size_t>(nodes[static_cast<std::size_t>(j)]);
        const bool free_return = j == 0 && !problem.closed;
        cost_[index(i, j)] = i == j || free_return ? 0 : problem.cost[from][to];
      }
  }

  int size() const { return n_; }
  double operator()(int from, int to) const { return cost_[index(from, to)]; }

  // Of an open tour the ways back to the start do not matter.
  bool symmetric(bool closed) const {
    for (int i = 0; i < n_; ++i)
      for (int j = closed ? 0 : 1; j < i; ++j)
        if (!same((*this)(i, j), (*this)(j, i))) return false;
    return true;
  }

  double of(const Order& order) const {
    double total = 0;
    for (std::size_t i = 0; i < order.size(); ++i)
      total += (*this)(order[i], order[(i + 1) % order.size()]);
    return total;
  }

 private:
  static bool same(double a, double b) {
    if (!std::isfinite(a) || !std::isfinite(b)) return a == b;
    return std::abs(a - b) <= kSameCost * a;
  }

  std::size_t index(int from, int to) const {
    return static_cast<std::size_t>(from) * static_cast<std::size_t>(n_) +
           static_cast<std::size_t>(to);
  }

  int n_;
  std::vector<double> cost_;
};

// Held and Karp (1962): best[set][last] is the cheapest way from the start through the set that
// ends in `last`; infinite where last is not in the set. Nodes 1 .. n-1 are bits 0 .. n-2.
// O(2^n n^2).
class HeldKarp {
 public:
  explicit HeldKarp(const Costs& cost)
      : cost_(cost), others_(cost.size() - 1), width_((others_ + kLanes - 1) / kLanes * kLanes) {
    into_.assign(at(width_ * others_), kInfinity);
    for (int last = 0; last < others_; ++last)
      for (int before = 0; before < others_; ++before)
        into_[at(last * width_ + before)] = cost_(before + 1, last + 1);
  }

  Order solve() {
    const std::size_t sets = std::size_t{1} << others_;
    best_.assign(sets * at(others_) + kLanes, kInfinity);
    for (int last = 0; last < others_; ++last) row(bit(last))[last] = cost_(0, last + 1);
    for (std::size_t set = 1; set < sets; ++set) {
      if (std::has_single_bit(set)) continue;
      for (std::size_t left = set; left != 0; left &= left - 1) {
        const int last = std::countr_zero(left);
        row(set)[last] = cheapest_into(last, row(set & ~bit(last)));
      }
    }
    return trace(sets - 1);
  }

 private:
  static constexpr int kLanes = 4;  // Side by side, so that they become vector instructions.

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static std::size_t bit(int node) { return std::size_t{1} << node; }
  double* row(std::size_t set) { return best_.data() + set * at(others_); }

  // Of the ways that `ways` holds by their last node, each gone on to `last`. (Beyond the row's end
  // other sets are read, but into_ is infinite there.)
  double cheapest_into(int last, const double* ways) const {
    const double* into = into_.data() + last * width_;
    std::array<double, kLanes> least;
    least.fill(kInfinity);
    for (int before = 0; before < width_; before += kLanes)
      for (int lane = 0; lane < kLanes; ++lane) {
        const double total = ways[before + lane] + into[before + lane];
        least[at(lane)] = total < least[at(lane)] ? total : least[at(lane)];
      }
    return std::min({least[0], least[1], least[2], least[3]});
  }

  Order trace(std::size_t set) {
    Order backwards;
    int next = -1;  // The start.
    while (set != 0) {
      int chosen = -1;
      double least = kInfinity;
      for (int last = 0; last < others_; ++last) {
        if (!(set & bit(last))) continue;
        const double total = row(set)[last] + cost_(last + 1, next + 1);
        if (chosen < 0 || total < least) {
          least = total;
          chosen = last;
        }
      }
      backwards.push_back(chosen + 1);
      set &= ~bit(chosen);
      next = chosen;
    }
    backwards.push_back(0);
    std::reverse(backwards.begin(), backwards.end());
    return backwards;
  }

  const Costs& cost_;
  const int others_;
  const int width_;           // others_ rounded up to whole lanes.
  std::vector<double> into_;  // Row last, column before; infinite beyond the others.
  std::vector<double> best_;
};

// 2-opt and Or-opt for costs that differ between the two directions.
class AsymmetricSearch {
 public:
  explicit AsymmetricSearch(const Costs& cost) : cost_(cost), n_(cost.size()) {}

  Order solve() {
    Order best;
    double least = kInfinity;
    // From every node while that is quick (the effort of one start grows with n^3), else from some.
    const int starts = std::clamp(static_cast<int>(1e8 / std::pow(n_, 3)), 1, n_);
    for (int k = 0; k < starts; ++k) {
      Order order = nearest_neighbour(k * n_ / starts);
      improve(order);
      const double total = cost_.of(order);
      if (!best.empty() && total >= least) continue;
      least = total;
      best = std::move(order);
    }
    return best;
  }

 private:
  static constexpr double kGainMin = 1e-9;
  static constexpr int kSegmentMax = 3;

  static int at(const Order& order, int place) { return order[static_cast<std::size_t>(place)]; }

  Order nearest_neighbour(int start) const {
    Order order{start};
    std::vector<char> used(static_cast<std::size_t>(n_), 0);
    used[static_cast<std::size_t>(start)] = 1;
    while (static_cast<int>(order.size()) < n_) {
      int nearest = -1;
      for (int j = 0; j < n_; ++j)
        if (!used[static_cast<std::size_t>(j)] &&
            (nearest < 0 || cost_(order.back(), j) < cost_(order.back(), nearest)))
          nearest = j;
      used[static_cast<std::size_t>(nearest)] = 1;
      order.push_back(nearest);
    }
    std::rotate(order.begin(), std::find(order.begin(), order.end(), 0), order.end());
    return order;
  }

  void improve(Order& order) const {
    while (reverse_one(order) || move_one(order)) {
    }
  }

  // The first run of places [i, j] that is cheaper the other way round.
  bool reverse_one(Order& order) const {
    for (int i = 1; i < n_; ++i) {
      double inside = 0;  // What turning costs within the run.
      for (int j = i + 1; j < n_; ++j) {
        inside += cost_(at(order, j), at(order, j - 1)) - cost_(at(order, j - 1), at(order, j));
        const int before = at(order, i - 1), after = at(order, (j + 1) % n_);
        const int a = at(order, i), b = at(order, j);
        const double change =
            inside + cost_(before, b) + cost_(a, after) - cost_(before, a) - cost_(b, after);
        if (!(change < -kGainMin)) continue;
        std::reverse(order.begin() + i, order.begin() + j + 1);
        return true;
      }
    }
    return false;
  }

  // The first run of up to three nodes that is cheaper elsewhere, as it is.
  bool move_one(Order& order) const {
    for (int length = 1; length <= std::min(kSegmentMax, n_ - 2); ++length)
      for (int i = 1; i + length <= n_; ++i)
        for (int gap = 0; gap < n_; ++gap) {  // Between places gap and gap + 1.
          if (gap >= i - 1 && gap < i + length) continue;
          if (move_gain(order, i, length, gap) <= kGainMin) continue;
          move_run(order, i, length, gap);
          return true;
        }
    return false;
  }

  double move_gain(const Order& order, int i, int length, int gap) const {
    const int first = at(order, i), last = at(order, i + length - 1);
    const int before = at(order, i - 1), after = at(order, (i + length) % n_);
    const int left = at(order, gap), right = at(order, (gap + 1) % n_);
    return cost_(before, first) + cost_(last, after) + cost_(left, right) - cost_(before, after) -
           cost_(left, first) - cost_(last, right);
  }

  static void move_run(Order& order, int i, int length, int gap) {
    const auto begin = order.begin();
    if (gap > i)
      std::rotate(begin + i, begin + i + length, begin + gap + 1);
    else
      std::rotate(begin + gap + 1, begin + i, begin + i + length);
  }

  const Costs& cost_;
  const int n_;
};

// An open tour becomes a closed one by a node more, which is bound to the start and free elsewhere.
// Infinite costs become so dear that a tour takes as few as it can.
Order solve_symmetric(const Costs& cost, bool closed, const TourConfig& config) {
  const int n = cost.size();
  double dearest = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 1; j < n; ++j)
      if (std::isfinite(cost(i, j))) dearest = std::max(dearest, cost(i, j));
  const double forbidden = (1 + dearest) * n;
  SymmetricCosts given;
  given.n = closed ? n : n + 1;
  for (int i = 0; i < given.n; ++i)
    for (int j = 0; j < given.n; ++j) {
      const bool extra = i == n || j == n;
      const bool bound = extra && (i == 0 || j == 0);
      const double real = extra ? 0 : j == 0 ? cost(0, i) : cost(i, j);
      const double finite = std::isfinite(real) ? real : forbidden;
      given.cost.push_back(i == j ? 0 : bound ? -forbidden * n : finite);
    }
  Order order = lin_kernighan(given, config.kicks_per_node, config.seed);
  std::rotate(order.begin(), std::find(order.begin(), order.end(), 0), order.end());
  if (!closed && order[1] == n) std::reverse(order.begin() + 1, order.end());
  if (!closed) order.pop_back();
  if (closed && order[1] > order.back()) std::reverse(order.begin() + 1, order.end());
  return order;
}

constexpr int kSymmetricMin = 8;

Order solve_nodes(const TourProblem& problem, const std::vector<int>& nodes,
                  const TourConfig& config, bool& proven) {
  const Costs cost(problem, nodes);
  const int n = cost.size();
  proven = n <= std::max(3, std::min(config.exact_nodes_max, kExactNodesCap));
  Order order;
  if (n == 1)
    order = {0};
  else if (proven)
    order = HeldKarp(cost).solve();
  else if (n >= kSymmetricMin && cost.symmetric(problem.closed))
    order = solve_symmetric(cost, problem.closed, config);
  else
    order = AsymmetricSearch(cost).solve();
  for (int& node : order) node = nodes[static_cast<std::size_t>(node)];
  return order;
}

double leg_cost(const TourProblem& problem, int from, int to) {
  return problem.cost[static_cast<std::size_t>(from)][static_cast<std::size_t>(to)];
}

void check(const TourProblem& problem) {
  const std::size_t n = problem.cost.size();
  if (problem.start < 0 || static_cast<std::size_t>(problem.start) >= n)
    throw std::invalid_argument("solve_tour: start is not a node");
  for (std::size_t i = 0; i < n; ++i) {
    if (problem.cost[i].size() != n)
      throw std::invalid_argument("solve_tour: the cost matrix is not square");
    for (std::size_t j = 0; j < n; ++j)
      if (i != j && !(problem.cost[i][j] >= 0))
        throw std::invalid_argument("solve_tour: a cost is negative or not a number");
  }
}

// The start first, then the others by index.
std::vector<int> reachable_nodes(const TourProblem& problem, std::vector<int>& unreachable) {
  std::vector<int> nodes{problem.start};
  for (int i = 0; i < static_cast<int>(problem.cost.size()); ++i) {
    if (i == problem.start) continue;
    const bool there = std::isfinite(leg_cost(problem, problem.start, i));
    const bool back = !problem.closed || std::isfinite(leg_cost(problem, i, problem.start));
    (there && back ? nodes : unreachable).push_back(i);
  }
  return nodes;
}

// The node (not the start) with the most infinite costs to the others; the highest index of equals.
std::size_t least_connected(const TourProblem& problem, const std::vector<int>& nodes) {
  std::size_t worst = 1;
  int most = -1;
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    int missing = 0;
    for (const int other : nodes)
      missing += !std::isfinite(leg_cost(problem, nodes[i], other)) +
                 !std::isfinite(leg_cost(problem, other, nodes[i]));
    if (missing < most) continue;
    most = missing;
    worst = i;
  }
  return worst;
}

}  // namespace

double tour_cost(const TourProblem& problem, const std::vector<int>& order) {
  double total = 0;
  for (std::size_t i = 0; i + 1 < order.size(); ++i)
    total += leg_cost(problem, order[i], order[i + 1]);
  if (problem.closed && order.size() > 1) total += leg_cost(problem, order.back(), order.front());
  return total;
}

Tour solve_tour(const TourProblem& problem, const TourConfig& config) {
  check(problem);
  Tour tour;
  std::vector<int> nodes = reachable_nodes(problem, tour.unreachable);
  for (;;) {
    tour.order = solve_nodes(problem, nodes, config, tour.proven);
    tour.cost = tour_cost(problem, tour.order);
    if (std::isfinite(tour.cost)) break;
    // No tour joins all that the start is joined to: leave out what is joined the least.
    const std::size_t worst = least_connected(problem, nodes);
    tour.unreachable.push_back(nodes[worst]);
    nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  std::sort(tour.unreachable.begin(), tour.unreachable.end());
  return tour;
}

}  // namespace planning
