#include "planning/station_choice.hpp"

#include <algorithm>

#include "planning/cover_bound.hpp"
#include "planning/refine.hpp"

namespace planning {
namespace {

using Views = std::vector<std::vector<Span>>;

// Atoms times candidates, where views are widened: memory is a few times this many numbers.
constexpr std::int64_t kIncidencesMax = 10'000'000;

// Each span reaches to multiples of step_nm on its wall.
Views widened(const Views& views, std::size_t walls, std::int64_t step_nm) {
  Views wide;
  for (const auto& view : views) {
    SpanSet seen(walls);
    for (const Span& s : view)
      seen.add(
          Span{s.wall, s.from_nm / step_nm * step_nm, (s.to_nm + step_nm - 1) / step_nm * step_nm});
    wide.push_back(seen.spans());
  }
  return wide;
}

SetCover coarse_atoms(const Views& views, std::size_t walls) {
  SpanSet seen(walls);
  for (const auto& view : views) seen.add(view);
  const std::int64_t cells =
      std::max<std::int64_t>(1, kIncidencesMax / static_cast<std::int64_t>(views.size()));
  return wall_atoms(widened(views, walls, seen.total_nm() / cells + 1), walls);
}

// More where they cost less.
int bound_rounds(const SetCover& atoms) {
  return std::clamp(20'000'000 / static_cast<int>(atoms.atoms() + 1), 1200, 5000);
}

// The first of all, and greedy's picks.
std::vector<int> shortlist(const GreedyCover& greedy, std::size_t in_full) {
  std::vector<int> listed;
  for (std::size_t i = 0; i < in_full; ++i) listed.push_back(static_cast<int>(i));
  for (const Pick& pick : greedy.picks)
    if (pick.candidate >= static_cast<int>(in_full)) listed.push_back(pick.candidate);
  return listed;
}

GreedyCover refined_shortlist(const Views& views, std::size_t walls, const CoverRules& rules,
                              const GreedyCover& greedy, int at_least, std::uint64_t seed,
                              std::size_t in_full) {
  const std::vector<int> listed = shortlist(greedy, in_full);
  Views listed_views;
  for (const int i : listed) listed_views.push_back(views[static_cast<std::size_t>(i)]);
  GreedyCover start = greedy;
  for (Pick& pick : start.picks)
    pick.candidate = static_cast<int>(std::ranges::find(listed, pick.candidate) - listed.begin());
  const GreedyCover refined = refined_cover(listed_views, walls, wall_atoms(listed_views, walls),
                                            rules, start, at_least, seed);
  std::vector<int> picks;
  for (const Pick& pick : refined.picks)
    picks.push_back(listed[static_cast<std::size_t>(pick.candidate)]);
  GreedyCover cover = greedy_cover(views, walls, rules, picks);
  return cover.picks.size() <= greedy.picks.size() ? cover : greedy;
}

}  // namespace

StationChoice choose_stations(const Views& views, std::size_t walls, const CoverRules& rules,
                              bool refine, std::uint64_t seed, std::size_t in_full) {
  StationChoice choice;
  choice.cover = greedy_cover(views, walls, rules);
  choice.greedy = static_cast<int>(choice.cover.picks.size());
  choice.goal_nm = std::min(rules.goal_nm, covered_nm(choice.cover));
  if (choice.greedy == 0) return choice;
  const bool all = views.size() <= in_full;
  SetCover atoms = all ? wall_atoms(views, walls) : coarse_atoms(views, walls);
  atoms.goal = choice.goal_nm;
  choice.at_least = stations_at_least(atoms, choice.greedy, bound_rounds(atoms));
  if (!refine) return choice;
  choice.cover =
      all ? refined_cover(views, walls, atoms, rules, choice.cover, choice.at_least, seed)
          : refined_shortlist(views, walls, rules, choice.cover, choice.at_least, seed, in_full);
  return choice;
}

}  // namespace planning
