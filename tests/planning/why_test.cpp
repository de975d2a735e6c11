#include "planning/why.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "planning/never_visible.hpp"
#include "tests/planning/view_cases.hpp"
#include "tests/planning/voxel_oracle.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::NeverVisible;
using planning::ViewLimits;
using planning::ViewVerdict;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;
using planning::WhyView;

// The verdict by asking one thing after the other, from the definitions.
ViewVerdict literal_verdict(const VoxelMap& map, const BoundaryVoxel& u, Voxel p,
                            const ViewLimits& limits) {
  const double voxel_m = map.grid().voxel_m;
  const auto counts = [&](std::uint8_t faces, ViewLimits with) {
    return oracle::counts_geometrically({u.v, faces}, p, with, voxel_m);
  };
  const planning::ViewRule rule(limits, voxel_m);
  const std::int64_t x = p.x - u.v.x, y = p.y - u.v.y, z = p.z - u.v.z;
  const std::int64_t distance2 = x * x + y * y + z * z;
  if (distance2 > rule.distance2_max()) return ViewVerdict::too_far;
  if (distance2 < rule.distance2_min()) return ViewVerdict::too_near;
  ViewLimits facing = limits, fair = limits;
  facing.density_min_ppm2 = fair.density_min_ppm2 = 0;
  facing.grazing_max_deg = 90;
  if (!counts(u.faces, facing)) return ViewVerdict::faces_away;
  if (!counts(u.faces, fair)) return ViewVerdict::grazing;
  if (!counts(u.faces, limits)) return ViewVerdict::sparse;
  return oracle::visible(map, u.v, p) ? ViewVerdict::visible : ViewVerdict::blocked;
}

std::optional<Voxel> literal_blocker(const VoxelMap& map, Voxel u, Voxel p) {
  for (const Voxel v : oracle::voxels_by_crossings({2 * p.x + 1, 2 * p.y + 1, 2 * p.z + 1},
                                                   {2 * u.x + 1, 2 * u.y + 1, 2 * u.z + 1}, 2))
    if (v != u && v != p && map.at(v) != VoxelState::seen_empty) return v;
  return std::nullopt;
}

worlds::ViewCase dense_case(std::uint64_t seed) {
  worlds::ViewCase c = worlds::random_case(seed, 12, 50);
  if (seed % 2 == 0) {
    c.limits.beams_per_sr = 1000;
    c.limits.density_min_ppm2 = 1 + static_cast<double>(seed % 50);
  }
  return c;
}

TEST(WhyView, NamesTheFirstConstraintAndTheFirstBlockerOfTheLiteralLoop) {
  std::size_t told[7] = {};
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    const worlds::ViewCase c = dense_case(seed);
    for (std::size_t i = 0; i < c.boundary.size(); i += 7)
      for (const Voxel p : c.candidates) {
        const BoundaryVoxel u = c.boundary[i];
        if (u.v == p) continue;
        const WhyView why = planning::why_view(c.map, u, p, c.limits);
        ASSERT_EQ(why.verdict, literal_verdict(c.map, u, p, c.limits)) << "seed " << seed;
        if (why.verdict == ViewVerdict::blocked) {
          ASSERT_EQ(why.blocker, literal_blocker(c.map, u.v, p));
          ASSERT_EQ(why.blocker_state, c.map.at(*why.blocker));
        }
        ++told[static_cast<std::size_t>(why.verdict)];
      }
  }
  for (const std::size_t count : told) EXPECT_GT(count, 100U);
}

TEST(WhyView, SaysVisibleForExactlyWhatTheTallyCounts) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const worlds::ViewCase c = dense_case(seed);
    const auto counts = planning::tally(c.map, c.boundary, c.candidates, c.limits);
    for (std::size_t k = 0; k < c.candidates.size(); ++k) {
      std::uint32_t visible = 0;
      for (const BoundaryVoxel& u : c.boundary)
        visible +=
            u.v != c.candidates[k] &&
            planning::why_view(c.map, u, c.candidates[k], c.limits).verdict == ViewVerdict::visible;
      ASSERT_EQ(visible, counts[k]) << "seed " << seed;
    }
  }
}

TEST(WhyView, GivesTheNumbersInWordsForAnOperator) {
  VoxelMap map = worlds::noise(40, 40, 3, 0, 0, 1);
  map.set({20, 20, 0}, VoxelState::unseen);
  BoundaryVoxel u{{20, 20, 0}, planning::kFaceXPlus};
  const ViewLimits limits{2, 15, 70};
  const auto words = [&](Voxel p) { return text(planning::why_view(map, u, p, limits)); };
  EXPECT_EQ(words({38, 20, 0}), "out of range: 18.00 m away, the scanner reaches 15.00 m");
  EXPECT_EQ(words({21, 20, 0}), "too near: 1.00 m away, the scanner measures from 2.00 m on");
  EXPECT_EQ(words({10, 20, 0}),
            "faces away: the beam would come from behind (180.0 deg from the outward normal)");
  EXPECT_EQ(words({23, 32, 0}),
            "too flat: the beam meets it at 76.0 deg from the normal, the limit is 70.0 deg");
  EXPECT_EQ(words({30, 30, 0}), "visible: 14.14 m away, at 45.0 deg from the normal");
  map.set({28, 28, 0}, VoxelState::seen_occupied);
  map.set({24, 24, 0}, VoxelState::unseen);
  EXPECT_EQ(words({30, 30, 0}), "blocked by voxel (28, 28, 0), where a scan has seen something");
  EXPECT_EQ(words({26, 26, 0}),
            "blocked by voxel (24, 24, 0), which no scan has seen yet: it may be air or not");
}

TEST(WhyView, RefusesQuestionsWithoutAnAnswer) {
  const VoxelMap map = worlds::noise(4, 4, 4, 0, 0, 1);
  EXPECT_THROW(planning::why_view(map, {{1, 1, 1}, 0}, {2, 2, 2}, {}), std::invalid_argument);
  EXPECT_THROW(planning::why_view(map, {{1, 1, 1}, 1}, {1, 1, 1}, {}), std::invalid_argument);
  EXPECT_THROW(planning::why_view(map, {{1, 1, 1}, 1}, {4, 1, 1}, {}), std::invalid_argument);
}

TEST(ExposedFaces, AreThoseOfTheBoundaryList) {
  const worlds::ViewCase c = worlds::random_case(3);
  for (const BoundaryVoxel& u : c.boundary) EXPECT_EQ(planning::with_exposed_faces(c.map, u.v), u);
}

std::vector<NeverVisible> literal_never_visible(const worlds::ViewCase& c) {
  std::vector<NeverVisible> result;
  for (std::size_t i = 0; i < c.boundary.size(); ++i) {
    ViewVerdict most = ViewVerdict::too_far;
    for (const Voxel p : c.candidates)
      most = std::max(most, literal_verdict(c.map, c.boundary[i], p, c.limits));
    if (most != ViewVerdict::visible) result.push_back({static_cast<std::uint32_t>(i), most});
  }
  return result;
}

TEST(NeverVisible, ListsWhatNoCandidateSeesWithTheReasonOfTheOneThatCameFurthest) {
  std::size_t told[7] = {};
  for (std::uint64_t seed = 1; seed <= 250; ++seed) {
    const worlds::ViewCase c = dense_case(seed);
    const auto slow = literal_never_visible(c);
    for (const int threads : {1, 3})
      ASSERT_EQ(planning::never_visible(c.map, c.boundary, c.candidates, c.limits, threads), slow)
          << "seed " << seed << ", threads " << threads;
    for (const NeverVisible& voxel : slow) ++told[static_cast<std::size_t>(voxel.reason)];
  }
  for (std::size_t i = 0; i < 6; ++i) EXPECT_GT(told[i], 20U) << name(static_cast<ViewVerdict>(i));
}

TEST(NeverVisible, AreRoofsAndPocketsOnASite) {
  const worlds::Site site;
  const auto boundary = planning::boundary_unseen(site.map);
  const auto candidates = worlds::cells(site.map, site.world, 2);
  const ViewLimits limits{1, 60, 70};
  const auto never = planning::never_visible(site.map, boundary, candidates, limits, 2);
  std::vector<char> is_never(boundary.size());
  for (const NeverVisible& voxel : never) is_never[voxel.voxel] = 1;
  std::vector<BoundaryVoxel> roofs, rest;
  for (std::size_t i = 0; i < boundary.size(); ++i)
    if (is_never[i]) roofs.push_back(boundary[i]);
  ASSERT_GT(roofs.size(), 100U);
  ASSERT_LT(roofs.size(), boundary.size());
  const auto counts = planning::tally(site.map, roofs, candidates, limits);
  EXPECT_EQ(planning::best(counts)->gain_voxels, 0U);
}

TEST(NeverVisible, IsEverythingWithoutCandidates) {
  const worlds::ViewCase c = worlds::random_case(4);
  const auto never = planning::never_visible(c.map, c.boundary, {}, c.limits);
  ASSERT_EQ(never.size(), c.boundary.size());
  for (const NeverVisible& voxel : never) EXPECT_EQ(voxel.reason, ViewVerdict::too_far);
}

}  // namespace
