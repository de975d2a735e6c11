// What the roads promise along their whole length, asked of every wall.
#include "nav/medial_axis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "nav/segment_distance.hpp"
#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;
using support::Dice;

constexpr MedialConfig kConfig{.clearance_min_m = 0.5, .arc_error_m = 0.01, .step_max_m = 1.0};

// Boxes on a coarse grid: many touch in corners or along edges, or lie on the yard's border.
Polygons touching_yard(Dice& dice) {
  std::vector<Polygons> boxes;
  for (int i = 0; i < 30; ++i)
    boxes.push_back(
        {Polygon{support::rectangle_mm(2 * dice.below(20), 2 * dice.below(20),
                                       2 * (1 + dice.below(3)), 2 * (1 + dice.below(3))),
                 {}}});
  return subtract({Polygon{support::rectangle_mm(0, 0, 44, 44), {}}}, unite(boxes));
}

void expect_promises(const Polygons& ground) {
  const MedialAxis axis = medial_axis(ground, kConfig);
  ASSERT_GT(axis.edges.size(), 30u);
  std::vector<Segment2> walls_m;
  for (const SegmentMm& e : edges(ground)) walls_m.push_back({to_m(e.a), to_m(e.b)});
  for (const MedialAxis::Edge& e : axis.edges) {
    const auto a = static_cast<std::size_t>(e.a), b = static_cast<std::size_t>(e.b);
    const Segment2 road{axis.nodes_m[a], axis.nodes_m[b]};
    double clearance_m = std::numeric_limits<double>::infinity();
    for (const Segment2& wall : walls_m) clearance_m = std::min(clearance_m, distance(road, wall));
    const double at_ends_m = std::min(axis.clearance_m[a], axis.clearance_m[b]);
    EXPECT_LE(clearance_m, at_ends_m + 1e-5) << road.a.transpose();
    EXPECT_GE(clearance_m, at_ends_m - kConfig.arc_error_m) << road.a.transpose();
    EXPECT_GE(at_ends_m, kConfig.clearance_min_m - 1e-5) << road.a.transpose();
    for (const double share : {0.0, 0.3, 0.7, 1.0})
      EXPECT_TRUE(contains(ground, to_mm(road.a + share * (road.b - road.a))));
  }
}

TEST(MedialAxis, EveryEdgeLiesInsideAndIsNarrowestAtAnEnd) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    expect_promises(seed % 2 == 0 ? touching_yard(dice)
                                  : support::random_area(dice, {}, 0.5).drivable);
  }
}

}  // namespace
}  // namespace nav
