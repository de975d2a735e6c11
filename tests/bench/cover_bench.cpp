// Choosing stations, from views that are worked out already: the lazy greedy cover against asking
// every candidate every time, the refined cover, the bound, and cutting the walls into atoms.
#include <benchmark/benchmark.h>

#include <cmath>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"
#include "planning/cover_bound.hpp"
#include "planning/refine.hpp"
#include "tests/planning/cover_problems.hpp"

namespace {

using namespace planning;

struct Site {
  std::vector<std::vector<Span>> views;
  std::size_t walls{};
  SetCover atoms;
  CoverRules rules;
  GreedyCover greedy;
};

// A campus with `buildings` of about six edges each and 1,000 candidates.
Site make_site(int buildings) {
  support::Dice dice(1);
  const support::SiteSize size{.side_m = 30 * std::sqrt(buildings),
                               .obstacles = buildings,
                               .obstacle_radius_m = 12,
                               .corners_max = 9};
  const nav::FreeArea area = support::random_area(dice, size, 0.5);
  std::vector<Wall> walls;
  for (const nav::SegmentMm& e : nav::edges(area.drivable)) walls.push_back({e.b, e.a});
  const Visibility visibility(walls, {.range_max_m = 100});
  Site s;
  for (const Candidate& at : draw_candidates(area, 1000, 360, 1))
    s.views.push_back(spans_of(visibility.from(at)));
  s.walls = walls.size();
  join_ends(s.views, s.walls);
  s.atoms = wall_atoms(s.views, s.walls);
  s.rules = {.goal_nm = total(s.atoms) / 100 * 95, .gain_min_nm = 0, .overlap_min = 0.2};
  s.greedy = greedy_cover(s.views, s.walls, s.rules);
  s.atoms.goal = std::min(s.rules.goal_nm, covered_nm(s.greedy));
  return s;
}

const Site& site(benchmark::State& state) {
  static const Site small = make_site(16), large = make_site(160);
  const Site& s = state.range(0) == 16 ? small : large;
  state.counters["edges"] = static_cast<double>(s.walls);
  state.counters["atoms"] = static_cast<double>(s.atoms.atoms());
  return s;
}

void cover_greedy_lazy(benchmark::State& state) {
  const Site& s = site(state);
  for (auto _ : state) benchmark::DoNotOptimize(greedy_cover(s.views, s.walls, s.rules));
  state.counters["stations"] = static_cast<double>(s.greedy.picks.size());
}

void cover_greedy_plain(benchmark::State& state) {
  const Site& s = site(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(cover_problems::plain_greedy(s.views, s.walls, s.rules));
}

void cover_atoms(benchmark::State& state) {
  const Site& s = site(state);
  for (auto _ : state) benchmark::DoNotOptimize(wall_atoms(s.views, s.walls));
}

void cover_bound(benchmark::State& state) {
  const Site& s = site(state);
  int at_least = 0;
  for (auto _ : state)
    at_least = stations_at_least(s.atoms, static_cast<int>(s.greedy.picks.size()));
  state.counters["at_least"] = at_least;
}

void cover_refined(benchmark::State& state) {
  const Site& s = site(state);
  std::size_t stations = 0;
  for (auto _ : state)
    stations = refined_cover(s.views, s.walls, s.atoms, s.rules, s.greedy, 0, 1).picks.size();
  state.counters["stations"] = static_cast<double>(stations);
}

BENCHMARK(cover_greedy_lazy)->Arg(16)->Arg(160)->Unit(benchmark::kMillisecond);
BENCHMARK(cover_greedy_plain)->Arg(16)->Arg(160)->Unit(benchmark::kMillisecond);
BENCHMARK(cover_atoms)->Arg(16)->Arg(160)->Unit(benchmark::kMillisecond);
BENCHMARK(cover_bound)->Arg(16)->Arg(160)->Unit(benchmark::kMillisecond);
BENCHMARK(cover_refined)->Arg(16)->Arg(160)->Unit(benchmark::kMillisecond);

}  // namespace
