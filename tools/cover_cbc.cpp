#include "tools/cover_cbc.hpp"

#include <coin/Cbc_C_Interface.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

namespace tools {
namespace {

constexpr double kTolerance = 1e-5;  // Of CBC's bound; counts of sets are whole numbers.

struct Cells {
  bool are_atoms{};
  std::vector<int> of_atom;
  std::vector<double> share;  // Of all weight.
};

Cells cells_of(const planning::SetCover& problem, int cells_max) {
  const auto all = static_cast<double>(total(problem));
  const bool alone = problem.atoms() <= static_cast<std::size_t>(cells_max);
  Cells cells{.are_atoms = alone, .of_atom = {}, .share = {}};
  double sum = 0, last = -1;
  for (const std::int64_t weight : problem.weight) {
    const double place = alone ? last + 1 : std::floor(sum * cells_max);
    if (place > last) cells.share.push_back(0);
    last = place;
    cells.share.back() += static_cast<double>(weight) / all;
    sum += static_cast<double>(weight) / all;
    cells.of_atom.push_back(static_cast<int>(cells.share.size()) - 1);
  }
  return cells;
}

// Columns: x of each set, then z of each cell. Rows: what the sets hold of each cell is z or more;
// then the goal.
class Programme {
 public:
  Programme(const planning::SetCover& problem, const Cells& cells) {
    const auto rows = static_cast<int>(cells.share.size());
    for (const auto& set : problem.sets) {
      std::vector<std::pair<int, double>> column;
      for (const int atom : set) {
        const int cell = cells.of_atom[static_cast<std::size_t>(atom)];
        if (column.empty() || column.back().first != cell) column.emplace_back(cell, 0);
        column.back().second += static_cast<double>(problem.weight[static_cast<std::size_t>(atom)]);
      }
      for (auto& [cell, weight] : column)
        weight /= static_cast<double>(total(problem)) * cells.share[static_cast<std::size_t>(cell)];
      add(column, 0, 1);
    }
    const double goal = static_cast<double>(problem.goal) / static_cast<double>(total(problem));
    for (int k = 0; k < rows; ++k) {
      const double share = cells.share[static_cast<std::size_t>(k)];
      const bool required = cells.are_atoms && share > 1 - goal + 1e-9;
      add({{k, -1}, {rows, share}}, required ? 1 : 0, 0);
    }
    row_low_.assign(static_cast<std::size_t>(rows) + 1, 0);
    row_low_.back() = goal;
  }

  void load(Cbc_Model* model, int sets) const {
    const std::vector<double> high(low_.size(), 1.0),
        row_high(row_low_.size(), std::numeric_limits<double>::max());
    Cbc_loadProblem(model, static_cast<int>(low_.size()), static_cast<int>(row_low_.size()),
                    starts_.data(), rows_.data(), values_.data(), low_.data(), high.data(),
                    cost_.data(), row_low_.data(), row_high.data());
    for (int i = 0; i < sets; ++i) Cbc_setInteger(model, i);
    Cbc_setObjSense(model, 1);
  }

 private:
  void add(const std::vector<std::pair<int, double>>& column, double low, double cost) {
    for (const auto& [row, value] : column) {
      rows_.push_back(row);
      values_.push_back(value);
    }
    starts_.push_back(static_cast<CoinBigIndex>(rows_.size()));
    low_.push_back(low);
    cost_.push_back(cost);
  }

  std::vector<CoinBigIndex> starts_{0};
  std::vector<int> rows_;
  std::vector<double> values_, low_, cost_, row_low_;
};

std::vector<int> chosen(Cbc_Model* model, int sets) {
  std::vector<int> chosen;
  const double* x = Cbc_bestSolution(model);
  for (int i = 0; x != nullptr && i < sets; ++i)
    if (x[i] > 0.5) chosen.push_back(i);
  return chosen;
}

}  // namespace

CbcCover solve_cover(const planning::SetCover& problem, const std::vector<int>& known,
                     const CbcLimits& limits) {
  if (problem.goal <= 0) return {.sets = {}, .at_least = 0, .is_optimal = true};
  const auto sets = static_cast<int>(problem.sets.size());
  const std::unique_ptr<void, void (*)(Cbc_Model*)> model(Cbc_newModel(), &Cbc_deleteModel);
  Programme(problem, cells_of(problem, limits.cells_max)).load(model.get(), sets);
  Cbc_setParameter(model.get(), "log", "0");
  Cbc_setParameter(model.get(), "sec", std::to_string(limits.time_s).c_str());
  if (!known.empty()) {
    const std::vector<double> ones(known.size(), 1.0);
    Cbc_setMIPStartI(model.get(), static_cast<int>(known.size()), known.data(), ones.data());
  }
  Cbc_solve(model.get());
  CbcCover cover{.sets = chosen(model.get(), sets), .at_least = 0, .is_optimal = false};
  if (Cbc_isProvenInfeasible(model.get()))
    throw std::invalid_argument("all sets together do not reach the goal of the cover");
  const double bound = Cbc_getBestPossibleObjValue(model.get());
  cover.at_least = static_cast<int>(std::ceil(std::clamp(bound, 1.0, 1.0 * sets) - kTolerance));
  if (covered(problem, cover.sets) < problem.goal) cover.sets = known;
  cover.is_optimal = static_cast<int>(cover.sets.size()) == cover.at_least;
  return cover;
}

}  // namespace tools
