// Partial set cover: as few sets as possible whose atoms together weigh enough. Whole numbers only,
// so that every sum is exact and no result depends on an order of summation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planning/spans.hpp"

namespace planning {

struct SetCover {
  std::vector<std::int64_t> weight;    // Of each atom, > 0.
  std::vector<std::vector<int>> sets;  // The atoms of each set, ascending.
  std::int64_t goal{};                 // What the atoms of the chosen sets must weigh together.

  std::size_t atoms() const { return weight.size(); }
};

// Walls as atoms, candidates as sets: every wall is cut at the ends of all views; pieces that the
// same candidates see are one atom, of their length together in nanometres; what nobody sees is
// left out. views[i] are disjoint, and their ends joined (join_ends), so that covered() is
// SpanSet::total_nm().
SetCover wall_atoms(const std::vector<std::vector<Span>>& views, std::size_t walls);

// The sets that hold each atom, ascending.
std::vector<std::vector<int>> holders(const SetCover& problem);

// Atoms from, ..., to - 1.
struct Run {
  std::uint32_t from{}, to{};
};
// The atoms of each set as runs: few where atoms are pieces of walls, one after the other. With
// sums over the first atoms, 0, 1, 2, ... of them, a set's sum costs its runs rather than its
// atoms.
std::vector<std::vector<Run>> runs(const SetCover& problem);

// What all atoms weigh.
std::int64_t total(const SetCover& problem);
std::int64_t weight_of(const SetCover& problem, const std::vector<int>& atoms);
// What the atoms of these sets weigh together.
std::int64_t covered(const SetCover& problem, const std::vector<int>& chosen);

// The sets that are part of no other (of equal ones the first), ascending. No cover needs others.
std::vector<int> undominated(const SetCover& problem);

// The problem with fewer atoms, the same sets and the same covers: an atom that weighs more than
// the goal leaves out must be covered, and with it every atom that all its holders hold; those are
// dropped, and the goal lowered by their weight.
SetCover without_implied_atoms(const SetCover& problem);

}  // namespace planning
