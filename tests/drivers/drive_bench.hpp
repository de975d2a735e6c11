// A robot on a level plain with a wall 8 m ahead, without slip, its drive on a simulated CAN bus:
// for tests of drives against simulated units.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <exception>
#include <ostream>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "hal/devices.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"
#include "tests/sim/room.hpp"

namespace drivers_test {

using namespace std::chrono_literals;
namespace errc = boost::system::errc;

constexpr double kWallM = 8;

inline const sim::Scene& plain_with_wall() {
  static const sim::Mesh mesh = [] {
    sim::Mesh ground = sim_test::plain(300);
    sim_test::add_box(ground, {kWallM, -20, 0}, {kWallM + 0.4, 20, 3});
    return ground;
  }();
  // Never destroyed: when statics are, Embree's own are already gone.
  static const auto* const scene = new sim::Scene(mesh);
  return *scene;
}

inline sim::WorldConfig without_slip() {
  sim::WorldConfig config;
  config.slip_sigma = 0;
  return config;
}

// Lets the n-th call fail once, as a driver's own bus.
class FailingBus final : public hal::CanBus {
 public:
  FailingBus(hal::CanBus& bus, int fails_at) : bus_(bus), fails_at_(fails_at) {}

  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override {
    if (++calls_ == fails_at_) co_return boost::system::errc::make_error_code(errc::timed_out);
    co_return co_await bus_.send(frame, deadline);
  }
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    const bool fails = ++calls_ == fails_at_;
    auto received = co_await bus_.receive();
    if (fails) co_return boost::system::errc::make_error_code(errc::network_down);
    co_return received;
  }
  int calls() const { return calls_; }

 private:
  hal::CanBus& bus_;
  int fails_at_;
  int calls_ = 0;
};

struct DriveBench {
  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::World world{plain_with_wall(), without_slip()};
  sim::CanWire wire{clock};

  hal::Twist twist;  // Commanded every 50 ms by commander().
  std::vector<boost::system::error_code> answers;
  double left_m = 0, right_m = 0, step_max_m = 0;
  int reports = 0;
  std::vector<std::string> log;  // Of tap().

  DriveBench() { EXPECT_TRUE(world.put_robot({{0, 0}, 0}, 0)); }

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }

  template <class T>
  T run(hal::Task<T> task) {
    std::optional<T> result;
    boost::asio::co_spawn(io, std::move(task), [&](std::exception_ptr problem, T value) {
      if (problem) std::rethrow_exception(problem);
      result = std::move(value);
    });
    EXPECT_TRUE(clock.run([&] { return result.has_value(); }));
    return std::move(*result);
  }

  hal::Task<void> commander(hal::Drive& drive) {
    for (;;) {
      const auto answer = co_await drive.command(twist);
      answers.push_back(answer ? boost::system::error_code{} : answer.error());
      co_await clock.sleep_for(50ms);
    }
  }

  hal::Task<void> odometer(hal::Drive& drive) {
    for (;;) {
      const hal::WheelTravel travel = (co_await drive.next_travel()).value();
      left_m += travel.left_m;
      right_m += travel.right_m;
      step_max_m = std::max({step_max_m, std::abs(travel.left_m), std::abs(travel.right_m)});
      ++reports;
    }
  }

  // Everything that is on the bus, as candump writes it.
  hal::Task<void> tap(hal::CanBus& bus) {
    for (;;) {
      const auto received = co_await bus.receive();
      if (!received) continue;
      std::string line = std::to_string(received->stamp.time_since_epoch() / 1us) + " " +
                         std::to_string(received->frame.id) + "#";
      for (unsigned i = 0; i < received->frame.size; ++i)
        line += std::to_string(received->frame.data[i]) + ".";
      log.push_back(std::move(line));
    }
  }

  void wait(hal::Duration span) { clock.run_until(clock.now() + span); }
  double heard_m() const { return (left_m + right_m) / 2; }
};

// Of a table of faults that are set and the troubles that must name them.
struct FaultCase {
  sim::FaultSetting setting;
  std::string_view named;
  bool drives = false;  // Through the fault.
};
inline void PrintTo(const FaultCase& fault, std::ostream* out) {
  *out << sim::to_text(fault.setting);
}

// "name (detail); name (detail)"
inline std::string text(const std::vector<drivers::Trouble>& troubles) {
  std::string all;
  for (const auto& trouble : troubles) {
    all += (all.empty() ? "" : "; ") + std::string(trouble.fault->name);
    if (!trouble.detail.empty()) all += " (" + trouble.detail + ")";
  }
  return all;
}

inline bool names(const std::vector<drivers::Trouble>& troubles, std::string_view what) {
  return text(troubles).find(what) != std::string::npos;
}

}  // namespace drivers_test
