// The order in which to visit the stations: a travelling salesperson's tour (paper 5.2.1).
#pragma once

#include <cstdint>
#include <vector>

namespace planning {

struct TourProblem {
  // Row from, column to; any one unit (metres, seconds). Need not be symmetric nor metric; >= 0;
  // infinite where one cannot go. The diagonal is ignored.
  std::vector<std::vector<double>> cost;
  int start = 0;
  bool closed = true;  // Comes back to the start; else it may end anywhere.
};

struct TourConfig {
  int exact_nodes_max = 20;  // Up to here Held and Karp's exact method; at most kExactNodesCap.
  int kicks_per_node = 20;   // Above: perturbations tried after local search from every start.
  std::uint64_t seed = 1;    // Of the perturbations.
};
// Held and Karp need 2^(n-1) * (n-1) * 8 bytes, 80 MB at 20 nodes, and 2^(n-3) * n^2 steps.
inline constexpr int kExactNodesCap = 20;

struct Tour {
  std::vector<int> order;        // Starts with the start; each reachable node once.
  double cost{};                 // Of all legs, with the way back if closed.
  bool proven{};                 // No tour of these nodes is cheaper.
  std::vector<int> unreachable;  // Nodes left out, ascending: no tour leads there.
};

// Visits every node that can be reached from the start (and, if closed, left for the start).
// Deterministic; ties go to the lowest index. Throws std::invalid_argument for a matrix that is not
// square, a start outside it, or a cost that is negative or not a number.
Tour solve_tour(const TourProblem& problem, const TourConfig& config = {});

// What the order costs, leg by leg.
double tour_cost(const TourProblem& problem, const std::vector<int>& order);

}  // namespace planning
