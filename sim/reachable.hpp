// Which places can be reached on the ground from some others. Truth for the judge: it asks the
// world, not the map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace sim {

// Square cells of cell_m from W_min_m (the lower left corner of cell (0, 0)), row by row.
struct GroundCells {
  Eigen::Vector2d W_min_m{0, 0};
  double cell_m = 0.25;
  int nx = 0, ny = 0;

  // The index of the cell that holds the point, or -1.
  std::int64_t index_at(const Eigen::Vector2d& W_point_m) const;
  Eigen::Vector2d center_m(std::int64_t index) const;
};

// One byte per cell: 1 where a way over neighbouring cells (sides and corners), on all of which
// stands() holds, leads there from a seed. Seeds are taken for reachable as they are; those outside
// the cells are ignored. stands() is called at most once per cell, with its centre.
std::vector<std::uint8_t> reachable(const GroundCells& cells,
                                    std::span<const Eigen::Vector2d> W_seeds_m,
                                    const std::function<bool(const Eigen::Vector2d&)>& stands);

}  // namespace sim
