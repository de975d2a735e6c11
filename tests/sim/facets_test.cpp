#include "sim/facets.hpp"

#include <gtest/gtest.h>

#include "tests/sim/room.hpp"

namespace {

// Two triangles on the edge from (0, 0, 0) to (1, 1, 0), with their other corners here.
sim::Facets two(const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  sim::Mesh mesh;
  mesh.W_vertices_m = {{0, 0, 0}, {1, 1, 0}, left, right};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};
  return sim::join_facets(mesh);
}

TEST(JoinFacets, MakesOneQuadrilateralOfASquare) {
  const auto facets = two({0, 1, 0}, {1, 0, 0});
  ASSERT_EQ(facets.all.size(), 1u);
  EXPECT_EQ(facets.all[0].count, 4);
  EXPECT_EQ(facets.of_triangle, (std::vector<std::uint32_t>{0, 0}));
  const Eigen::Vector3d middle(0.5, 0.5, 0);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(facets.all[0].inward[i].dot(middle - facets.all[0].corners_m[i]), 0.5, 1e-12);
}

TEST(JoinFacets, KeepsTrianglesThatAreNotFlatTogetherApart) {
  EXPECT_EQ(two({0, 1, 0}, {1, 0, 0.001}).all.size(), 2u);
}

TEST(JoinFacets, KeepsTrianglesThatAreNotConvexTogetherApart) {
  EXPECT_EQ(two({0, 1, 0}, {-0.5, -0.8, 0}).all.size(), 2u);
}

TEST(JoinFacets, KeepsTrianglesThatLieOnEachOtherApart) {
  EXPECT_EQ(two({0, 1, 0}, {0.2, 0.9, 0}).all.size(), 2u);
}

TEST(JoinFacets, JoinsEverySideOfABox) {
  sim::Mesh mesh;
  sim_test::add_box(mesh, {1, 2, 3}, {2, 4, 9});
  const auto facets = sim::join_facets(mesh);
  EXPECT_EQ(facets.all.size(), 6u);
  for (const auto& facet : facets.all) EXPECT_EQ(facet.count, 4);
}

}  // namespace
