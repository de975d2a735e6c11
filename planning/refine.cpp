#include "planning/refine.hpp"

#include <algorithm>
#include <optional>

#include "planning/candidate_links.hpp"
#include "planning/set_cover_search.hpp"
#include "planning/station_order.hpp"

namespace planning {
namespace {

// How well the scans of some stations hold together, and how much they cover; less is better.
struct Quality {
  int parts{};
  int bridges{};
  std::int64_t missing_nm{};  // Of all that candidates see.

  auto operator<=>(const Quality&) const = default;
};

class Refinement {
 public:
  Refinement(const std::vector<std::vector<Span>>& views, const SetCover& atoms,
             const CoverRules& rules, const GreedyCover& greedy, const RefineEffort& effort,
             std::uint64_t seed)
      : atoms_(atoms),
        rules_(rules),
        effort_(effort),
        seed_(seed),
        candidates_(undominated(atoms)),
        links_(views, rules.overlap_min) {
    for (const Pick& pick : greedy.picks) greedy_.push_back(pick.candidate);
    best_ = greedy_;
    greedy_nm_ = covered(atoms_, greedy_);
    atoms_.goal = std::min(rules.goal_nm, greedy_nm_);
  }

  std::vector<int> run(int at_least) {
    best_ = fewer_sets(
        atoms_, candidates_, best_, {.at_least = at_least, .swaps = effort_.swaps}, seed_,
        [&](const auto& chosen) { return ordered(chosen); },
        [&](const auto& chosen) { return links_.missing_nm(chosen); });
    if (best_.size() == greedy_.size()) atoms_.goal = greedy_nm_;
    hold_together();
    if (!is_firm()) spend_spare_stations();
    return best_;
  }

 private:
  std::optional<std::vector<int>> ordered(const std::vector<int>& stations) const {
    return station_order(atoms_, stations, rules_);
  }

  Quality quality(const std::vector<int>& stations, std::int64_t covered_nm) {
    const GraphParts parts = links_.parts(stations);
    return {parts.parts, static_cast<int>(parts.bridges.size()), total(atoms_) - covered_nm};
  }

  // A bridge is worth leaving 1 / 200 of all for a while, to get past it; a part three times that.
  std::int64_t looseness_nm(const std::vector<int>& stations) {
    const GraphParts parts = links_.parts(stations);
    return (3 * (parts.parts - 1) + static_cast<int>(parts.bridges.size())) * total(atoms_) / 200;
  }

  // Swaps on among covers of the same size, and keeps the best.
  void hold_together() {
    if (best_.size() < 2) return;
    SwapSearch search(atoms_, candidates_, best_, seed_ + 1);
    Quality best = quality(best_, search.covered());
    const auto looseness = [&](const auto& chosen) { return looseness_nm(chosen); };
    for (int swaps = 0; swaps < effort_.swaps_links && search.swap(looseness); ++swaps) {
      if (!search.reaches_goal()) continue;
      const Quality now = quality(search.chosen(), search.covered());
      if (now >= best) continue;
      if (auto order = ordered(search.chosen())) {
        best_ = *std::move(order);
        best = now;
      }
    }
  }

  bool is_firm() {
    const GraphParts parts = links_.parts(best_);
    return parts.parts == 1 && parts.bridges.empty();
  }

  // Up to greedy's number of stations, if that leaves no weak link: by adding some, else by going
  // back to greedy's.
  void spend_spare_stations() {
    const std::vector<int> fewest = best_;
    while (best_.size() < greedy_.size() && !is_firm() && add_one_for_links()) {
    }
    if (is_firm() || fewest.size() == greedy_.size()) return;
    best_ = greedy_;
    atoms_.goal = greedy_nm_;
    hold_together();
    if (!is_firm()) best_ = fewest;
  }

  // Adds the station that leaves the fewest parts and bridges, if fewer than now.
  bool add_one_for_links() {
    std::vector<std::pair<Quality, int>> helpful;
    const Quality now = quality(best_, 0);
    for (const int candidate : candidates_) {
      if (std::ranges::find(best_, candidate) != best_.end()) continue;
      std::vector<int> more = best_;
      more.push_back(candidate);
      if (const Quality then = quality(more, 0); then < now) helpful.emplace_back(then, candidate);
    }
    std::ranges::sort(helpful);
    for (const auto& [then, candidate] : helpful) {
      std::vector<int> more = best_;
      more.push_back(candidate);
      if (more.size() == greedy_.size() && covered(atoms_, more) < greedy_nm_) continue;
      if (auto order = ordered(more)) {
        best_ = *std::move(order);
        return true;
      }
    }
    return false;
  }

  SetCover atoms_;
  CoverRules rules_;
  RefineEffort effort_;
  std::uint64_t seed_;
  std::vector<int> candidates_;
  CandidateLinks links_;
  std::vector<int> best_;  // In an order that obeys the rules.
  std::vector<int> greedy_;
  std::int64_t greedy_nm_{};
};

}  // namespace

GreedyCover refined_cover(const std::vector<std::vector<Span>>& views, std::size_t walls,
                          const SetCover& atoms, const CoverRules& rules, const GreedyCover& greedy,
                          int at_least, std::uint64_t seed, const RefineEffort& effort) {
  if (greedy.picks.empty()) return greedy;
  const auto stations = Refinement(views, atoms, rules, greedy, effort, seed).run(at_least);
  GreedyCover refined = greedy_cover(views, walls, rules, stations);
  return refined.picks.size() <= greedy.picks.size() ? refined : greedy;
}

}  // namespace planning
