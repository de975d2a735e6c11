// A driver's loop against its simulated unit over a serial line in memory, on simulated time.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"
#include "tests/sim/room.hpp"

namespace drivers_test {

// The n-th call (from 1) fails once, as when the port is gone for a moment.
class FailingStream final : public hal::ByteStream {
 public:
  FailingStream(hal::ByteStream& link, int nth) : link_(link), left_(nth) {}

  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override {
    if (fails()) co_return error();
    co_return co_await link_.write(bytes);
  }
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
    if (fails()) co_return error();
    co_return co_await link_.read_some(into);
  }
  bool failed() const { return left_ <= 0; }

 private:
  bool fails() { return --left_ == 0; }
  static boost::system::error_code error() {
    return boost::system::errc::make_error_code(boost::system::errc::not_connected);
  }

  hal::ByteStream& link_;
  int left_;
};

// Everything around a driver and its unit. Times are from the start.
struct StreamLoop {
  explicit StreamLoop(sim::StreamWire::Config wire_config = {}) : wire(clock, wire_config) {
    EXPECT_TRUE(world.put_robot({{3, 4}, 0.3}, 0));
  }

  // Runs until the test ends, which it must not do by itself.
  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr error) {
      if (error) std::rethrow_exception(error);
      ADD_FAILURE() << "a loop ended";
    });
  }
  void run_for(double span_s) { clock.run_until(clock.now() + hal::from_seconds(span_s)); }

  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::Scene scene{sim_test::plain(100)};
  sim::World world{scene, sim::WorldConfig()};
  sim::StreamWire wire;
  sim::UnitFaults faults{clock};
};

inline std::vector<std::string> names(const drivers::Device& device) {
  std::vector<std::string> all;
  for (const drivers::Trouble& trouble : device.troubles()) {
    EXPECT_NE(trouble.fault, nullptr);
    EXPECT_FALSE(trouble.fault->cause.empty() || trouble.fault->remedy.empty());
    all.emplace_back(trouble.fault->name);
  }
  return all;
}

inline std::string detail_of(const drivers::Device& device, std::string_view fault) {
  for (const drivers::Trouble& trouble : device.troubles())
    if (trouble.fault->name == fault) return trouble.detail;
  return "(no such trouble)";
}

}  // namespace drivers_test
