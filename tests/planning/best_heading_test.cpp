#include "planning/best_heading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace planning {
namespace {

std::uint32_t counted(const HorizontalView& view, Voxel p, double heading_rad,
                      const std::vector<Voxel>& voxels) {
  std::uint32_t count = 0;
  for (const Voxel u : voxels) count += view.faces(p, heading_rad, u);
  return count;
}

std::vector<Voxel> around(Voxel p, int count, std::mt19937& random) {
  std::vector<Voxel> voxels;
  for (int i = 0; i < count; ++i)
    voxels.push_back({p.x + static_cast<int>(random() % 41) - 20,
                      p.y + static_cast<int>(random() % 41) - 20, static_cast<int>(random() % 5)});
  return voxels;
}

// Every heading at which the count can change: a border of the view on a voxel.
std::uint32_t most_by_trying(double fov_deg, Voxel p, const std::vector<Voxel>& voxels) {
  const HorizontalView view(fov_deg);
  std::uint32_t most = counted(view, p, 0, voxels);
  for (const Voxel u : voxels)
    for (const double back : {0.0, fov_deg / 2, -fov_deg / 2})
      for (const double hair : {-2e-9, 0.0, 2e-9}) {
        const double heading =
            std::atan2(u.y - p.y, u.x - p.x) + back * std::numbers::pi / 180 + hair;
        most = std::max(most, counted(view, p, heading, voxels));
      }
  return most;
}

TEST(BestHeading, SeesAsMuchAsAnyHeadingAndWhatItClaims) {
  std::mt19937 random(5);
  const Voxel p{50, 50, 1};
  for (int round = 0; round < 60; ++round) {
    const std::vector<Voxel> voxels = around(p, 1 + static_cast<int>(random() % 60), random);
    for (const double fov_deg : {10.0, 90.0, 179.5, 270.0, 359.0}) {
      const HorizontalView view(fov_deg);
      const auto best = view.best(p, voxels);
      EXPECT_EQ(best.seen, counted(view, p, best.heading_rad, voxels)) << fov_deg;
      EXPECT_EQ(best.seen, most_by_trying(fov_deg, p, voxels)) << fov_deg;
      EXPECT_GE(best.heading_rad, -std::numbers::pi - 1e-9);
      EXPECT_LT(best.heading_rad, std::numbers::pi + 1e-9);
    }
  }
}

TEST(BestHeading, LooksBackwardsAcrossTheSeam) {
  const Voxel p{50, 50, 1};
  const auto best = HorizontalView(40).best(p, {{30, 51, 1}, {30, 49, 1}, {70, 50, 1}});
  EXPECT_EQ(best.seen, 2U);
  EXPECT_NEAR(std::abs(best.heading_rad), std::numbers::pi, 1e-6);
}

TEST(BestHeading, OverheadIsAlwaysInViewAndAllAroundSeesAll) {
  const Voxel p{5, 5, 1};
  EXPECT_EQ(HorizontalView(20).best(p, {{5, 5, 9}}).seen, 1U);
  EXPECT_EQ(HorizontalView(360).best(p, {{5, 5, 9}, {1, 5, 1}, {9, 5, 1}}).seen, 3U);
  EXPECT_EQ(HorizontalView(20).best(p, {}).seen, 0U);
  EXPECT_THROW(HorizontalView(0), std::invalid_argument);
  EXPECT_THROW(HorizontalView(361), std::invalid_argument);
}

}  // namespace
}  // namespace planning
