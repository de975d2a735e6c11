// The parts of a simulated run that take time: a scan, a sleep, the judgement of the surface.
#include <benchmark/benchmark.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "sim/scan.hpp"
#include "sim/sim_clock.hpp"
#include "sim/surface_truth.hpp"
#include "tests/sim/room.hpp"

namespace {

// 300 x 300 m with 36 buildings; the ground in 160 x 160 squares, so 51 k triangles.
sim::Mesh town() {
  sim::Mesh mesh;
  constexpr int kSquares = 160;
  constexpr double kSide_m = 300.0 / kSquares;
  for (int i = 0; i < kSquares; ++i)
    for (int j = 0; j < kSquares; ++j) {
      const double x = -150 + i * kSide_m, y = -150 + j * kSide_m;
      mesh.add_quad({x, y, 0}, {x + kSide_m, y, 0}, {x + kSide_m, y + kSide_m, 0},
                    {x, y + kSide_m, 0});
    }
  for (int i = 0; i < 36; ++i) {
    const double x = -130 + i % 6 * 45, y = -130 + i / 6 * 45;
    sim_test::add_box(mesh, {x, y, 0}, {x + 28, y + 14, 6.0 + i % 5 * 4});
  }
  return mesh;
}

void BM_Scan(benchmark::State& state) {
  const sim::Scene scene(town());
  const sim::ScannerModel model;
  const auto pattern = sim::make_pattern(model);
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  T_W_S.translation() << 9, -92, 1.8;
  std::uint64_t number = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(sim::cast_scan(scene, T_W_S, pattern, model, 1, ++number,
                                            static_cast<int>(state.range(0))));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(pattern.beams()));
}
BENCHMARK(BM_Scan)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_Sleep(benchmark::State& state) {
  boost::asio::io_context io;
  sim::SimClock clock(io);
  std::int64_t slept = 0;
  for (int i = 0; i < 4; ++i)
    boost::asio::co_spawn(
        io,
        [&]() -> hal::Task<void> {
          for (;; ++slept) co_await clock.sleep_for(std::chrono::milliseconds(20));
        },
        [](std::exception_ptr) {});
  for (auto _ : state) clock.run_until(clock.now() + std::chrono::milliseconds(20));
  state.SetItemsProcessed(slept);
}
BENCHMARK(BM_Sleep);

void BM_JudgeSurface(benchmark::State& state) {
  const sim::Mesh mesh = town();
  const sim::Scene scene(mesh);
  std::vector<Eigen::Vector3d> positions;
  for (double x = -149; x < 149; x += 1.3)
    for (double y = -149; y < 149; y += 1.3)
      if (scene.clearance_m({x, y}, 0.15, 1.5, 0.5) >= 0.5 &&
          scene.heights_below({x, y, 50}, 60).size() == 1)
        positions.push_back({x, y, 1.8});
  const sim::TruthGrid grid{{-150.5, -150.5, -0.4}, 1, 301, 301, 30};
  for (auto _ : state)
    benchmark::DoNotOptimize(sim::judge_surface(
        mesh, scene, grid, {}, positions, 0, [](int x, int, int) { return x % 20 != 0; }, 2));
}
BENCHMARK(BM_JudgeSurface)->UseRealTime()->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
