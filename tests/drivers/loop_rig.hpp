// A simulated clock, a world and what drivers' loops need to be tested against simulated units.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/multiple_exceptions.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "hal/links.hpp"
#include "sim/links.hpp"
#include "sim/pan_truth.hpp"
#include "sim/sim_clock.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"
#include "tests/sim/room.hpp"

namespace drivers_test {

// A stream whose n-th call, counted from one, fails; the ones after it work again.
class FailsOnce final : public hal::ByteStream {
 public:
  FailsOnce(hal::ByteStream& link, int n) : link_(link), left_(n) {}
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    if (--left_ == 0) co_return failure();
    co_return co_await link_.write(bytes);
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    if (--left_ == 0) co_return failure();
    co_return co_await link_.read_some(into);
  }
  bool failed() const { return left_ <= 0; }

 private:
  static boost::system::error_code failure() {
    return make_error_code(boost::system::errc::io_error);
  }
  hal::ByteStream& link_;
  int left_;
};

// Members of a test stand below it, so that they are destroyed before the event loop.
class LoopRig : public testing::Test {
 protected:
  LoopRig() : world(scene, world_config()) { EXPECT_TRUE(world.put_robot({{1.0, -0.5}, 0.3}, 0)); }
  ~LoopRig() override { halt_all(); }

  static sim::WorldConfig world_config() {
    sim::WorldConfig config;
    config.scanner.height_m = 1.5;
    return config;
  }

  static void rethrow(std::exception_ptr error) {
    if (!error) return;
    try {
      std::rethrow_exception(error);
    } catch (const boost::asio::multiple_exceptions& both) {  // Of what was joined.
      rethrow(both.first_exception());
    } catch (const boost::system::system_error& e) {
      if (e.code() != boost::asio::error::operation_aborted) throw;
    }
  }

  // Runs until halt_all().
  void spawn(hal::Task<void> task) {
    stops.push_back(std::make_unique<boost::asio::cancellation_signal>());
    boost::asio::co_spawn(io, std::move(task),
                          boost::asio::bind_cancellation_slot(stops.back()->slot(), rethrow));
  }
  void halt_all() {
    for (auto& stop : stops) stop->emit(boost::asio::cancellation_type::terminal);
    io.restart();
    io.poll();
  }

  // What a task returns; it may take an hour.
  template <class T>
  T result_of(hal::Task<T> task) {
    std::optional<T> result;
    std::exception_ptr failed;
    boost::asio::co_spawn(io, std::move(task), [&](std::exception_ptr error, T value) {
      failed = error;
      if (!error) result = std::move(value);
    });
    const hal::Time limit = clock.now() + std::chrono::hours(1);
    clock.run([&] { return result || failed || clock.now() > limit; });
    if (failed) std::rethrow_exception(failed);
    if (!result) throw std::runtime_error("it did not end within an hour");
    return std::move(*result);
  }
  void run_for(hal::Duration span) { clock.run_until(clock.now() + span); }

  bool running(const drivers::Device& device) {
    return device.state() == drivers::DeviceState::running;
  }
  bool comes_up(const drivers::Device& device, hal::Duration within) {
    const hal::Time limit = clock.now() + within;
    clock.run([&] { return running(device) || clock.now() >= limit; });
    return running(device);
  }
  // Until the device has a trouble of this name.
  bool comes_to(const drivers::Device& device, std::string_view trouble, hal::Duration within) {
    const hal::Time limit = clock.now() + within;
    clock.run([&] { return has(device, trouble) || clock.now() >= limit; });
    return has(device, trouble);
  }
  static bool has(const drivers::Device& device, std::string_view trouble) {
    for (const auto& t : device.troubles())
      if (t.fault->name == trouble) return true;
    return false;
  }
  static std::string told(const drivers::Device& device) {
    std::string text;
    for (const auto& t : device.troubles())
      text += std::string(t.fault->name) + ": " + t.detail + '\n';
    return text;
  }

  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::Scene scene{sim_test::room(6, 5, 4)};
  sim::World world;
  std::vector<std::unique_ptr<boost::asio::cancellation_signal>> stops;
};

// A profile scanner's loop and its unit, on a pan axis that stands still.
template <class Device, class Unit>
class ProfileRig : public LoopRig {
 protected:
  template <class Config, class UnitConfig>
  void connect(const Config& config, const UnitConfig& unit_config, double bytes_per_s = 0) {
    sim::StreamWire::Config line;
    line.bytes_per_s = bytes_per_s;
    wire.emplace(clock, line);
    faults.emplace(clock, 5);
    unit.emplace(unit_config, world, clock, wire->b(), *faults, pan);
    device.emplace(config, clock, wire->a());
    spawn(unit->run());
    spawn(device->run());
  }
  ~ProfileRig() override { halt_all(); }

  std::vector<hal::Profile> take(int count) {
    std::vector<hal::Profile> profiles;
    for (int i = 0; i < count; ++i) {
      auto profile = result_of(device->next_profile());
      if (!profile) {
        ADD_FAILURE() << profile.error().message() << '\n' << told(*device);
        break;
      }
      profiles.push_back(std::move(*profile));
    }
    return profiles;
  }
  bool start() { return result_of(device->start()).has_value(); }
  // Takes profiles as they come, for so long.
  void take_for(hal::Duration span) {
    const hal::Time end = clock.now() + span;
    while (clock.now() < end) (void)result_of(device->next_profile());
  }

  std::optional<sim::StreamWire> wire;
  std::optional<sim::UnitFaults> faults;
  sim::FixedPan pan;
  std::optional<Unit> unit;
  std::optional<Device> device;
};

// What a unit measures without noise or losses.
template <class UnitConfig>
UnitConfig exact(UnitConfig unit = {}) {
  unit.ranges.range_min_m = 0.1;
  unit.ranges.range_max_m = 50;
  unit.ranges.range_sigma_m = 0;
  unit.ranges.lost_share_max = 0;
  return unit;
}

}  // namespace drivers_test
