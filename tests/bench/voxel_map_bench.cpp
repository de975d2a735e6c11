// Putting scans into the voxel map: ours, the plain walk of every beam, OctoMap.
#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include "planning/voxel_map.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/planning/voxel_worlds.hpp"

namespace {

using planning::InsertConfig;
using planning::VoxelGrid;
using planning::VoxelMap;

// Scans of a made-up fort of 300 x 300 m, 2.7 M beams each, beams into the sky included.
struct Mission {
  worlds::World world = worlds::fort(300, 1);
  std::vector<Eigen::Isometry3d> poses = worlds::stations(world, 300, 6, 2);
  std::vector<hal::ScanCloud> scans;
  InsertConfig config;

  Mission() {
    worlds::Random random(3);
    for (const Eigen::Isometry3d& pose : poses)
      scans.push_back(world.scan(worlds::sphere(0.2, 0.1), pose, 100, random, 0.02, 0.5));
    config.ground_z_m = 0;
  }
  std::size_t beams() const { return scans.size() * scans.front().pattern.beams(); }
};

const Mission& mission() {
  static const Mission instance;
  return instance;
}

VoxelGrid grid(double voxel_m) {
  const int side = static_cast<int>(std::lround(300 / voxel_m));
  return {{0, 0, -voxel_m / 2}, voxel_m, side, side, side / 10};
}

void finish(benchmark::State& state, std::size_t beams, const planning::VoxelCounts& counts) {
  state.counters["beams/s"] =
      benchmark::Counter(static_cast<double>(beams), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["empty"] = static_cast<double>(counts.seen_empty);
  state.counters["occupied"] = static_cast<double>(counts.seen_occupied);
}

// Arguments: threads, voxel size in cm.
void InsertScans(benchmark::State& state) {
  InsertConfig config = mission().config;
  config.threads = static_cast<int>(state.range(0));
  planning::VoxelCounts counts;
  for (auto _ : state) {
    VoxelMap map(grid(static_cast<double>(state.range(1)) / 100));
    for (std::size_t i = 0; i < mission().scans.size(); ++i)
      map.insert(mission().scans[i], mission().poses[i], config);
    counts = map.counts();
  }
  finish(state, mission().beams(), counts);
}
BENCHMARK(InsertScans)
    ->ArgsProduct({{1, 2}, {100, 50, 25}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// The first scan finds everything unseen.
void InsertFirstScan(benchmark::State& state) {
  for (auto _ : state) {
    VoxelMap map(grid(1));
    map.insert(mission().scans[0], mission().poses[0], mission().config);
    benchmark::DoNotOptimize(map);
  }
  finish(state, mission().scans[0].pattern.beams(), {});
}
BENCHMARK(InsertFirstScan)->Unit(benchmark::kMillisecond)->UseRealTime();

// A good plain walk: integers, dense bytes, stops at the box.
void InsertScansByWalking(benchmark::State& state) {
  planning::VoxelCounts counts;
  for (auto _ : state) {
    VoxelMap map(grid(static_cast<double>(state.range(0)) / 100));
    for (std::size_t i = 0; i < mission().scans.size(); ++i)
      oracle::insert_densely(map, mission().scans[i], mission().poses[i], mission().config);
    counts = map.counts();
  }
  finish(state, mission().beams(), counts);
}
BENCHMARK(InsertScansByWalking)->Arg(100)->Arg(50)->Unit(benchmark::kMillisecond)->UseRealTime();

// The same end points into OctoMap; the part of one scan is enough to know its speed.
void InsertIntoOctomap(benchmark::State& state) {
  const Mission& m = mission();
  const planning::BeamFan fan(grid(1), m.scans[0].pattern, m.poses[0]);
  const planning::BeamReach reach =
      planning::beam_reach(m.scans[0], grid(1), m.poses[0], fan, m.config);
  octomap::Pointcloud cloud;
  const std::uint32_t rows = m.scans[0].pattern.rows;
  for (std::uint32_t c = 0; c < m.scans[0].pattern.columns; c += 4)
    for (std::uint32_t r = 0; r < rows; ++r) {
      const float reach_m = reach.reach_m[std::size_t{c} * rows + r];
      if (reach_m <= 0) continue;
      const planning::LatticePoint end = fan.end(c, r, reach_m);
      cloud.push_back(static_cast<float>(static_cast<double>(end.x) / 2048),
                      static_cast<float>(static_cast<double>(end.y) / 2048),
                      static_cast<float>(static_cast<double>(end.z) / 2048));
    }
  const planning::LatticePoint start = fan.scanner();
  const octomap::point3d origin(static_cast<float>(static_cast<double>(start.x) / 2048),
                                static_cast<float>(static_cast<double>(start.y) / 2048),
                                static_cast<float>(static_cast<double>(start.z) / 2048));
  for (auto _ : state) {
    octomap::OcTree tree(1.0);
    tree.insertPointCloud(cloud, origin);
    benchmark::DoNotOptimize(tree);
  }
  finish(state, cloud.size(), {});
}
BENCHMARK(InsertIntoOctomap)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
