// Polygons on a square grid: which cell centres lie inside.
#pragma once

#include <cstdint>
#include <vector>

#include "nav/geometry.hpp"

namespace nav {

// Cells of cell_m from W_min_m (the lower left corner of cell (0, 0)) in W.
struct RasterGrid {
  Eigen::Vector2d W_min_m{0, 0};
  double cell_m = 1.0;
  int nx{}, ny{};

  std::size_t size() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(x);
  }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < nx && y < ny; }
  Eigen::Vector2d center_m(int x, int y) const {
    return W_min_m + cell_m * Eigen::Vector2d(x + 0.5, y + 0.5);
  }
};

// One byte per cell, row by row: 1 where the cell's centre lies inside (even-odd rule; a centre on
// the border falls to one side consistently). O(edges x rows crossed + cells).
std::vector<std::uint8_t> rasterize(const Polygons& polygons, const RasterGrid& grid);

}  // namespace nav
