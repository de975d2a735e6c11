#include "nav/raster.hpp"

#include <gtest/gtest.h>

#include <random>

#include "nav/polygons.hpp"

namespace {

nav::Polygons ring_with_hole() {
  return {{{{0, 0}, {9000, 500}, {11000, 8000}, {2000, 9500}},
           {{{4000, 4000}, {4000, 6000}, {6500, 6000}, {6500, 4000}}}}};
}

TEST(Raster, AgreesWithPointInPolygonAtEveryCentre) {
  const nav::Polygons shape = ring_with_hole();
  // 0.37 m cells keep the centres off the grid of vertices.
  const nav::RasterGrid grid{{-1.013, -1.017}, 0.37, 40, 33};
  const auto cells = nav::rasterize(shape, grid);
  int inside = 0;
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x) {
      const bool expected = nav::contains(shape, nav::to_mm(grid.center_m(x, y)));
      EXPECT_EQ(cells[grid.index(x, y)] != 0, expected) << x << ' ' << y;
      inside += expected;
    }
  EXPECT_GT(inside, 300);
}

TEST(Raster, CountsVerticesOnACentreLineOnce) {
  // A diamond whose left and right corners lie exactly on a row of centres.
  const nav::Polygons diamond{{{{500, 2500}, {2500, 500}, {4500, 2500}, {2500, 4500}}, {}}};
  const nav::RasterGrid grid{{0, 0}, 1.0, 5, 5};
  const auto cells = nav::rasterize(diamond, grid);
  int inside = 0;
  for (const auto cell : cells) inside += cell;
  // Area 8 m2 on a 1 m grid: the half-open rule gives every border centre to exactly one side.
  EXPECT_EQ(inside, 8);
}

TEST(Raster, ClipsToTheGrid) {
  const nav::Polygons big{
      {{{-100000, -100000}, {100000, -100000}, {100000, 100000}, {-100000, 100000}}, {}}};
  const auto cells = nav::rasterize(big, {{0, 0}, 1.0, 3, 2});
  EXPECT_EQ(cells, std::vector<std::uint8_t>(6, 1));
}

}  // namespace
