#include "planning/stop_certificate.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/planning/view_cases.hpp"
#include "tests/planning/voxel_oracle.hpp"

namespace {

using planning::BestView;
using planning::BoundaryVoxel;
using planning::OptimisticConfig;
using planning::StopCertificate;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;
using worlds::Random;
using worlds::uniform;

bool among(const std::vector<Voxel>& voxels, Voxel v) {
  return std::find(voxels.begin(), voxels.end(), v) != voxels.end();
}

// Opt(p) as the header defines it, word for word.
std::uint32_t literal_optimum(const VoxelMap& map, Voxel p, const ViewLimits& limits,
                              const OptimisticConfig& config) {
  const auto blocks = [&](Voxel v) {
    return map.at(v) == VoxelState::seen_occupied || among(config.never_empty, v);
  };
  const Voxel beside[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
  std::uint32_t count = 0;
  for (int z = 0; z < map.grid().nz; ++z)
    for (int y = 0; y < map.grid().ny; ++y)
      for (int x = 0; x < map.grid().nx; ++x) {
        if (map.at({x, y, z}) != VoxelState::unseen) continue;
        if (config.counts && !config.counts({x, y, z})) continue;
        unsigned faces = 0;
        for (int f = 0; f < 6; ++f) {
          const Voxel v{x + beside[f].x, y + beside[f].y, z + beside[f].z};
          if (map.grid().contains(v) && !blocks(v)) faces |= 1U << f;
        }
        const BoundaryVoxel u{{x, y, z}, static_cast<std::uint8_t>(faces)};
        if (!oracle::counts_geometrically(u, p, limits, map.grid().voxel_m)) continue;
        bool clear = true;
        oracle::walk({2 * x + 1, 2 * y + 1, 2 * z + 1}, {2 * p.x + 1, 2 * p.y + 1, 2 * p.z + 1}, 2,
                     [&](Voxel v) {
                       clear = v == u.v || v == p || !blocks(v);
                       return clear;
                     });
        count += clear;
      }
  return count;
}

struct Question {
  worlds::ViewCase about;
  OptimisticConfig config;

  explicit Question(std::uint64_t seed) : about(worlds::random_case(seed, 10, 30)) {
    Random random(seed + 1000);
    const planning::VoxelGrid& grid = about.map.grid();
    // Places that are unseen now may be candidates later.
    for (int i = 0; i < 10; ++i)
      about.candidates.push_back({worlds::uniform_int(random, 0, grid.nx - 1),
                                  worlds::uniform_int(random, 0, grid.ny - 1),
                                  worlds::uniform_int(random, 0, grid.nz - 1)});
    if (seed % 3 == 0)
      for (int x = 0; x < grid.nx; ++x)
        if (about.map.at({x, 0, 0}) == VoxelState::unseen) config.never_empty.push_back({x, 0, 0});
    if (seed % 4 == 0) config.counts = [](Voxel v) { return v.x % 3 != 0; };
    if (config.counts)
      std::erase_if(about.boundary, [&](const BoundaryVoxel& u) { return !config.counts(u.v); });
  }

  // Above every count, so that the largest is looked for.
  static constexpr std::uint32_t kNever = 1U << 30;

  StopCertificate certificate(std::uint32_t threshold = kNever) const {
    return planning::stop_certificate(about.map, about.boundary, about.candidates, about.limits,
                                      threshold, config);
  }
};

TEST(StopCertificate, EqualsTheDefinitionOnRandomMaps) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Question q(seed);
    const worlds::ViewCase& c = q.about;
    std::optional<BestView> pessimistic, optimistic;
    const auto take = [](std::optional<BestView>& best, std::size_t i, std::uint32_t count) {
      if (!best || count > best->gain_voxels) best = BestView{i, count};
    };
    for (std::size_t i = 0; i < c.candidates.size(); ++i) {
      const Voxel p = c.candidates[i];
      if (c.map.at(p) == VoxelState::seen_empty)
        take(pessimistic, i, oracle::tally(c.map, c.boundary, {p}, c.limits).front());
      if (c.map.at(p) != VoxelState::seen_occupied && !among(q.config.never_empty, p))
        take(optimistic, i, literal_optimum(c.map, p, c.limits, q.config));
    }
    const StopCertificate found = q.certificate();
    ASSERT_EQ(found.pessimistic, pessimistic) << "seed " << seed;
    ASSERT_EQ(found.optimistic, optimistic) << "seed " << seed;
  }
}

TEST(StopCertificate, NamesAWitnessExactlyWhereTheLargestCountReachesTheThreshold) {
  int proven = 0, witnessed = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Question q(seed);
    const std::uint32_t most = q.certificate().optimistic_voxels();
    for (const std::uint32_t threshold : {1U, most / 2, most, most + 1}) {
      const StopCertificate found = q.certificate(threshold);
      ASSERT_EQ(found.proven(), most < threshold) << "seed " << seed;
      if (found.proven()) {
        ++proven;
        ASSERT_EQ(found.optimistic_voxels(), most);
      } else if (found.optimistic) {
        ++witnessed;
        const BestView& witness = *found.optimistic;
        ASSERT_GE(witness.gain_voxels, threshold);
        ASSERT_EQ(witness.gain_voxels,
                  literal_optimum(q.about.map, q.about.candidates[witness.candidate],
                                  q.about.limits, q.config));
      }
    }
  }
  EXPECT_GT(proven, 100);
  EXPECT_GT(witnessed, 300);
}

// Where several cells are asked alone and the tally goes piece by piece.
TEST(StopCertificate, OfASiteIsThatOfTheWholeTallyForAnyThresholdAndThreads) {
  const worlds::Site site;
  const std::vector<Voxel> cells = worlds::cells(site.map, site.world, 2);
  const ViewLimits limits{1, 60, 70};
  const VoxelMap optimistic = planning::optimistic_map(site.map, {});
  const auto unseen = planning::exposable_unseen(site.map, optimistic);
  const auto counts = planning::tally(optimistic, unseen, cells, limits, 2);
  const BestView most = *planning::best(counts);
  ASSERT_GT(unseen.size(), 20'000U);
  for (const std::uint32_t threshold :
       {100U, most.gain_voxels * 9 / 10, most.gain_voxels, most.gain_voxels + 1}) {
    const auto ask = [&](int threads) {
      OptimisticConfig config;
      config.threads = threads;
      return planning::stop_certificate(site.map, planning::boundary_unseen(site.map), cells,
                                        limits, threshold, config);
    };
    const StopCertificate found = ask(1);
    EXPECT_EQ(found, ask(3)) << threshold;
    EXPECT_EQ(found.proven(), most.gain_voxels < threshold);
    ASSERT_TRUE(found.optimistic);
    EXPECT_TRUE(!found.proven() || found.optimistic == most);
    EXPECT_EQ(found.optimistic_voxels(), counts[found.optimistic->candidate]) << threshold;
  }
}

// Any future that scans may bring: unseen voxels turn out somehow or stay unseen, seen-empty ones
// may turn out to hold a point, seen-occupied ones stay.
VoxelMap future(const VoxelMap& now, const OptimisticConfig& config, std::uint64_t seed) {
  Random random(seed);
  VoxelMap later = now;
  const double to_empty = uniform(random, 0, 1), to_occupied = uniform(random, 0, 0.3);
  for (int z = 0; z < now.grid().nz; ++z)
    for (int y = 0; y < now.grid().ny; ++y)
      for (int x = 0; x < now.grid().nx; ++x) {
        const VoxelState state = now.at({x, y, z});
        const double dice = uniform(random, 0, 1);
        if (state == VoxelState::seen_empty && dice < 0.01)
          later.set({x, y, z}, VoxelState::seen_occupied);
        if (state != VoxelState::unseen) continue;
        if (dice < to_empty && !among(config.never_empty, {x, y, z}))
          later.set({x, y, z}, VoxelState::seen_empty);
        else if (dice > 1 - to_occupied)
          later.set({x, y, z}, VoxelState::seen_occupied);
      }
  return later;
}

TEST(StopCertificate, BoundsEveryCountOfEveryFuture) {
  std::size_t more_than_now = 0, tight = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Question q(seed);
    const std::uint32_t bound = q.certificate().optimistic_voxels();
    const std::uint32_t now = q.certificate().pessimistic_max();
    ASSERT_LE(now, bound);
    for (std::uint64_t k = 0; k < 12; ++k) {
      const VoxelMap later = future(q.about.map, q.config, 100 * seed + k);
      auto boundary = planning::boundary_unseen(later);
      if (q.config.counts)
        std::erase_if(boundary, [&](const BoundaryVoxel& u) { return !q.config.counts(u.v); });
      for (const Voxel p : q.about.candidates) {
        if (later.at(p) != VoxelState::seen_empty) continue;
        const std::uint32_t count = oracle::tally(later, boundary, {p}, q.about.limits).front();
        ASSERT_LE(count, bound) << "seed " << seed << ", future " << k;
        more_than_now += count > now;
        tight += count == bound && count > 0;
      }
    }
  }
  EXPECT_GT(more_than_now, 50U) << "futures that never show more would prove nothing";
  EXPECT_GT(tight, 20U) << "a bound that is never reached says little";
}

TEST(StopCertificate, IsProvenBehindAWallAndNotBehindAnUnseenVoxel) {
  VoxelMap map = worlds::noise(9, 1, 1, 0, 0, 1);
  map.set({4, 0, 0}, VoxelState::seen_occupied);
  for (const int x : {5, 6, 7, 8}) map.set({x, 0, 0}, VoxelState::unseen);
  const std::vector<Voxel> candidates{{0, 0, 0}};
  const ViewLimits limits{0, 100, 90};
  const auto ask = [&](std::uint32_t threshold) {
    return planning::stop_certificate(map, planning::boundary_unseen(map), candidates, limits,
                                      threshold);
  };
  EXPECT_EQ(ask(1).optimistic_voxels(), 0U);
  EXPECT_TRUE(ask(1).proven());
  map.set({4, 0, 0}, VoxelState::unseen);
  EXPECT_EQ(ask(2).pessimistic_max(), 1U);
  EXPECT_EQ(ask(2).optimistic, (BestView{0, 5}));
  EXPECT_FALSE(ask(2).proven());
  EXPECT_TRUE(ask(6).proven());
}

TEST(StopCertificate, CountsOnlyPlacesThatCanBecomeCandidates) {
  VoxelMap map = worlds::noise(5, 1, 1, 0, 0, 1);
  map.set({4, 0, 0}, VoxelState::unseen);
  map.set({2, 0, 0}, VoxelState::unseen);
  map.set({0, 0, 0}, VoxelState::seen_occupied);
  const auto boundary = planning::boundary_unseen(map);
  const StopCertificate found =
      planning::stop_certificate(map, boundary, {{0, 0, 0}, {2, 0, 0}}, {0, 100, 90}, 1);
  EXPECT_EQ(found.pessimistic, std::nullopt);
  EXPECT_EQ(found.optimistic, (BestView{1, 1}));
}

}  // namespace
