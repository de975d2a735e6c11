// Putting scans into the voxel map: ours, the plain walk of every beam, OctoMap.
//
// Every time is the sum over the scans of the best of several passes, so that a shared machine
// spoils little of it. The x_ counters are ratios within this run: x_walk and x_octomap of CPU
// time per beam, x_one_thread of wall time; they appear when the reference ran before (it does
// unless filtered out). busy_cores says the same as x_one_thread from CPU times alone, for a
// machine that never has two cores free.
#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include <chrono>
#include <ctime>
#include <functional>
#include <limits>
#include <map>

#include "planning/voxel_foliage.hpp"
#include "planning/voxel_map.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/voxel_worlds.hpp"

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
};

const Mission& scanned_fort() {
  static const Mission instance;
  return instance;
}

// Arguments: voxel size in cm, threads.
VoxelGrid grid(const benchmark::State& state) {
  const double voxel_m = static_cast<double>(state.range(0)) / 100;
  const int side = static_cast<int>(std::lround(300 / voxel_m));
  return {{0, 0, -voxel_m / 2}, voxel_m, side, side, side / 10};
}

InsertConfig with_threads(const benchmark::State& state) {
  InsertConfig config = scanned_fort().config;
  config.threads = static_cast<int>(state.range(1));
  return config;
}

struct Seconds {
  double wall = std::numeric_limits<double>::infinity(), cpu = wall;
};

double now_s(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// The best passes so far over each scan.
class Stopwatch {
 public:
  void time(std::size_t scan, const std::function<void()>& work) {
    if (scan >= best_.size()) best_.resize(scan + 1);
    const double cpu_s = now_s(CLOCK_PROCESS_CPUTIME_ID);
    const double own_s = now_s(CLOCK_THREAD_CPUTIME_ID);
    const auto began = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> wall_s = std::chrono::steady_clock::now() - began;
    best_[scan].wall = std::min(best_[scan].wall, wall_s.count());
    const double all = now_s(CLOCK_PROCESS_CPUTIME_ID) - cpu_s;
    const double own = now_s(CLOCK_THREAD_CPUTIME_ID) - own_s;
    best_[scan].cpu = std::min(best_[scan].cpu, all);
    all_s_ += all;
    busier_s_ += std::max(own, all - own);
  }
  // With two threads: all CPU time by that of the busier thread, so what the second thread gains
  // at least when both have a core for themselves.
  double busy_cores() const { return all_s_ / busier_s_; }
  Seconds per_beam(std::size_t beams) const {
    Seconds sum{0, 0};
    for (const Seconds& s : best_) sum = {sum.wall + s.wall, sum.cpu + s.cpu};
    return {sum.wall / static_cast<double>(beams), sum.cpu / static_cast<double>(beams)};
  }

 private:
  std::vector<Seconds> best_;
  double all_s_ = 0, busier_s_ = 0;
};

// Per beam, by voxel size in cm.
std::map<std::int64_t, Seconds> walked, octomapped, one_thread;
std::map<std::int64_t, VoxelMap> walked_map;

void tell(benchmark::State& state, const Seconds& per_beam) {
  const std::int64_t cm = state.range(0);
  state.counters["Mbeams/s"] = 1e-6 / per_beam.wall;
  state.counters["cpu_Mbeams/s"] = 1e-6 / per_beam.cpu;
  if (walked.contains(cm)) state.counters["x_walk"] = walked[cm].cpu / per_beam.cpu;
  if (octomapped.contains(cm)) state.counters["x_octomap"] = octomapped[cm].cpu / per_beam.cpu;
}

std::size_t differences(const VoxelMap& a, const VoxelMap& b) {
  std::size_t differ = 0;
  for (int z = 0; z < a.grid().nz; ++z)
    for (int y = 0; y < a.grid().ny; ++y)
      for (int x = 0; x < a.grid().nx; ++x) differ += a.at({x, y, z}) != b.at({x, y, z});
  return differ;
}

// Times insert(map, scan index) over all scans; gives the last map.
template <class Insert>
VoxelMap pass(benchmark::State& state, int nz_kept, Stopwatch& watch, const Insert& insert) {
  VoxelMap map(grid(state));
  for (auto _ : state) {
    map = VoxelMap(grid(state), nz_kept);
    for (std::size_t i = 0; i < scanned_fort().scans.size(); ++i)
      watch.time(i, [&] { insert(map, i); });
  }
  return map;
}

std::size_t all_beams() {
  return scanned_fort().scans.size() * scanned_fort().scans.front().pattern.beams();
}

// A good plain walk: integers, dense bytes, stops at the box.
void WalkEveryBeam(benchmark::State& state) {
  Stopwatch watch;
  VoxelMap map = pass(state, 0, watch, [](VoxelMap& to, std::size_t i) {
    oracle::insert_densely(to, scanned_fort().scans[i], scanned_fort().poses[i],
                           scanned_fort().config);
  });
  walked[state.range(0)] = watch.per_beam(all_beams());
  walked_map.insert_or_assign(state.range(0), std::move(map));
  tell(state, walked[state.range(0)]);
}
BENCHMARK(WalkEveryBeam)
    ->ArgNames({"voxel_cm"})
    ->Arg(100)
    ->Arg(50)
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// The end points of every other column of the first scan, in voxels: 1.35 M beams.
octomap::Pointcloud end_points(const planning::BeamFan& fan, const planning::BeamReach& reach) {
  const hal::ScanPattern& pattern = scanned_fort().scans.front().pattern;
  octomap::Pointcloud cloud;
  for (std::uint32_t c = 0; c < pattern.columns; c += 2)
    for (std::uint32_t r = 0; r < pattern.rows; ++r) {
      const float reach_m = reach.reach_m[std::size_t{c} * pattern.rows + r];
      if (reach_m <= 0) continue;
      const planning::LatticePoint end = fan.end(c, r, reach_m);
      cloud.push_back(static_cast<float>(static_cast<double>(end.x) / 2048),
                      static_cast<float>(static_cast<double>(end.y) / 2048),
                      static_cast<float>(static_cast<double>(end.z) / 2048));
    }
  return cloud;
}

// The same beams into OctoMap, as its manual does it.
void InsertIntoOctomap(benchmark::State& state) {
  const Mission& m = scanned_fort();
  const planning::BeamFan fan(grid(state), m.scans[0], m.poses[0]);
  const octomap::Pointcloud cloud =
      end_points(fan, planning::beam_reach(m.scans[0], grid(state), m.poses[0], fan, m.config));
  const planning::LatticePoint start = fan.start(0, 0);
  const octomap::point3d origin(static_cast<float>(static_cast<double>(start.x) / 2048),
                                static_cast<float>(static_cast<double>(start.y) / 2048),
                                static_cast<float>(static_cast<double>(start.z) / 2048));
  Stopwatch watch;
  for (auto _ : state)
    watch.time(0, [&] {
      octomap::OcTree tree(1.0);
      tree.insertPointCloud(cloud, origin);
      benchmark::DoNotOptimize(tree);
    });
  octomapped[state.range(0)] = watch.per_beam(cloud.size());
  state.counters["beams"] = static_cast<double>(cloud.size());
  tell(state, octomapped[state.range(0)]);
}
BENCHMARK(InsertIntoOctomap)
    ->ArgNames({"voxel_cm"})
    ->Arg(100)
    ->Arg(50)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void InsertScans(benchmark::State& state) {
  Stopwatch watch;
  const InsertConfig config = with_threads(state);
  const VoxelMap map = pass(state, 0, watch, [&](VoxelMap& to, std::size_t i) {
    to.insert(scanned_fort().scans[i], scanned_fort().poses[i], config);
  });
  const std::int64_t cm = state.range(0);
  const Seconds per_beam = watch.per_beam(all_beams());
  if (config.threads == 1) one_thread[cm] = per_beam;
  tell(state, per_beam);
  if (config.threads > 1 && one_thread.contains(cm))
    state.counters["x_one_thread"] = one_thread[cm].wall / per_beam.wall;
  if (config.threads == 2) state.counters["busy_cores"] = watch.busy_cores();
  if (walked_map.contains(cm))
    state.counters["differ"] = static_cast<double>(differences(map, walked_map.at(cm)));
  state.counters["bytes/voxel"] =
      static_cast<double>(map.storage_bytes()) / static_cast<double>(map.grid().size());
}
BENCHMARK(InsertScans)
    ->ArgNames({"voxel_cm", "threads"})
    ->ArgsProduct({{100, 50}, {1, 2}})
    ->Iterations(25)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// With layers up to 100 m kept above the box of 30 m, so that it can grow.
void InsertScansKeepingLayersAbove(benchmark::State& state) {
  Stopwatch watch;
  const InsertConfig config = with_threads(state);
  const int nz_kept = static_cast<int>(103 / grid(state).voxel_m);
  const VoxelMap map = pass(state, nz_kept, watch, [&](VoxelMap& to, std::size_t i) {
    to.insert(scanned_fort().scans[i], scanned_fort().poses[i], config);
  });
  tell(state, watch.per_beam(all_beams()));
  state.counters["bytes/voxel"] =
      static_cast<double>(map.storage_bytes()) / static_cast<double>(map.grid().size());
}
BENCHMARK(InsertScansKeepingLayersAbove)
    ->ArgNames({"voxel_cm", "threads"})
    ->Args({100, 1})
    ->Iterations(5)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// What [phase2] foliage adds to an insertion: every beam is walked and counted.
void CountBeamsForFoliage(benchmark::State& state) {
  Stopwatch watch;
  const InsertConfig config = with_threads(state);
  const VoxelMap map(grid(state));
  planning::BeamCounts counts(map);
  for (auto _ : state)
    for (std::size_t i = 0; i < scanned_fort().scans.size(); ++i)
      watch.time(i, [&] { counts.add(scanned_fort().scans[i], scanned_fort().poses[i], config); });
  tell(state, watch.per_beam(all_beams()));
  state.counters["bytes/voxel"] =
      static_cast<double>(counts.storage_bytes()) / static_cast<double>(map.grid().size());
}
BENCHMARK(CountBeamsForFoliage)
    ->ArgNames({"voxel_cm", "threads"})
    ->ArgsProduct({{100, 50}, {1, 2}})
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
