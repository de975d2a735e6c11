// Tours: the exact method by number of nodes beside trying every order, and the search on random
// stations and TSPLIB beside going on to the nearest.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "planning/tour.hpp"
#include "tests/support/random_site.hpp"
#include "tests/support/tsplib_optima.hpp"

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

void tour_exact(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), true);
  for (auto _ : state) benchmark::DoNotOptimize(planning::solve_tour(problem));
}
void tour_exact_by_permutations(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), true);
  for (auto _ : state) {
    std::vector<int> order(problem.cost.size());
    std::iota(order.begin(), order.end(), 0);
    double least = planning::tour_cost(problem, order);
    while (std::next_permutation(order.begin() + 1, order.end()))
      least = std::min(least, planning::tour_cost(problem, order));
    benchmark::DoNotOptimize(least);
  }
}
BENCHMARK(tour_exact)->Arg(10)->Arg(15)->Arg(18)->Arg(20)->Unit(benchmark::kMillisecond);
BENCHMARK(tour_exact_by_permutations)->Arg(10)->Unit(benchmark::kMillisecond);

// The search where the exact method can be its reference, in time and in length.
void tour_search(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), state.range(1) != 0);
  double cost = 0;
  for (auto _ : state) cost = planning::solve_tour(problem, {.exact_nodes_max = 0}).cost;
  state.counters["length"] = cost;
}
void tour_search_by_held_karp(benchmark::State& state) {
  const auto problem = random_problem(static_cast<int>(state.range(0)), state.range(1) != 0);
  double cost = 0;
  for (auto _ : state) cost = planning::solve_tour(problem).cost;
  state.counters["length"] = cost;
}
BENCHMARK(tour_search)->ArgsProduct({{16, 20, 30, 100}, {0, 1}})->Unit(benchmark::kMillisecond);
BENCHMARK(tour_search_by_held_karp)->ArgsProduct({{16, 20}, {0, 1}})->Unit(benchmark::kMillisecond);

double nearest_neighbour(const planning::TourProblem& problem) {
  std::vector<int> order(problem.cost.size());
  std::iota(order.begin(), order.end(), 0);
  for (auto last = order.begin(); last + 1 < order.end(); ++last) {
    const auto& from = problem.cost[static_cast<std::size_t>(*last)];
    std::iter_swap(last + 1, std::min_element(last + 1, order.end(), [&](int a, int b) {
                     return from[static_cast<std::size_t>(a)] < from[static_cast<std::size_t>(b)];
                   }));
  }
  return planning::tour_cost(problem, order);
}

const std::filesystem::path folder =
    std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/bench/tsplib";

template <class Solve>
void tsplib(benchmark::State& state, const std::string& name, const Solve& solve) {
  const auto problem = support::tsp_problem(folder / (name + ".tsp"));
  double cost = 0;
  for (auto _ : state) cost = solve(problem);
  const double optimum = support::tsp_optima(folder / "optima.csv").at(name);
  state.counters["gap_percent"] = 100 * (cost / optimum - 1);
}

// Nothing to time without the instances, which lie beside the project.
[[maybe_unused]] const int kRegistered = [] {
  if (!std::filesystem::exists(folder)) return 0;
  for (const std::string name :
       {"burma14", "ulysses16", "gr17", "bays29", "att48", "eil51", "berlin52", "st70", "eil76",
        "pr76", "rat99", "kroA100", "lin105", "ch130", "pr226", "a280", "pcb442"}) {
    benchmark::RegisterBenchmark(("tsplib/" + name).c_str(), [name](benchmark::State& state) {
      tsplib(state, name, [](const auto& p) { return planning::solve_tour(p).cost; });
    })->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(
        ("tsplib_by_nearest/" + name).c_str(),
        [name](benchmark::State& state) { tsplib(state, name, nearest_neighbour); })
        ->Unit(benchmark::kMillisecond);
  }
  return 0;
}();

}  // namespace
