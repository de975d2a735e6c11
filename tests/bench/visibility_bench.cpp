// Phase I in one run: line of sight by the sweep and by the pairwise shadows of the oracle, the
// whole view with all clipping, and whole plans.
#include <benchmark/benchmark.h>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"
#include "tests/planning/visibility_oracle.hpp"
#include "tests/support/random_site.hpp"

namespace {

using planning::Wall;

struct Site {
  nav::FreeArea area;
  std::vector<Wall> walls;
  std::vector<planning::Candidate> candidates;
};

// Buildings of about six edges each, as dense everywhere as a campus, with `obstacles` of them.
Site site(int obstacles) {
  support::Dice dice(1);
  const support::SiteSize size{.side_m = 30 * std::sqrt(obstacles),
                               .obstacles = obstacles,
                               .obstacle_radius_m = 12,
                               .corners_max = 9};
  Site s{support::random_area(dice, size, 0.5), {}, {}};
  for (const nav::SegmentMm& e : nav::edges(s.area.drivable)) s.walls.push_back({e.b, e.a});
  s.candidates = planning::draw_candidates(s.area, 200, 360, 1);
  return s;
}

template <class Look>
void look_round(benchmark::State& state, const Look& look) {
  const Site s = site(static_cast<int>(state.range(0)));
  const planning::Visibility visibility(s.walls, {.range_max_m = 100});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(look(s, visibility, s.candidates[i]));
    i = (i + 1) % s.candidates.size();
  }
  state.counters["edges"] = static_cast<double>(s.walls.size());
}

void view_clipped(benchmark::State& state) {
  look_round(state, [](const Site&, const auto& v, const auto& at) { return v.from(at); });
}
void sight_unlimited(benchmark::State& state) {
  look_round(state,
             [](const Site&, const auto& v, const auto& at) { return v.in_sight(at.position); });
}
void sight_unlimited_oracle(benchmark::State& state) {
  look_round(state, [](const Site& s, const auto&, const auto& at) {
    return oracle::sight_by_shadows(at.position, s.walls);
  });
}
void explained(benchmark::State& state) {
  look_round(state, [](const Site&, const auto& v, const auto& at) { return v.explain(at); });
}

void plan(benchmark::State& state) {
  const Site s = site(static_cast<int>(state.range(0)));
  const planning::CoverConfig config{
      .candidates = static_cast<int>(state.range(1)), .coverage_goal = 0.98, .gain_min = 0.001};
  std::size_t stations = 0;
  for (auto _ : state)
    stations =
        planning::plan_cover(s.area, s.walls, {.range_max_m = 100}, config, 1, 2).stations.size();
  state.counters["edges"] = static_cast<double>(s.walls.size());
  state.counters["stations"] = static_cast<double>(stations);
}

BENCHMARK(view_clipped)->Arg(16)->Arg(160)->Arg(1600)->Unit(benchmark::kMicrosecond);
BENCHMARK(sight_unlimited)->Arg(16)->Arg(160)->Unit(benchmark::kMicrosecond);
BENCHMARK(sight_unlimited_oracle)->Arg(16)->Arg(160)->Unit(benchmark::kMicrosecond);
BENCHMARK(explained)->Arg(16)->Arg(160)->Unit(benchmark::kMicrosecond);
BENCHMARK(plan)
    ->Args({48, 1000})
    ->Args({48, 2000})
    ->Args({160, 1000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
