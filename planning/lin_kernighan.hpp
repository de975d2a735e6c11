// Local search for symmetric tours: Lin-Kernighan steps and Or-opt on an array, with perturbations.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace planning {

// Symmetric finite costs between n nodes, row by row. Costs may be negative.
struct SymmetricCosts {
  int n{};
  std::vector<double> cost;

  double operator()(int a, int b) const {
    return cost[static_cast<std::size_t>(a) * static_cast<std::size_t>(n) +
                static_cast<std::size_t>(b)];
  }
};

// A short closed tour of n >= 8 nodes: nearest neighbour from every node (from 120 of them if there
// are more), local search on each, then kicks_per_node * n perturbations (double bridges) of the
// best. Deterministic.
std::vector<int> lin_kernighan(const SymmetricCosts& cost, int kicks_per_node, std::uint64_t seed);

}  // namespace planning
