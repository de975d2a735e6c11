#include "planning/tour.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>

#include "planning/lin_kernighan.hpp"
#include "tests/support/random_site.hpp"
#include "tests/support/tsplib_optima.hpp"

namespace planning {
namespace {

using support::Dice;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const std::filesystem::path kTsplib = VANTAGE_SOURCE_DIR "/../shared/data/bench/tsplib";

TourProblem points_problem(Dice& dice, int n, bool closed) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < n; ++i) points.emplace_back(dice.uniform(0, 100), dice.uniform(0, 100));
  TourProblem problem;
  problem.closed = closed;
  problem.start = dice.below(n);
  for (const auto& a : points) {
    auto& row = problem.cost.emplace_back();
    for (const auto& b : points) row.push_back((a - b).norm());
  }
  return problem;
}

TourProblem asymmetric_problem(Dice& dice, int n, bool closed) {
  TourProblem problem = points_problem(dice, n, closed);
  for (auto& row : problem.cost)
    for (double& cost : row) cost *= dice.uniform(0.7, 1.3);
  return problem;
}

void expect_valid(const TourProblem& problem, const Tour& tour) {
  ASSERT_FALSE(tour.order.empty());
  EXPECT_EQ(tour.order.front(), problem.start);
  std::vector<int> all = tour.order;
  all.insert(all.end(), tour.unreachable.begin(), tour.unreachable.end());
  std::sort(all.begin(), all.end());
  std::vector<int> expected(problem.cost.size());
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(all, expected);
  EXPECT_NEAR(tour.cost, tour_cost(problem, tour.order), 1e-9);
  EXPECT_TRUE(std::is_sorted(tour.unreachable.begin(), tour.unreachable.end()));
}

double brute_force(const TourProblem& problem) {
  std::vector<int> order(problem.cost.size());
  std::iota(order.begin(), order.end(), 0);
  std::swap(order.front(), order[static_cast<std::size_t>(problem.start)]);
  std::sort(order.begin() + 1, order.end());
  double least = kInfinity;
  do {
    least = std::min(least, tour_cost(problem, order));
  } while (std::next_permutation(order.begin() + 1, order.end()));
  return least;
}

TEST(Tour, IsTheCheapestOfAllPermutations) {
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    Dice dice(seed);
    const int n = 1 + static_cast<int>(seed % 8);
    const bool closed = dice.below(2) == 0;
    const TourProblem problem =
        seed % 3 == 0 ? asymmetric_problem(dice, n, closed) : points_problem(dice, n, closed);
    const Tour tour = solve_tour(problem);
    expect_valid(problem, tour);
    EXPECT_TRUE(tour.proven);
    EXPECT_NEAR(tour.cost, brute_force(problem), 1e-9) << "seed " << seed;
  }
}

TEST(Tour, SearchFindsWhatHeldAndKarpProve) {
  int optimal = 0, runs = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const int n = 9 + static_cast<int>(seed % 12);
    const bool closed = dice.below(2) == 0;
    const TourProblem problem =
        seed % 3 == 0 ? asymmetric_problem(dice, n, closed) : points_problem(dice, n, closed);
    const Tour exact = solve_tour(problem);
    const Tour found = solve_tour(problem, {.exact_nodes_max = 0});
    expect_valid(problem, found);
    EXPECT_TRUE(exact.proven);
    EXPECT_FALSE(found.proven);
    EXPECT_GE(found.cost, exact.cost - 1e-9);
    EXPECT_LE(found.cost, exact.cost * 1.03);
    optimal += found.cost <= exact.cost + 1e-9;
    ++runs;
  }
  EXPECT_GE(optimal, runs - 3);
}

TEST(Tour, IsExactUpToTwentyNodes) {
  for (const bool closed : {true, false}) {
    Dice dice(20);
    const TourProblem problem = asymmetric_problem(dice, 20, closed);
    const Tour exact = solve_tour(problem);
    expect_valid(problem, exact);
    EXPECT_TRUE(exact.proven);
    EXPECT_LE(exact.cost, solve_tour(problem, {.exact_nodes_max = 19}).cost + 1e-9);
    EXPECT_FALSE(solve_tour(points_problem(dice, 21, closed)).proven);
  }
}

// What a person would do: always on to the nearest station.
double nearest_neighbour_cost(const TourProblem& problem) {
  std::vector<int> order{problem.start};
  std::vector<char> used(problem.cost.size(), 0);
  used[static_cast<std::size_t>(problem.start)] = 1;
  while (order.size() < problem.cost.size()) {
    const auto& row = problem.cost[static_cast<std::size_t>(order.back())];
    int nearest = -1;
    for (std::size_t j = 0; j < row.size(); ++j)
      if (!used[j] && (nearest < 0 || row[j] < row[static_cast<std::size_t>(nearest)]))
        nearest = static_cast<int>(j);
    used[static_cast<std::size_t>(nearest)] = 1;
    order.push_back(nearest);
  }
  return tour_cost(problem, order);
}

TEST(Tour, IsNeverLongerThanNearestNeighbourFirst) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Dice dice(seed);
    const int n = 16 + static_cast<int>(seed);
    const bool closed = seed % 2 == 0;
    const TourProblem problem =
        seed % 4 < 2 ? asymmetric_problem(dice, n, closed) : points_problem(dice, n, closed);
    const Tour tour = solve_tour(problem, {.kicks_per_node = 5});
    expect_valid(problem, tour);
    EXPECT_LE(tour.cost, nearest_neighbour_cost(problem) + 1e-9) << "seed " << seed;
  }
}

// Whether any reversal of a run, or any run of up to three nodes put elsewhere, would be cheaper.
bool improvable(const TourProblem& problem, const std::vector<int>& order) {
  const double cost = tour_cost(problem, order);
  const auto n = static_cast<std::ptrdiff_t>(order.size());
  for (std::ptrdiff_t i = 1; i < n; ++i)
    for (std::ptrdiff_t j = i + 2; j <= n; ++j) {
      std::vector<int> other = order;
      std::reverse(other.begin() + i, other.begin() + j);
      if (tour_cost(problem, other) < cost - 1e-6) return true;
      for (std::ptrdiff_t k = 1; k <= std::min<std::ptrdiff_t>(3, j - i - 1); ++k) {
        other = order;
        std::rotate(other.begin() + i, other.begin() + i + k, other.begin() + j);
        if (tour_cost(problem, other) < cost - 1e-6) return true;
      }
    }
  return false;
}

TEST(Tour, CannotBeImprovedByTwoOptOrOrOpt) {
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    Dice dice(seed);
    const bool closed = seed % 2 == 0;
    const TourProblem problem =
        seed % 4 < 2 ? asymmetric_problem(dice, 28, closed) : points_problem(dice, 28, closed);
    EXPECT_FALSE(improvable(problem, solve_tour(problem).order)) << "seed " << seed;
  }
}

TEST(Tour, OpenToursNeedNotComeBack) {
  TourProblem line;  // Stations along a straight road, the start at one end.
  for (int i = 0; i < 30; ++i) {
    auto& row = line.cost.emplace_back();
    for (int j = 0; j < 30; ++j) row.push_back(std::abs(i - j));
  }
  line.closed = false;
  std::vector<int> in_order(30);
  std::iota(in_order.begin(), in_order.end(), 0);
  const Tour tour = solve_tour(line);
  EXPECT_EQ(tour.order, in_order);
  EXPECT_EQ(tour.cost, 29);
}

TEST(Tour, LeavesOutAndNamesWhatCannotBeReached) {
  for (const int n : {7, 30}) {
    Dice dice(5);
    TourProblem problem = points_problem(dice, n, true);
    problem.start = 1;
    for (const std::size_t lost : {std::size_t{2}, std::size_t{5}})
      for (std::size_t i = 0; i < problem.cost.size(); ++i)
        if (i != 2 && i != 5) problem.cost[i][lost] = problem.cost[lost][i] = kInfinity;
    const Tour tour = solve_tour(problem);
    expect_valid(problem, tour);
    EXPECT_EQ(tour.unreachable, (std::vector<int>{2, 5}));
    EXPECT_TRUE(std::isfinite(tour.cost));
  }
}

TEST(Tour, OneWayRoadsCountForClosedToursOnly) {
  TourProblem problem{{{0, 1, 1}, {1, 0, 1}, {kInfinity, kInfinity, 0}}, 0, true};
  EXPECT_EQ(solve_tour(problem).unreachable, (std::vector<int>{2}));
  problem.closed = false;
  const Tour open = solve_tour(problem);
  EXPECT_EQ(open.order, (std::vector<int>{0, 1, 2}));
}

TEST(Tour, FindsTheWayAroundMissingLegs) {
  for (const int n : {9, 40}) {  // A ring road: only neighbours are joined, and all to the start.
    TourProblem ring;
    for (int i = 0; i < n; ++i) {
      auto& row = ring.cost.emplace_back();
      for (int j = 0; j < n; ++j) {
        const int apart = std::abs(i - j);
        row.push_back(apart == 0 ? 0 : apart == 1 || apart == n - 1 ? 1 : kInfinity);
      }
    }
    for (std::size_t i = 1; i < ring.cost.size(); ++i)
      ring.cost[0][i] = ring.cost[i][0] = std::min(ring.cost[0][i], 50.0);
    const Tour tour = solve_tour(ring);
    expect_valid(ring, tour);
    EXPECT_TRUE(tour.unreachable.empty());
    EXPECT_EQ(tour.cost, n);
  }
}

TEST(Tour, IsTheSameEveryTime) {
  Dice dice(9);
  const TourProblem problem = points_problem(dice, 60, true);
  EXPECT_EQ(solve_tour(problem).order, solve_tour(problem).order);
}

TEST(Tour, TakesTheLowestIndexOfEquals) {
  for (const bool closed : {false, true}) {
    TourProblem same;
    same.cost.assign(6, std::vector<double>(6, 1.0));
    same.closed = closed;
    const Tour tour = solve_tour(same);
    EXPECT_EQ(tour.order, solve_tour(same).order);
    EXPECT_EQ(tour.order.back(), 1);  // Traced from the end.
  }
}

TEST(Tour, RefusesWhatIsNoProblem) {
  EXPECT_THROW(solve_tour({{}, 0, true}), std::invalid_argument);
  EXPECT_THROW(solve_tour({{{0, 1}, {1, 0}}, 2, true}), std::invalid_argument);
  EXPECT_THROW(solve_tour({{{0, 1}, {1}}, 0, true}), std::invalid_argument);
  EXPECT_THROW(solve_tour({{{0, -1}, {1, 0}}, 0, true}), std::invalid_argument);
  EXPECT_THROW(solve_tour({{{0, std::nan("")}, {1, 0}}, 0, true}), std::invalid_argument);
}

TEST(LinKernighan, KeepsEveryNodeOnce) {
  for (int n = 8; n < 40; ++n) {
    Dice dice(static_cast<std::uint64_t>(n));
    SymmetricCosts costs;
    costs.n = n;
    costs.cost.assign(static_cast<std::size_t>(n * n), 0);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j)
        costs.cost[static_cast<std::size_t>(i * n + j)] =
            costs.cost[static_cast<std::size_t>(j * n + i)] = std::floor(dice.uniform(0, 20));
    std::vector<int> order = lin_kernighan(costs, 20, 1);
    std::sort(order.begin(), order.end());
    for (int i = 0; i < n; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  }
}

TEST(Tour, IsWithinOnePercentOnEveryTsplibInstance) {
  if (!std::filesystem::exists(kTsplib)) GTEST_SKIP() << "no TSPLIB instances at " << kTsplib;
  const auto optima = support::tsp_optima(kTsplib / "optima.csv");
  ASSERT_GE(optima.size(), 17u);
  for (const auto& [name, optimum] : optima) {
    const TourProblem problem = support::tsp_problem(kTsplib / (name + ".tsp"));
    Tour tour;
    double took_s = 10;
    for (int tries = 0; tries < 3 && took_s > 1; ++tries) {  // A guest's processor may be slow now.
      const std::clock_t before = std::clock();
      tour = solve_tour(problem);
      took_s = std::min(took_s, static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    }
    expect_valid(problem, tour);
    EXPECT_GE(tour.cost, optimum) << name
                                  << ": shorter than the optimum, so the distances are wrong";
    EXPECT_LE(tour.cost, optimum * 1.01) << name;
    if (tour.order.size() <= 100) {
      EXPECT_EQ(tour.cost, optimum) << name;
    }
#ifdef NDEBUG  // Sanitizers are slow.
    EXPECT_LE(took_s, 1) << name;
#endif
    std::printf("%-10s %7.0f  gap %.3f %%  %.2f s\n", name.c_str(), tour.cost,
                100 * (tour.cost / optimum - 1), took_s);
  }
}

}  // namespace
}  // namespace planning
