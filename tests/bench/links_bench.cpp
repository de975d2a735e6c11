// What simulated links cost: a mission moves millions of frames. The reference is a coroutine that
// only sleeps and wakes by the simulated clock.
#include <benchmark/benchmark.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <exception>

#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "sim/unit_faults.hpp"

namespace {

using namespace std::chrono_literals;

constexpr int kMessages = 20'000;

struct World {
  boost::asio::io_context io{1};
  sim::SimClock clock{io};

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }
  void run() {
    clock.run([] { return false; });
  }
};

hal::Task<void> send_frames(hal::CanBus& bus, hal::Clock& clock) {
  hal::CanFrame frame{0x123, 8};
  for (int i = 0; i < kMessages; ++i) {
    const auto sent = co_await bus.send(frame, clock.now() + 1s);
    if (!sent) std::abort();
    co_await clock.sleep_for(500us);
  }
}

hal::Task<void> receive_frames(hal::CanBus& bus) {
  for (;;) benchmark::DoNotOptimize(co_await bus.receive());
}

void SleepOnly(benchmark::State& state) {
  for (auto _ : state) {
    World world;
    const auto sleep = [&]() -> hal::Task<void> {
      for (int i = 0; i < kMessages; ++i) co_await world.clock.sleep_for(500us);
    };
    world.spawn(sleep());
    world.run();
  }
  state.SetItemsProcessed(state.iterations() * kMessages);
}
BENCHMARK(SleepOnly)->Unit(benchmark::kMillisecond);

void frames(benchmark::State& state, double bit_rate_bps, const sim::LinkFaults& faults) {
  for (auto _ : state) {
    World world;
    sim::CanWire wire(world.clock, {bit_rate_bps});
    sim::UnitFaults unit_faults(world.clock);
    sim::CanWire::End& end = wire.attach();
    sim::FaultyCan unit(end, world.clock, unit_faults);
    wire.set_faults(faults);
    world.spawn(receive_frames(wire.attach()));
    world.spawn(send_frames(unit, world.clock));
    world.run();
  }
  state.SetItemsProcessed(state.iterations() * kMessages);
}
void CanFrames(benchmark::State& state) {
  frames(state, 0, {});
}
BENCHMARK(CanFrames)->Unit(benchmark::kMillisecond);
void CanFramesOf500kbit(benchmark::State& state) {
  frames(state, 500'000, {});
}
BENCHMARK(CanFramesOf500kbit)->Unit(benchmark::kMillisecond);
void CanFramesDelayed(benchmark::State& state) {
  frames(state, 500'000, {.delay = 3ms, .jitter = 1ms});
}
BENCHMARK(CanFramesDelayed)->Unit(benchmark::kMillisecond);

void StreamMessages(benchmark::State& state) {
  const std::vector<std::uint8_t> message(static_cast<std::size_t>(state.range(0)), 1);
  for (auto _ : state) {
    World world;
    sim::StreamWire wire(world.clock);
    const auto write = [&]() -> hal::Task<void> {
      for (int i = 0; i < kMessages; ++i) {
        const auto written = co_await wire.b().write(message);
        if (!written) std::abort();
        co_await world.clock.sleep_for(500us);
      }
    };
    const auto read = [&]() -> hal::Task<void> {
      std::vector<std::uint8_t> buffer(message.size());
      for (;;) benchmark::DoNotOptimize(co_await wire.a().read_some(buffer));
    };
    world.spawn(read());
    world.spawn(write());
    world.run();
  }
  state.SetItemsProcessed(state.iterations() * kMessages);
}
BENCHMARK(StreamMessages)->Arg(100)->Arg(4000)->Unit(benchmark::kMillisecond);

}  // namespace
