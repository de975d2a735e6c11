#include "planning/station_order.hpp"

#include <algorithm>
#include <utility>

namespace planning {
namespace {

// What each of some sets would still add while they are taken one by one. Slots are indices into
// the chosen sets.
class Taking {
 public:
  Taking(const SetCover& atoms, const std::vector<int>& chosen) : atoms_(atoms), chosen_(chosen) {
    starts_.assign(atoms.atoms() + 1, 0);
    for (const int set : chosen_)
      for (const int atom : atoms_of(set)) ++starts_[static_cast<std::size_t>(atom) + 1];
    for (std::size_t a = 0; a < atoms.atoms(); ++a) starts_[a + 1] += starts_[a];
    holders_.resize(starts_.back());
    std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
    for (std::size_t slot = 0; slot < chosen_.size(); ++slot)
      for (const int atom : atoms_of(chosen_[slot]))
        holders_[next[static_cast<std::size_t>(atom)]++] = slot;
    for (const int set : chosen_) sees_.push_back(weight_of(atoms_, atoms_of(set)));
    start();
  }

  void start() {
    adds_ = sees_;
    is_covered_.assign(atoms_.atoms(), 0);
  }
  void take(std::size_t slot) {
    for (const int atom : atoms_of(chosen_[slot])) {
      const auto a = static_cast<std::size_t>(atom);
      if (std::exchange(is_covered_[a], 1)) continue;
      for (std::size_t h = starts_[a]; h < starts_[a + 1]; ++h)
        adds_[holders_[h]] -= atoms_.weight[a];
    }
  }

  std::int64_t sees(std::size_t slot) const { return sees_[slot]; }
  std::int64_t adds(std::size_t slot) const { return adds_[slot]; }
  bool overlaps(std::size_t slot, double overlap_min) const {
    return overlaps_enough(sees_[slot], sees_[slot] - adds_[slot], overlap_min);
  }

  // What each slot adds when it is taken last.
  std::vector<std::int64_t> adds_last() const {
    std::vector<std::int64_t> sums(chosen_.size());
    for (std::size_t a = 0; a < atoms_.atoms(); ++a)
      if (starts_[a + 1] - starts_[a] == 1) sums[holders_[starts_[a]]] += atoms_.weight[a];
    return sums;
  }

 private:
  const std::vector<int>& atoms_of(int set) const {
    return atoms_.sets[static_cast<std::size_t>(set)];
  }

  const SetCover& atoms_;
  const std::vector<int>& chosen_;
  std::vector<std::size_t> starts_, holders_;  // Slots that hold an atom, one atom after the other.
  std::vector<std::int64_t> sees_, adds_;
  std::vector<char> is_covered_;
};

// `urgent` slots go first where they may.
std::optional<std::vector<std::size_t>> order_from(Taking& taking, std::size_t first,
                                                   std::vector<std::size_t> rest,
                                                   const std::vector<char>& urgent,
                                                   const CoverRules& rules) {
  taking.start();
  taking.take(first);
  std::vector<std::size_t> order{first};
  std::erase(rest, first);
  while (!rest.empty()) {
    auto best = rest.end();
    const auto rank = [&](std::size_t slot) { return std::pair(urgent[slot], taking.adds(slot)); };
    for (auto it = rest.begin(); it != rest.end(); ++it) {
      const bool may_go =
          taking.overlaps(*it, rules.overlap_min) && taking.adds(*it) >= rules.gain_min_nm;
      if (may_go && (best == rest.end() || rank(*it) > rank(*best))) best = it;
    }
    if (best == rest.end()) return std::nullopt;
    order.push_back(*best);
    taking.take(*best);
    rest.erase(best);
  }
  return order;
}

}  // namespace

std::optional<std::vector<int>> station_order(const SetCover& atoms, const std::vector<int>& chosen,
                                              const CoverRules& rules) {
  if (chosen.empty()) return chosen;
  std::vector<int> sorted = chosen;
  std::ranges::sort(sorted);
  Taking taking(atoms, sorted);
  std::vector<std::size_t> slots;
  for (std::size_t slot = 0; slot < sorted.size(); ++slot) slots.push_back(slot);
  std::vector<std::size_t> firsts = slots;
  std::ranges::stable_sort(firsts, std::greater{}, [&](std::size_t s) { return taking.sees(s); });
  firsts.resize(std::min(firsts.size(), kFirstsMax));

  const std::vector<char> none(slots.size());
  std::vector<char> urgent;
  for (const std::int64_t adds_nm : taking.adds_last())
    urgent.push_back(adds_nm < rules.gain_min_nm);
  for (const auto& goes_first : {none, urgent}) {
    for (const std::size_t first : firsts) {
      const auto order = order_from(taking, first, slots, goes_first, rules);
      if (!order) continue;
      std::vector<int> sets;
      for (const std::size_t slot : *order) sets.push_back(sorted[slot]);
      return sets;
    }
    if (urgent == none) break;
  }
  return std::nullopt;
}

bool obeys(const SetCover& atoms, const std::vector<int>& order, const CoverRules& rules) {
  Taking taking(atoms, order);
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    if (slot > 0 &&
        (!taking.overlaps(slot, rules.overlap_min) || taking.adds(slot) < rules.gain_min_nm))
      return false;
    taking.take(slot);
  }
  return true;
}

}  // namespace planning
