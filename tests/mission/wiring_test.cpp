// A drive that is wired or set wrongly: what start-up and `vantage doctor` say of it, with the
// remedy. (Serial lines and networks: tests/tools/doctor_test.cpp.)
#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "mission/main_robot.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/cia402_unit.hpp"
#include "sim/links.hpp"
#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;
namespace errc = boost::system::errc;

// A bus that went off, as it does where another bit rate disturbs it.
class BusOff final : public hal::CanBus {
 public:
  explicit BusOff(hal::Clock& clock) : clock_(clock) {}
  hal::Task<hal::Result<void>> send(hal::CanFrame, hal::Time) override {
    co_return errc::make_error_code(errc::network_down);
  }
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    co_await clock_.sleep_for(1s);
    co_return errc::make_error_code(errc::network_down);
  }

 private:
  hal::Clock& clock_;
};

enum class OnTheBus { nothing, scout, scout_v1, nodes_1_and_3, bus_off };

struct Wrong {
  const char* name;
  const char* device;  // In the robot file.
  OnTheBus there;
  const char* says;
  const char* advises;
};

void PrintTo(const Wrong& wrong, std::ostream* to) {
  *to << wrong.name;
}

const sim::Scene& plain() {
  static const sim::Mesh mesh = sim_test::plain(100);
  static const auto* const scene = new sim::Scene(mesh);  // Embree's statics end before ours.
  return *scene;
}

struct Bench {
  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::World world{plain(), {}};
  sim::CanWire can{clock};
  sim::StreamWire scanner{clock}, pan{clock}, imu{clock}, gnss{clock};
  sim::UnitFaults left{clock}, right{clock};
  BusOff off{clock};
  std::optional<sim::AgilexUnit> agilex;
  std::optional<sim::Cia402Unit> cia402;
  std::unique_ptr<mission::RobotDrivers> drivers;

  void spawn(hal::Task<void> task) {
    boost::asio::co_spawn(io, std::move(task), [](std::exception_ptr problem) {
      if (problem) std::rethrow_exception(problem);
    });
  }
  void put(OnTheBus there) {
    if (there == OnTheBus::scout || there == OnTheBus::scout_v1) {
      sim::AgilexUnit::Config config;
      if (there == OnTheBus::scout_v1) config.dialect = drivers::agilex::Dialect::v1;
      agilex.emplace(config, world, nullptr, clock, can.attach(), left);
      spawn(agilex->run());
    }
    if (there == OnTheBus::nodes_1_and_3) {
      sim::Cia402NodeConfig one, two;
      two.node = 3;
      cia402.emplace(one, two, world, clock, can.attach(), can.attach(), left, right);
      spawn(cia402->run());
    }
  }
  void drive(const std::string& device, bool bus_off) {
    mission::RobotConfig config;
    config.drive.device = device;
    mission::RobotDrivers::Links links{
        .drive = bus_off ? static_cast<hal::CanBus*>(&off) : &can.attach(),
        .scanner = &scanner.a(),
        .pan = &pan.a(),
        .imu = &imu.a(),
        .gnss = &gnss.a(),
        .packets = nullptr,
        .power = {}};
    drivers = std::make_unique<mission::RobotDrivers>(config, std::nullopt, clock, links);
    spawn(drivers->devices().front().device->run());
  }
};

class WrongBus : public testing::TestWithParam<Wrong> {};

TEST_P(WrongBus, IsNamedWithItsRemedy) {
  const Wrong& wrong = GetParam();
  Bench bench;
  bench.put(wrong.there);
  bench.drive(wrong.device, wrong.there == OnTheBus::bus_off);
  bench.clock.run_until(hal::Time(6s));
  const std::string text = bench.drivers->not_running();
  const std::string drive = text.substr(0, text.find("; scanner ("));
  EXPECT_THAT(drive, testing::HasSubstr(wrong.says));
  EXPECT_THAT(drive, testing::HasSubstr(wrong.advises));
}

INSTANTIATE_TEST_SUITE_P(
    Drives, WrongBus,
    testing::Values(Wrong{"BitRateOfAScout", "agilex-scout2", OnTheBus::bus_off, "CAN bus down",
                          "set 500 kbit/s"},
                    Wrong{"BitRateOfCia402", "cia402", OnTheBus::bus_off, "CAN bus down",
                          "set the drives' bit rate"},
                    Wrong{"NothingOnTheBus", "agilex-scout2", OnTheBus::nothing,
                          "nobody acknowledges on the bus", "check CAN-H, CAN-L"},
                    Wrong{"NodeIdOfARightDrive", "cia402", OnTheBus::nodes_1_and_3,
                          "right drive, node 2",
                          "compare node id and bit rate with the robot file"},
                    Wrong{"ScoutWhereCia402IsNamed", "cia402", OnTheBus::scout,
                          "another device or master on the bus",
                          "check which channel the drives hang on"},
                    Wrong{"DialectOfAnOldScout", "agilex-scout2", OnTheBus::scout_v1,
                          "base speaks protocol version 1", "update the base to version 2"}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
