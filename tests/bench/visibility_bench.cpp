// Phase I in one run: line of sight by the sweep and by the pairwise shadows of the oracle, the
// whole view with all clipping, and whole plans.
#include <benchmark/benchmark.h>

#include "planning/cover.hpp"
#include "tests/bench/visibility_sites.hpp"
#include "tests/planning/visibility_oracle.hpp"

namespace {

template <class Look>
void look_round(benchmark::State& state, const Look& look) {
  const bench::VisibilitySite s = bench::visibility_site(static_cast<int>(state.range(0)));
  const planning::Visibility visibility(s.walls, {.range_max_m = 100});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(look(s, visibility, s.candidates[i]));
    i = (i + 1) % s.candidates.size();
  }
  state.counters["edges"] = static_cast<double>(s.walls.size());
}

void view_clipped(benchmark::State& state) {
  look_round(state, [](const auto&, const auto& v, const auto& at) { return v.from(at); });
}
void sight_unlimited(benchmark::State& state) {
  look_round(state,
             [](const auto&, const auto& v, const auto& at) { return v.in_sight(at.position); });
}
void sight_unlimited_by_shadows(benchmark::State& state) {
  look_round(state, [](const auto& s, const auto&, const auto& at) {
    return oracle::sight_by_shadows(at.position, s.walls);
  });
}
void explained(benchmark::State& state) {
  look_round(state, [](const auto&, const auto& v, const auto& at) { return v.explain(at); });
}

void plan(benchmark::State& state) {
  const bench::VisibilitySite s = bench::visibility_site(static_cast<int>(state.range(0)));
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
BENCHMARK(sight_unlimited_by_shadows)->Arg(16)->Arg(160)->Unit(benchmark::kMicrosecond);
BENCHMARK(explained)->Arg(16)->Arg(160)->Unit(benchmark::kMicrosecond);
BENCHMARK(plan)
    ->Args({48, 1000})
    ->Args({48, 2000})
    ->Args({160, 1000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
