#include "planning/cover_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace planning {
namespace {

__extension__ using Int128 = __int128;

// One set costs this much; prices per unit of weight are whole numbers.
constexpr std::int64_t kSetCost = std::int64_t{1} << 60;

struct Part {
  std::size_t cell;
  std::int64_t weight;  // Of the set's atoms in the cell.
};

// Neighbouring atoms in groups that have one price per unit of weight.
struct Cells {
  std::vector<std::int64_t> weight;
  std::vector<std::vector<Part>> sets;  // Undominated ones only.
  std::int64_t goal{};
};

std::vector<std::size_t> cell_of_atoms(const SetCover& problem, int cells_max) {
  const std::int64_t all =
      std::accumulate(problem.weight.begin(), problem.weight.end(), std::int64_t{0});
  const bool alone = problem.atoms() <= static_cast<std::size_t>(cells_max);
  const std::int64_t full = alone ? 0 : all / cells_max;
  std::vector<std::size_t> cells(problem.atoms());
  std::int64_t filled = 0;
  for (std::size_t a = 1; a < cells.size(); ++a) {
    filled += problem.weight[a - 1];
    const bool next = filled + problem.weight[a] / 2 > full;
    cells[a] = cells[a - 1] + (next ? 1 : 0);
    if (next) filled = 0;
  }
  return cells;
}

Cells cells_of(const SetCover& problem, int cells_max) {
  Cells cells;
  cells.goal = problem.goal;
  const auto cell_of = cell_of_atoms(problem, cells_max);
  cells.weight.resize(cell_of.empty() ? 0 : cell_of.back() + 1);
  for (std::size_t a = 0; a < problem.atoms(); ++a) cells.weight[cell_of[a]] += problem.weight[a];
  for (const int i : undominated(problem)) {
    auto& parts = cells.sets.emplace_back();
    for (const int atom : problem.sets[static_cast<std::size_t>(i)]) {
      const std::size_t cell = cell_of[static_cast<std::size_t>(atom)];
      if (parts.empty() || parts.back().cell != cell) parts.push_back({cell, 0});
      parts.back().weight += problem.weight[static_cast<std::size_t>(atom)];
    }
  }
  return cells;
}

// The cells by their price per unit of weight, cheapest first.
template <class Price>
std::vector<std::size_t> by_price(const std::vector<Price>& per_unit) {
  std::vector<std::size_t> order(per_unit.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return std::pair(per_unit[a], a) < std::pair(per_unit[b], b);
  });
  return order;
}

// The right hand side of the bound in units of kSetCost, from whole prices: exact.
Int128 bound_at(const Cells& cells, const std::vector<std::int64_t>& per_unit) {
  Int128 bound = 0;
  for (const auto& set : cells.sets) {
    Int128 worth = kSetCost;
    for (const Part& part : set) worth -= static_cast<Int128>(part.weight) * per_unit[part.cell];
    bound += std::min<Int128>(worth, 0);
  }
  std::int64_t rest = cells.goal;
  for (const std::size_t k : by_price(per_unit)) {
    const std::int64_t taken = std::min(rest, cells.weight[k]);
    bound += static_cast<Int128>(taken) * per_unit[k];
    rest -= taken;
  }
  return bound;
}

// Prices of whole cells in sets, by a subgradient method with Polyak's step.
class Prices {
 public:
  explicit Prices(const Cells& cells) : cells_(cells), price_(cells.weight.size()) {
    std::int64_t most = 1;
    for (const auto& set : cells.sets) {
      std::int64_t sees = 0;
      for (const Part& part : set) sees += part.weight;
      most = std::max(most, sees);
    }
    for (std::size_t k = 0; k < price_.size(); ++k)
      price_[k] = static_cast<double>(cells.weight[k]) / static_cast<double>(most);
    best_ = price_;
  }

  void improve(int rounds, double known) {
    std::vector<double> way(price_.size());
    double step = 1;
    for (int round = 0, stalled = 0; round < rounds && best_value_ <= known - 1 + 1e-6; ++round) {
      const double value = look();
      if (value > best_value_ + 1e-4) stalled = 0;
      if (value > best_value_) {
        best_value_ = value;
        best_ = price_;
      } else if (++stalled >= kPatience) {
        stalled = 0;
        step /= 2;
        price_ = best_;
        std::ranges::fill(way, 0);
        look();
      }
      advance(way, step * (known - value));
    }
  }

  std::vector<std::int64_t> per_unit() const {
    std::vector<std::int64_t> whole(best_.size());
    for (std::size_t k = 0; k < whole.size(); ++k)
      whole[k] = std::llround(best_[k] / static_cast<double>(cells_.weight[k]) *
                              static_cast<double>(kSetCost));
    return whole;
  }

 private:
  static constexpr int kPatience = 15;
  static constexpr double kMemory = 0.3;  // Of the way before, against zig-zags.

  // The bound at price_, and its subgradient in slope_.
  double look() {
    slope_.assign(price_.size(), 0);
    double value = 0;
    for (const auto& set : cells_.sets) {
      double worth = 1;
      for (const Part& part : set) worth -= share(part) * price_[part.cell];
      if (worth >= 0) continue;
      value += worth;
      for (const Part& part : set) slope_[part.cell] -= share(part);
    }
    std::vector<double> per_unit(price_.size());
    for (std::size_t k = 0; k < price_.size(); ++k)
      per_unit[k] = price_[k] / static_cast<double>(cells_.weight[k]);
    std::int64_t rest = cells_.goal;
    for (const std::size_t k : by_price(per_unit)) {
      const double taken = share({k, std::min(rest, cells_.weight[k])});
      value += taken * price_[k];
      slope_[k] += taken;
      rest -= std::min(rest, cells_.weight[k]);
    }
    return value;
  }

  void advance(std::vector<double>& way, double step) {
    double square = 0;
    for (std::size_t k = 0; k < way.size(); ++k) {
      way[k] = slope_[k] + kMemory * way[k];
      square += way[k] * way[k];
    }
    if (square <= 0) return;
    for (std::size_t k = 0; k < way.size(); ++k)
      price_[k] = std::max(0.0, price_[k] + step / square * way[k]);
  }

  double share(const Part& part) const {
    return static_cast<double>(part.weight) / static_cast<double>(cells_.weight[part.cell]);
  }

  const Cells& cells_;
  std::vector<double> price_, best_, slope_;
  double best_value_ = 0;
};

}  // namespace

int stations_at_least(const SetCover& problem, int known, const BoundEffort& effort) {
  if (problem.goal <= 0) return 0;
  const Cells cells = cells_of(problem, effort.cells_max);
  Prices prices(cells);
  prices.improve(effort.rounds, known);
  const Int128 bound = bound_at(cells, prices.per_unit());
  return static_cast<int>(std::max<Int128>(1, (bound + kSetCost - 1) / kSetCost));
}

}  // namespace planning
