// The parts of a simulated run that take time: a scan, a sleep, the judgement of the surface.
#include <benchmark/benchmark.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "sim/scan.hpp"
#include "sim/sim_clock.hpp"
#include "sim/surface_truth.hpp"
#include "tests/sim/town.hpp"

namespace {

void BM_Scan(benchmark::State& state) {
  const sim::Scene scene(sim_test::town());
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
  const sim::Mesh mesh = sim_test::town();
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
