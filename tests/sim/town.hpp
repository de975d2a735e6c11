// A town to measure speed in.
#pragma once

#include "tests/sim/room.hpp"

namespace sim_test {

// 300 x 300 m with 36 buildings; the ground in 160 x 160 squares, so 51 k triangles.
inline sim::Mesh town() {
  sim::Mesh mesh;
  constexpr int kSquares = 160;
  constexpr double kSide_m = 300.0 / kSquares;
  for (int i = 0; i < kSquares; ++i)
    for (int j = 0; j < kSquares; ++j) {
      const double x = -150 + i * kSide_m, y = -150 + j * kSide_m;
      mesh.add_quad({x, y, 0}, {x + kSide_m, y, 0}, {x + kSide_m, y + kSide_m, 0},
                    {x, y + kSide_m, 0});
    }
  for (int i = 0; i < 36; ++i) {
    const double x = -130 + i % 6 * 45, y = -130 + i / 6 * 45;
    add_box(mesh, {x, y, 0}, {x + 28, y + 14, 6.0 + i % 5 * 4});
  }
  return mesh;
}

}  // namespace sim_test
