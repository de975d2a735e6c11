// The tally of Phase II: ours, the pruned walk of every pair, OctoMap's rays.
#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include "planning/never_visible.hpp"
#include "planning/next_best_view.hpp"
#include "planning/next_views.hpp"
#include "planning/stop_certificate.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/planning/voxel_worlds.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelMap;

// A made-up fort of 300 x 300 m after a few scans with a coarse scanner, so that much is left.
struct Site {
  worlds::World world = worlds::fort(300, 1);
  VoxelMap map;
  std::vector<BoundaryVoxel> boundary;
  std::vector<Voxel> candidates;
  ViewLimits limits{1, 100, 70};

  explicit Site(double voxel_m)
      : map({{0, 0, -voxel_m / 2},
             voxel_m,
             static_cast<int>(300 / voxel_m),
             static_cast<int>(300 / voxel_m),
             static_cast<int>(30 / voxel_m)}) {
    worlds::Random random(3);
    planning::InsertConfig config;
    config.threads = 2;
    for (const Eigen::Isometry3d& pose : worlds::stations(world, 300, 14, 2))
      map.insert(world.scan(worlds::sphere(0.5, 0.25), pose, 100, random), pose, config);
    boundary = planning::boundary_unseen(map);
    candidates = worlds::cells(map, world, map.grid().voxel_at({0, 0, 1.8}).z);
  }
};

const Site& site(std::int64_t voxel_cm) {
  static const Site one_m(1);
  if (voxel_cm == 100) return one_m;
  static const Site half_m(0.5);
  return half_m;
}

void finish(benchmark::State& state, const Site& s, std::uint64_t pairs) {
  state.counters["voxels"] = static_cast<double>(s.map.grid().size());
  state.counters["boundary"] = static_cast<double>(s.boundary.size());
  state.counters["candidates"] = static_cast<double>(s.candidates.size());
  state.counters["seen_pairs"] = static_cast<double>(pairs);
}

std::uint64_t sum(const std::vector<std::uint32_t>& tally) {
  std::uint64_t result = 0;
  for (const std::uint32_t count : tally) result += count;
  return result;
}

// Arguments: threads, voxel size in cm.
void Tally(benchmark::State& state) {
  const Site& s = site(state.range(1));
  std::uint64_t pairs = 0;
  for (auto _ : state)
    pairs = sum(planning::tally(s.map, s.boundary, s.candidates, s.limits,
                                static_cast<int>(state.range(0))));
  finish(state, s, pairs);
}
BENCHMARK(Tally)->ArgsProduct({{1, 2}, {100, 50}})->Unit(benchmark::kMillisecond)->UseRealTime();

// Every pair in range and at a fair angle, walked until something blocks.
void TallyByWalking(benchmark::State& state) {
  const Site& s = site(100);
  std::uint64_t pairs = 0;
  for (auto _ : state) {
    pairs = 0;
    for (const Voxel p : s.candidates)
      pairs += planning::visible_from(s.map, s.boundary, p, s.limits).size();
  }
  finish(state, s, pairs);
}
BENCHMARK(TallyByWalking)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

void VisibleFrom(benchmark::State& state) {
  const Site& s = site(100);
  const Voxel p = s.candidates[s.candidates.size() / 2];
  for (auto _ : state)
    benchmark::DoNotOptimize(planning::visible_from(s.map, s.boundary, p, s.limits));
}
BENCHMARK(VisibleFrom)->Unit(benchmark::kMillisecond)->UseRealTime();

// Five views at once, given the tally (argument: threads).
void NextViews(benchmark::State& state) {
  const Site& s = site(100);
  const int threads = static_cast<int>(state.range(0));
  const auto counts = planning::tally(s.map, s.boundary, s.candidates, s.limits, threads);
  std::vector<planning::PlannedView> views;
  for (auto _ : state)
    views = planning::next_views(s.map, s.boundary, s.candidates, counts, s.limits,
                                 {.views_max = 5, .adds_min_voxels = 1, .threads = threads});
  std::uint64_t adds = 0;
  for (const planning::PlannedView& view : views) adds += view.adds_voxels;
  finish(state, s, adds);
}
BENCHMARK(NextViews)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// Both tallies of the stop certificate.
void StopCertificate(benchmark::State& state) {
  const Site& s = site(100);
  planning::OptimisticConfig config;
  config.threads = static_cast<int>(state.range(0));
  planning::StopCertificate certificate;
  for (auto _ : state)
    certificate =
        planning::stop_certificate(s.map, s.boundary, s.candidates, s.limits, 100, config);
  finish(state, s, certificate.optimistic_max());
}
BENCHMARK(StopCertificate)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void NeverVisible(benchmark::State& state) {
  const Site& s = site(100);
  std::size_t never = 0;
  for (auto _ : state)
    never = planning::never_visible(s.map, s.boundary, s.candidates, s.limits,
                                    static_cast<int>(state.range(0)))
                .size();
  finish(state, s, never);
}
BENCHMARK(NeverVisible)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// OctoMap's computeRayKeys and search for every 400th boundary voxel; multiply by 400.
void TallyPartByOctomapKeyRays(benchmark::State& state) {
  const Site& s = site(100);
  const planning::VoxelGrid& grid = s.map.grid();
  octomap::OcTree tree(1.0);
  const auto point = [](Voxel v) {
    return octomap::point3d(static_cast<float>(v.x) + 0.5F, static_cast<float>(v.y) + 0.5F,
                            static_cast<float>(v.z) + 0.5F);
  };
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (s.map.at({x, y, z}) != planning::VoxelState::unseen)
          tree.updateNode(point({x, y, z}),
                          s.map.at({x, y, z}) == planning::VoxelState::seen_occupied, true);
  const planning::ViewRule rule(s.limits, 1);
  std::uint64_t pairs = 0;
  octomap::KeyRay ray;
  const auto clear = [&](Voxel u, Voxel p) {
    tree.computeRayKeys(point(u), point(p), ray);
    const octomap::OcTreeKey own = tree.coordToKey(point(u));
    for (const octomap::OcTreeKey& key : ray) {
      if (key == own) continue;
      const octomap::OcTreeNode* node = tree.search(key);
      if (node == nullptr || tree.isNodeOccupied(node)) return false;
    }
    return true;
  };
  for (auto _ : state) {
    pairs = 0;
    for (std::size_t i = 0; i < s.boundary.size(); i += 400)
      for (const Voxel p : s.candidates)
        pairs += rule.admits(s.boundary[i], p) && clear(s.boundary[i].v, p);
  }
  finish(state, s, pairs);
}
BENCHMARK(TallyPartByOctomapKeyRays)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

}  // namespace
