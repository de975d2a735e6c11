#include "sim/reachable.hpp"

#include <algorithm>

namespace sim {

std::int64_t GroundCells::index_at(const Eigen::Vector2d& W_point_m) const {
  const Eigen::Vector2d q = (W_point_m - W_min_m) / cell_m;
  if (!(q.x() >= 0 && q.y() >= 0 && q.x() < nx && q.y() < ny)) return -1;
  return static_cast<std::int64_t>(q.y()) * nx + static_cast<std::int64_t>(q.x());
}

Eigen::Vector2d GroundCells::center_m(std::int64_t index) const {
  return W_min_m + cell_m * Eigen::Vector2d(static_cast<double>(index % nx) + 0.5,
                                            static_cast<double>(index / nx) + 0.5);
}

std::vector<std::uint8_t> reachable(const GroundCells& cells,
                                    std::span<const Eigen::Vector2d> W_seeds_m,
                                    const std::function<bool(const Eigen::Vector2d&)>& stands) {
  enum : std::uint8_t { kUnasked, kReached, kRefused };
  std::vector<std::uint8_t> state(
      static_cast<std::size_t>(cells.nx) * static_cast<std::size_t>(cells.ny), kUnasked);
  std::vector<std::int64_t> open;
  const auto reach = [&](std::int64_t index) {
    state[static_cast<std::size_t>(index)] = kReached;
    open.push_back(index);
  };
  for (const Eigen::Vector2d& seed : W_seeds_m) {
    const std::int64_t index = cells.index_at(seed);
    if (index >= 0 && state[static_cast<std::size_t>(index)] != kReached) reach(index);
  }
  while (!open.empty()) {
    const std::int64_t at = open.back();
    open.pop_back();
    const std::int64_t x = at % cells.nx, y = at / cells.nx;
    for (std::int64_t ny = std::max<std::int64_t>(y - 1, 0); ny <= y + 1 && ny < cells.ny; ++ny)
      for (std::int64_t nx = std::max<std::int64_t>(x - 1, 0); nx <= x + 1 && nx < cells.nx; ++nx) {
        const std::int64_t next = ny * cells.nx + nx;
        std::uint8_t& answer = state[static_cast<std::size_t>(next)];
        if (answer != kUnasked) continue;
        if (stands(cells.center_m(next)))
          reach(next);
        else
          answer = kRefused;
      }
  }
  for (std::uint8_t& answer : state) answer = answer == kReached;
  return state;
}

}  // namespace sim
