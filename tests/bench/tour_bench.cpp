// Tours: the exact method by number of nodes, and the search on random stations and TSPLIB.
#include <benchmark/benchmark.h>

#include <cmath>

#include "planning/tour.hpp"
#include "tests/support/random_site.hpp"
#include "tests/support/tsplib.hpp"

namespace {

planning::TourProblem random_problem(int n, bool symmetric) {
  support::Dice dice(3);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < n; ++i) points.emplace_back(dice.uniform(0, 300), dice.uniform(0, 300));
  planning::TourProblem problem;
  for (const auto& a : points) {
    auto& row = problem.cost.emplace_back();
    for (const auto& b : points)
      row.push_back((a - b).norm() * (symmetric ? 1.0 : dice.uniform(0.8, 1.2)));
  }
  return problem;
}

void BM_HeldKarp(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), true);
  for (auto _ : state)
    benchmark::DoNotOptimize(planning::solve_tour(problem, {.exact_nodes_max = 20}));
}
BENCHMARK(BM_HeldKarp)->Arg(10)->Arg(15)->Arg(18)->Arg(20)->Unit(benchmark::kMillisecond);

void BM_TourSearch(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), state.range(1) != 0);
  for (auto _ : state)
    benchmark::DoNotOptimize(planning::solve_tour(problem, {.exact_nodes_max = 0}));
}
BENCHMARK(BM_TourSearch)->ArgsProduct({{16, 30, 100}, {0, 1}})->Unit(benchmark::kMillisecond);

void BM_Tsplib(benchmark::State& state, const std::string& name) {
  const std::filesystem::path folder =
      std::filesystem::path(__FILE__).parent_path() / "../../../shared/data/bench/tsplib";
  if (!std::filesystem::exists(folder)) return state.SkipWithError("no TSPLIB instances");
  const auto problem = support::tsp_problem(folder / (name + ".tsp"));
  double cost = 0;
  for (auto _ : state) cost = planning::solve_tour(problem).cost;
  const double optimum = support::tsp_optima(folder / "optima.csv").at(name);
  state.counters["gap_percent"] = 100 * (cost / optimum - 1);
}
BENCHMARK_CAPTURE(BM_Tsplib, berlin52, std::string("berlin52"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Tsplib, kroA100, std::string("kroA100"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Tsplib, a280, std::string("a280"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Tsplib, pcb442, std::string("pcb442"))->Unit(benchmark::kMillisecond);

}  // namespace
