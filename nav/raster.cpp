#include "nav/raster.hpp"

#include <algorithm>

namespace nav {
namespace {

// Adds to crossings[row] where an edge crosses the horizontal line through the row's cell centres.
void add_crossings(const Ring& ring, const RasterGrid& grid,
                   std::vector<std::vector<double>>& crossings) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    Eigen::Vector2d low = to_m(ring[i]);
    Eigen::Vector2d high = to_m(ring[(i + 1) % ring.size()]);
    if (low.y() == high.y()) continue;
    if (low.y() > high.y()) std::swap(low, high);
    const auto row_at = [&](double y_m) {
      return static_cast<int>(std::ceil((y_m - grid.W_min_m.y()) / grid.cell_m - 0.5));
    };
    // Half-open in y, so that a vertex on the line counts once.
    const int last = std::min(row_at(high.y()), grid.ny);
    for (int row = std::max(0, row_at(low.y())); row < last; ++row) {
      const double y_m = grid.center_m(0, row).y();
      const double t = (y_m - low.y()) / (high.y() - low.y());
      crossings[static_cast<std::size_t>(row)].push_back(low.x() + t * (high.x() - low.x()));
    }
  }
}

}  // namespace

std::vector<std::uint8_t> rasterize(const Polygons& polygons, const RasterGrid& grid) {
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(grid.ny));
  for (const Polygon& polygon : polygons) {
    add_crossings(polygon.outer, grid, crossings);
    for (const Ring& hole : polygon.holes) add_crossings(hole, grid, crossings);
  }
  std::vector<std::uint8_t> cells(grid.size(), 0);
  for (int row = 0; row < grid.ny; ++row) {
    auto& xs = crossings[static_cast<std::size_t>(row)];
    std::ranges::sort(xs);
    for (std::size_t i = 0; i + 1 < xs.size(); i += 2) {
      const auto column_at = [&](double x_m) {
        return static_cast<int>(std::ceil((x_m - grid.W_min_m.x()) / grid.cell_m - 0.5));
      };
      const int last = std::min(column_at(xs[i + 1]), grid.nx);
      for (int column = std::max(0, column_at(xs[i])); column < last; ++column)
        cells[grid.index(column, row)] = 1;
    }
  }
  return cells;
}

}  // namespace nav
