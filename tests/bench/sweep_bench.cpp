// A scan of two million beams through the wire: a simulated LMS511 on a simulated pan unit, their
// drivers, and the assembly; and what its parts cost.
#include <benchmark/benchmark.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <numbers>
#include <optional>

#include "drivers/flir_ptu.hpp"
#include "drivers/sick_lms.hpp"
#include "drivers/sweep_scanner.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "sim/sick_lms_unit.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/town.hpp"

namespace {

constexpr double kDeg = std::numbers::pi / 180;

drivers::SickLmsConfig lms511() {
  drivers::SickLmsConfig config;
  config.settings.lms5xx = true;
  config.settings.frequency_centihz = 2500;
  config.settings.resolution_1e4deg = 1667;
  config.settings.start_1e4deg = -50000;
  config.settings.stop_1e4deg = 1850000;
  return config;
}

drivers::SweepScannerConfig sweep_config() {
  drivers::SweepScannerConfig config;
  config.mount.tilt_rad = 90 * kDeg;
  config.mount.P_offset_m = {0.08, 0.01, 0.12};
  config.field.elevation_min_rad = -4.9 * kDeg;
  config.field.azimuth_step_rad = 0.1 * kDeg;
  return config;
}

sim::SickLmsUnitConfig unit_config(int threads) {
  sim::SickLmsUnitConfig config;
  config.lms5xx = true;
  config.T_P_L = sweep_config().mount.T_P_L();
  config.ranges.range_min_m = 0.5;
  config.ranges.range_max_m = 65;
  config.threads = threads;
  return config;
}

// Units, links, drivers and a scanner in a town.
struct Robot {
  explicit Robot(const sim::Scene& scene, int threads)
      : world(scene, {}),
        lms_unit(unit_config(threads), world, clock, lms_wire.b(), faults, ptu_unit) {
    (void)world.put_robot({{9, -92}, 0.3}, 0);
    spawn(lms_unit.run());
    spawn(ptu_unit.run());
    spawn(lms.run());
    spawn(ptu.run());
  }
  ~Robot() {
    stop.emit(boost::asio::cancellation_type::terminal);
    io.restart();
    io.poll();
  }
  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr) {});
  }
  std::optional<hal::ScanCloud> scan() {
    std::optional<hal::ScanCloud> cloud;
    bool done = false;
    boost::asio::co_spawn(io, scanner.scan(),
                          [&](std::exception_ptr error, hal::Result<hal::ScanCloud> result) {
                            done = true;
                            if (!error && result) cloud = std::move(*result);
                          });
    clock.run([&] { return done; });
    return cloud;
  }

  boost::asio::io_context io;
  sim::SimClock clock{io};
  boost::asio::cancellation_signal stop;
  sim::World world;
  sim::StreamWire lms_wire{clock}, ptu_wire{clock};
  sim::UnitFaults faults{clock};
  sim::FlirPtuUnit ptu_unit{{}, clock, ptu_wire.b(), faults};
  sim::SickLmsUnit lms_unit;
  drivers::SickLms lms{lms511(), clock, lms_wire.a()};
  drivers::FlirPtu ptu{{}, clock, ptu_wire.a()};
  drivers::SweepScanner scanner{sweep_config(), clock, lms, ptu};
};

void BM_SweepScan(benchmark::State& state) {
  const sim::Scene scene(sim_test::town());
  Robot robot(scene, static_cast<int>(state.range(0)));
  std::int64_t beams = 0;
  for (auto _ : state) {
    const auto cloud = robot.scan();
    if (!cloud) {
      state.SkipWithError(robot.scanner.problem().c_str());
      break;
    }
    beams += static_cast<std::int64_t>(cloud->pattern.beams());
    benchmark::DoNotOptimize(cloud->ranges_m.data());
  }
  state.SetItemsProcessed(beams);
}
BENCHMARK(BM_SweepScan)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

// The rays alone: 64 turns at once, as the unit casts ahead.
void BM_CastProfiles(benchmark::State& state) {
  const sim::Scene scene(sim_test::town());
  const auto config = unit_config(1);
  const sim::MirrorArc arc{1140, -95 * kDeg, 0.1667 * kDeg};
  sim::ProfileCaster caster(scene, config.ranges, arc, config.T_P_L, 1);
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  T_W_S.translation() << 9, -92, 1.8;
  std::vector<float> ranges_m(64 * arc.beams);
  std::uint64_t number = 0;
  for (auto _ : state) {
    std::vector<sim::MirrorTurn> turns;
    for (int i = 0; i < 64; ++i, ++number) {
      const double pan = 0.1 * kDeg * static_cast<double>(number % 1800);
      turns.push_back({number, pan, pan + 0.05 * kDeg});
    }
    caster.cast(T_W_S, turns, static_cast<int>(state.range(0)), ranges_m);
    benchmark::DoNotOptimize(ranges_m.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(ranges_m.size()));
}
BENCHMARK(BM_CastProfiles)->Arg(1)->Arg(2)->UseRealTime();

// Profiles that are at hand, into a cloud.
void BM_AssembleSweep(benchmark::State& state) {
  const auto T_P_L = sweep_config().mount.T_P_L();
  const drivers::MirrorField mirror{-95 * kDeg, 0.1667 * kDeg, 1140, 0.04 / 2159.6, 0.04};
  const auto plan = drivers::plan_sweep(sweep_config().field, mirror, T_P_L);
  std::vector<hal::Profile> profiles;
  for (int i = 0; i < 1820; ++i) {
    hal::Profile profile;
    profile.stamp = hal::Time(hal::from_seconds(0.04 * i));
    profile.beam_period_s = mirror.beam_period_s;
    profile.angle_first_rad = mirror.angle_first_rad;
    profile.angle_step_rad = mirror.angle_step_rad;
    profile.ranges_m.assign(mirror.beams, 5.0F);
    profiles.push_back(std::move(profile));
  }
  drivers::PanFit pan;
  pan.angle_rad = plan.pan_first_rad - 10 * plan.pan_step_rad;
  pan.rate_radps = plan.rate_radps;
  std::int64_t beams = 0;
  for (auto _ : state) {
    const auto sweep = drivers::assemble_sweep(plan, T_P_L, profiles, pan, 0);
    beams += static_cast<std::int64_t>(sweep.cloud.pattern.beams());
    benchmark::DoNotOptimize(sweep.cloud.beams.data());
  }
  state.SetItemsProcessed(beams);
}
BENCHMARK(BM_AssembleSweep)->Unit(benchmark::kMillisecond);

// One telegram: the unit's encoding, and the driver's decoding.
drivers::LmsScan some_scan() {
  drivers::LmsScan scan;
  scan.scan_frequency_centihz = 2500;
  scan.channels16.resize(1);
  scan.channels16[0].name = {'D', 'I', 'S', 'T', '1'};
  scan.channels16[0].step_1e4deg = 1667;
  for (std::uint16_t i = 0; i < 1140; ++i) scan.channels16[0].raw.push_back(1000 + i);
  return scan;
}
void BM_EncodeProfile(benchmark::State& state) {
  const auto scan = some_scan();
  for (auto _ : state)
    benchmark::DoNotOptimize(
        drivers::encode_lms_scan(drivers::ColaDialect::binary, "sSN", scan).data());
  state.SetItemsProcessed(state.iterations() * 1140);
}
BENCHMARK(BM_EncodeProfile);
void BM_DecodeProfile(benchmark::State& state) {
  const auto bytes = drivers::encode_lms_scan(drivers::ColaDialect::binary, "sSN", some_scan());
  drivers::LmsScan into;
  for (auto _ : state) {
    benchmark::DoNotOptimize(drivers::look_cola(bytes));
    benchmark::DoNotOptimize(drivers::decode_lms_scan(*drivers::parse_cola(bytes), into));
  }
  state.SetItemsProcessed(state.iterations() * 1140);
}
BENCHMARK(BM_DecodeProfile);

}  // namespace
