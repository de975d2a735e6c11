// What a minute of simulated time costs with a drive and its unit on the wire, and without.
#include <benchmark/benchmark.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/cia402_unit.hpp"
#include "sim/event_loop.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/direct_devices.hpp"

namespace {

using namespace std::chrono_literals;

const sim::Scene& plain() {
  static const sim::Mesh mesh = sim_test::plain(300);
  // Never destroyed: when statics are, Embree's own are already gone.
  static const auto* const scene = new sim::Scene(mesh);
  return *scene;
}

template <class Loop = sim::EventLoop>
struct Minutes {
  Loop loop;
  sim::SimClock clock{loop};
  sim::World world{plain(), {}};
  sim::CanWire wire{clock};
  sim::UnitFaults left_faults{clock}, right_faults{clock};

  Minutes() { world.put_robot({{0, 0}, 0}, 0).value(); }

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(loop.get_executor(), std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }
  hal::Task<void> read(hal::Drive& drive) {
    for (;;) benchmark::DoNotOptimize((co_await drive.next_travel()).value());
  }
  hal::Task<void> turn(hal::Drive& drive) {
    for (;;) {
      benchmark::DoNotOptimize(co_await drive.command({0.2, 0.2}));
      co_await clock.sleep_for(50ms);
    }
  }
  // A mission mostly stands and scans: nobody commands then.
  void run(benchmark::State& state, hal::Drive& drive) {
    spawn(read(drive));
    if (state.range(0) != 0) spawn(turn(drive));
    clock.run_until(hal::Time(5s));
    for (auto _ : state) clock.run_until(clock.now() + 1min);
    state.SetLabel(state.range(0) != 0 ? "driving" : "standing");
  }
};

void Direct(benchmark::State& state) {
  Minutes<> minutes;
  direct::Drive drive(minutes.world, minutes.clock);
  minutes.run(state, drive);
}
BENCHMARK(Direct)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

template <class Loop>
void Agilex(benchmark::State& state) {
  Minutes<Loop> minutes;
  sim::AgilexUnit unit({}, minutes.world, nullptr, minutes.clock, minutes.wire.attach(),
                       minutes.left_faults);
  const auto filters = drivers::AgilexDrive::filters();
  drivers::AgilexDrive drive({}, minutes.clock,
                             minutes.wire.attach({filters.begin(), filters.end()}));
  minutes.spawn(unit.run());
  minutes.spawn(drive.run());
  minutes.run(state, drive);
}
// The same, and the slower loop.
BENCHMARK(Agilex<sim::EventLoop>)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(Agilex<boost::asio::io_context>)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void Cia402(benchmark::State& state) {
  Minutes<> minutes;
  sim::Cia402NodeConfig left, right;
  right.node = 2;
  sim::Cia402Unit unit(left, right, minutes.world, minutes.clock, minutes.wire.attach(),
                       minutes.wire.attach(), minutes.left_faults, minutes.right_faults);
  drivers::Cia402Drive drive({}, minutes.clock, minutes.wire.attach());
  minutes.spawn(unit.run());
  minutes.spawn(drive.run());
  minutes.run(state, drive);
}
BENCHMARK(Cia402)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
