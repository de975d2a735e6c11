// The tally of Phase II: ours, a well-made walk of every pair that may count, OctoMap's rays; and
// the tally kept up to date from view to view.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <octomap/octomap.h>

#include <chrono>
#include <fstream>
#include <map>
#include <string>

#include "planning/never_visible.hpp"
#include "planning/next_best_view.hpp"
#include "planning/next_views.hpp"
#include "planning/running_tally.hpp"
#include "planning/stop_certificate.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace {

using planning::BoundaryVoxel;
using planning::ViewLimits;
using planning::Voxel;
using planning::VoxelMap;

constexpr ViewLimits kLimits{1, 100, 70};

// What a tally is asked for.
struct Question {
  VoxelMap map;
  std::vector<BoundaryVoxel> boundary;
  std::vector<Voxel> candidates;
};

// A made-up fort of 300 x 300 m, scanned with a coarse scanner, so that much is left.
struct ViewSite {
  worlds::World world = worlds::fort(300, 1);
  worlds::Random random{3};
  VoxelMap map;

  explicit ViewSite(double voxel_m)
      : map({{0, 0, -voxel_m / 2},
             voxel_m,
             static_cast<int>(300 / voxel_m),
             static_cast<int>(300 / voxel_m),
             static_cast<int>(30 / voxel_m)}) {}

  void scan(const Eigen::Isometry3d& pose) {
    planning::InsertConfig config;
    config.threads = 2;
    map.insert(world.scan(worlds::sphere(0.5, 0.25), pose, 100, random), pose, config);
  }
  void scan_stations(int count) {
    for (const Eigen::Isometry3d& pose : worlds::stations(world, 300, count, 2)) scan(pose);
  }
  Question question() const {
    return {map, planning::boundary_unseen(map),
            worlds::cells(map, world, map.grid().voxel_at({0, 0, 1.8}).z)};
  }
};

// After 7 scans.
const Question& question(std::int64_t voxel_cm) {
  static std::map<std::int64_t, Question> questions;
  if (!questions.contains(voxel_cm)) {
    ViewSite site(static_cast<double>(voxel_cm) / 100);
    site.scan_stations(7);
    questions.emplace(voxel_cm, site.question());
  }
  return questions.at(voxel_cm);
}

void finish(benchmark::State& state, const Question& q, std::uint64_t pairs) {
  state.counters["voxels"] = static_cast<double>(q.map.grid().size());
  state.counters["boundary"] = static_cast<double>(q.boundary.size());
  state.counters["candidates"] = static_cast<double>(q.candidates.size());
  state.counters["seen_pairs"] = static_cast<double>(pairs);
}

std::uint64_t sum(const std::vector<std::uint32_t>& tally) {
  std::uint64_t result = 0;
  for (const std::uint32_t count : tally) result += count;
  return result;
}

// A line of /proc/self/status, in MB.
double status_mb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(key + ":")) return std::stod(line.substr(key.size() + 1)) / 1024;
  return 0;
}

// Arguments: voxel size in cm, threads. peak_mb: resident memory at its highest, less before.
void Tally(benchmark::State& state) {
  const Question& q = question(state.range(0));
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;  // Resets the peak.
  const double before_mb = status_mb("VmRSS");
  std::uint64_t pairs = 0;
  for (auto _ : state)
    pairs = sum(planning::tally(q.map, q.boundary, q.candidates, kLimits,
                                static_cast<int>(state.range(1))));
  finish(state, q, pairs);
  state.counters["peak_mb"] = status_mb("VmHWM") - before_mb;
}
BENCHMARK(Tally)
    ->ArgsProduct({{100}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(Tally)
    ->ArgsProduct({{56}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Iterations(1);

// The reference: one byte per voxel, boundary voxel by boundary voxel, every candidate in range and
// at a fair angle, walked from face to face until something blocks; integers throughout.
class Walker {
 public:
  explicit Walker(const Question& q) : q_(q), rule_(kLimits, q.map.grid().voxel_m) {
    const planning::VoxelGrid& grid = q.map.grid();
    blocked_.reserve(grid.size());
    for (int z = 0; z < grid.nz; ++z)
      for (int y = 0; y < grid.ny; ++y)
        for (int x = 0; x < grid.nx; ++x)
          blocked_.push_back(q.map.at({x, y, z}) != planning::VoxelState::seen_empty);
    row_begin_.resize(static_cast<std::size_t>(grid.ny) + 1);
    for (const Voxel p : q.candidates) ++row_begin_[static_cast<std::size_t>(p.y) + 1];
    for (std::size_t y = 1; y < row_begin_.size(); ++y) row_begin_[y] += row_begin_[y - 1];
  }

  std::uint64_t count(const BoundaryVoxel& u, std::vector<std::uint32_t>& tally) const {
    const auto reach = static_cast<int>(std::sqrt(static_cast<double>(rule_.distance2_max())));
    std::uint64_t seen = 0;
    for (int y = std::max(u.v.y - reach, 0); y <= std::min(u.v.y + reach, q_.map.grid().ny - 1);
         ++y) {
      const auto row = q_.candidates.begin() + row_begin_[static_cast<std::size_t>(y)];
      const auto end = q_.candidates.begin() + row_begin_[static_cast<std::size_t>(y) + 1];
      const auto width = static_cast<int>(std::sqrt(reach * reach - (y - u.v.y) * (y - u.v.y))) + 1;
      auto p = std::lower_bound(row, end, u.v.x - width, [](Voxel v, int x) { return v.x < x; });
      for (; p != end && p->x <= u.v.x + width; ++p)
        if (rule_.admits(u, *p) && clear(u.v, *p)) {
          ++tally[static_cast<std::size_t>(p - q_.candidates.begin())];
          ++seen;
        }
    }
    return seen;
  }

 private:
  bool clear(Voxel u, Voxel p) const {
    const std::ptrdiff_t nx = q_.map.grid().nx, nxy = nx * q_.map.grid().ny;
    const std::int64_t dx = std::abs(p.x - u.x), dy = std::abs(p.y - u.y), dz = std::abs(p.z - u.z);
    const std::int64_t wx = std::max<std::int64_t>(dx, 1), wy = std::max<std::int64_t>(dy, 1),
                       wz = std::max<std::int64_t>(dz, 1);
    const std::ptrdiff_t step_x = p.x < u.x ? -1 : 1, step_y = p.y < u.y ? -nx : nx,
                         step_z = p.z < u.z ? -nxy : nxy;
    std::int64_t next_x = dx == 0 ? INT64_MAX : wy * wz, next_y = dy == 0 ? INT64_MAX : wx * wz,
                 next_z = dz == 0 ? INT64_MAX : wx * wy;
    const std::uint8_t* at = &blocked_[static_cast<std::size_t>(u.z * nxy + u.y * nx + u.x)];
    const std::uint8_t* const end = &blocked_[static_cast<std::size_t>(p.z * nxy + p.y * nx + p.x)];
    while (at != end) {
      const std::int64_t now = std::min({next_x, next_y, next_z});
      if (next_x == now) at += step_x, next_x += 2 * wy * wz;
      if (next_y == now) at += step_y, next_y += 2 * wx * wz;
      if (next_z == now) at += step_z, next_z += 2 * wx * wy;
      if (at != end && *at != 0) return false;
    }
    return true;
  }

  const Question& q_;
  planning::ViewRule rule_;
  std::vector<std::uint8_t> blocked_;
  std::vector<std::ptrdiff_t> row_begin_;
};

// Times work() over a sample of the boundary voxels, and tells what all would take.
template <class Work>
void sampled(benchmark::State& state, std::size_t every, const Work& work) {
  for (auto _ : state) {
    const auto began = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> took_s = std::chrono::steady_clock::now() - began;
    state.SetIterationTime(took_s.count() * static_cast<double>(every));
  }
  state.counters["sampled_1_in"] = static_cast<double>(every);
}

// Arguments: voxel size in cm, 1. At 56 cm every 50th boundary voxel.
void TallyByWalking(benchmark::State& state) {
  const Question& q = question(state.range(0));
  const std::size_t every = state.range(0) < 100 ? 50 : 1;
  const Walker walker(q);
  std::vector<std::uint32_t> tally(q.candidates.size());
  std::uint64_t pairs = 0;
  sampled(state, every, [&] {
    pairs = 0;
    for (std::size_t i = 0; i < q.boundary.size(); i += every)
      pairs += walker.count(q.boundary[i], tally);
  });
  finish(state, q, pairs);
}
BENCHMARK(TallyByWalking)
    ->ArgsProduct({{100, 56}, {1}})
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(1);

// The fort after 20 stations, and after each of 9 next best views.
const std::vector<Question>& mission() {
  static const std::vector<Question> questions = [] {
    ViewSite site(1);
    site.scan_stations(20);
    std::vector<Question> result{site.question()};
    while (result.size() < 10) {
      const Question& q = result.back();
      const auto best =
          planning::best(planning::tally(q.map, q.boundary, q.candidates, kLimits, 2));
      Eigen::Vector3d W_view_m = q.map.grid().center_m(q.candidates[best->candidate]);
      W_view_m.z() = 1.8;
      site.scan(worlds::upright(W_view_m, 0.3));
      result.push_back(site.question());
    }
    return result;
  }();
  return questions;
}

// All tallies after the first: kept up to date, and made anew.
void RunningTally(benchmark::State& state) {
  const std::vector<Question>& questions = mission();
  std::uint64_t pairs = 0;
  for (auto _ : state) {
    state.PauseTiming();
    planning::RunningTally running(kLimits, 1);
    const Question& first = questions.front();
    running.update(first.map, first.boundary, first.candidates);
    state.ResumeTiming();
    pairs = 0;
    for (std::size_t i = 1; i < questions.size(); ++i)
      pairs +=
          sum(running.update(questions[i].map, questions[i].boundary, questions[i].candidates));
    state.counters["swept"] = static_cast<double>(running.work().swept);
    state.counters["partly_swept"] = static_cast<double>(running.work().partly_swept);
    state.counters["kept"] = static_cast<double>(running.work().kept);
    state.counters["kept_mb"] = static_cast<double>(running.work().bytes) / 1e6;
  }
  finish(state, questions.back(), pairs);
}
void RunningTallyByTallyingAnew(benchmark::State& state) {
  const std::vector<Question>& questions = mission();
  std::uint64_t pairs = 0;
  for (auto _ : state) {
    pairs = 0;
    for (std::size_t i = 1; i < questions.size(); ++i)
      pairs += sum(planning::tally(questions[i].map, questions[i].boundary, questions[i].candidates,
                                   kLimits));
  }
  finish(state, questions.back(), pairs);
}
BENCHMARK(RunningTally)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(RunningTallyByTallyingAnew)->Unit(benchmark::kMillisecond)->UseRealTime();

void VisibleSetByWalking(benchmark::State& state) {
  const Question& q = question(100);
  const Voxel p = q.candidates[q.candidates.size() / 2];
  for (auto _ : state)
    benchmark::DoNotOptimize(planning::visible_from(q.map, q.boundary, p, kLimits));
}
BENCHMARK(VisibleSetByWalking)->Unit(benchmark::kMillisecond)->UseRealTime();

// Five views at once, given the tally (argument: threads).
void NextViews(benchmark::State& state) {
  const Question& q = question(100);
  const int threads = static_cast<int>(state.range(0));
  const auto counts = planning::tally(q.map, q.boundary, q.candidates, kLimits, threads);
  std::vector<planning::PlannedView> views;
  for (auto _ : state)
    views = planning::next_views(q.map, q.boundary, q.candidates, counts, kLimits,
                                 {.views_max = 5, .adds_min_voxels = 1, .threads = threads});
  std::uint64_t adds = 0;
  for (const planning::PlannedView& view : views) adds += view.adds_voxels;
  finish(state, q, adds);
}
BENCHMARK(NextViews)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// Both tallies of the stop certificate.
void StopCertificate(benchmark::State& state) {
  const Question& q = question(100);
  planning::OptimisticConfig config;
  config.threads = static_cast<int>(state.range(0));
  planning::StopCertificate certificate;
  for (auto _ : state)
    certificate = planning::stop_certificate(q.map, q.boundary, q.candidates, kLimits, 100, config);
  finish(state, q, certificate.optimistic_voxels());
}
BENCHMARK(StopCertificate)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void NeverVisible(benchmark::State& state) {
  const Question& q = question(100);
  std::size_t never = 0;
  for (auto _ : state)
    never = planning::never_visible(q.map, q.boundary, q.candidates, kLimits,
                                    static_cast<int>(state.range(0)))
                .size();
  finish(state, q, never);
}
BENCHMARK(NeverVisible)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// The same, looked up.
void VisibleSet(benchmark::State& state) {
  const Question& q = question(100);
  planning::RunningTally running(kLimits, 2);
  running.update(q.map, q.boundary, q.candidates);
  const Voxel p = q.candidates[q.candidates.size() / 2];
  for (auto _ : state) benchmark::DoNotOptimize(running.visible(p));
}
BENCHMARK(VisibleSet)->Unit(benchmark::kMillisecond)->UseRealTime();

// OctoMap's computeRayKeys and search, for every 400th boundary voxel.
void TallyByOctomapKeyRays(benchmark::State& state) {
  const Question& q = question(100);
  const planning::VoxelGrid& grid = q.map.grid();
  octomap::OcTree tree(1.0);
  const auto point = [](Voxel v) {
    return octomap::point3d(static_cast<float>(v.x) + 0.5F, static_cast<float>(v.y) + 0.5F,
                            static_cast<float>(v.z) + 0.5F);
  };
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (q.map.at({x, y, z}) != planning::VoxelState::unseen)
          tree.updateNode(point({x, y, z}),
                          q.map.at({x, y, z}) == planning::VoxelState::seen_occupied, true);
  const planning::ViewRule rule(kLimits, 1);
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
  sampled(state, 400, [&] {
    pairs = 0;
    for (std::size_t i = 0; i < q.boundary.size(); i += 400)
      for (const Voxel p : q.candidates)
        pairs += rule.admits(q.boundary[i], p) && clear(q.boundary[i].v, p);
  });
  finish(state, q, pairs);
}
BENCHMARK(TallyByOctomapKeyRays)
    ->Args({100, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(1);

}  // namespace
