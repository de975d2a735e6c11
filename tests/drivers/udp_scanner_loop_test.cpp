#include <cmath>
#include <numbers>

#include "drivers/ouster.hpp"
#include "drivers/velodyne.hpp"
#include "sim/ouster_unit.hpp"
#include "sim/velodyne_unit.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using sim::UnitFault;

sim::ScannerModel exact() {
  sim::ScannerModel model;
  model.range_min_m = 0.1;
  model.range_sigma_m = 0;
  model.lost_share_max = 0;
  return model;
}

OusterMetadata metadata() {
  OusterMetadata m;
  EXPECT_EQ(parse_ouster_metadata(sim::sample_ouster_metadata(), m), "");
  return m;
}

enum class Kind { velodyne, ouster };

class UdpScannerLoop : public drivers_test::LoopRig {
 protected:
  void build(Kind kind, std::uint32_t clock_start_us = 0) {
    wire.emplace(clock);
    faults.emplace(clock, 5);
    if (kind == Kind::velodyne) {
      sim::VelodyneUnitConfig config;
      config.ranges = exact();
      config.clock_start_us = clock_start_us;
      velodyne_unit.emplace(config, world, clock, wire->sender(), *faults);
      device = std::make_unique<Velodyne>(VelodyneConfig{}, clock, wire->receiver());
      spawn(velodyne_unit->run());
    } else {
      sim::OusterUnitConfig config;
      config.metadata = metadata();
      config.ranges = exact();
      ouster_unit.emplace(config, world, clock, wire->sender(), *faults);
      OusterConfig its;
      its.metadata = metadata();
      its.scan.turns = 2;
      device = std::make_unique<Ouster>(its, clock, wire->receiver());
      spawn(ouster_unit->run());
    }
    spawn(device->run());
  }
  ~UdpScannerLoop() override { halt_all(); }

  hal::Result<hal::ScanCloud> scan() { return result_of(device->scan()); }

  double worst_off_the_walls(const hal::ScanCloud& cloud) const {
    const auto T_W_S = world.robot().T_W_S(world.config().scanner.height_m);
    double worst_m = 0;
    for (std::size_t i = 0; i < cloud.ranges_m.size(); ++i) {
      if (!(cloud.ranges_m[i] > 0)) continue;
      const Vector3d p = T_W_S * (cloud.beams[i].S_origin_m.cast<double>() +
                                  cloud.ranges_m[i] * cloud.beams[i].S_direction.cast<double>());
      const double off_m = std::min({std::abs(std::abs(p.x()) - 6), std::abs(std::abs(p.y()) - 5),
                                     std::abs(p.z()), std::abs(p.z() - 4)});
      worst_m = std::max(worst_m, off_m);
    }
    return worst_m;
  }
  static std::size_t measured(const hal::ScanCloud& cloud) {
    std::size_t count = 0;
    for (const float range_m : cloud.ranges_m) count += range_m > 0;
    return count;
  }

  std::optional<sim::DatagramWire> wire;
  std::optional<sim::UnitFaults> faults;
  std::optional<sim::VelodyneUnit> velodyne_unit;
  std::optional<sim::OusterUnit> ouster_unit;
  std::unique_ptr<UdpScanner> device;
};

TEST_F(UdpScannerLoop, AVlp16FillsItsPatternInAFewTurns) {
  build(Kind::velodyne);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told(*device);
  EXPECT_EQ(cloud->pattern.columns, 1800U);
  EXPECT_EQ(cloud->pattern.rows, 16U);
  // Azimuths come in hundredths of a degree: half of one is 0.6 mm at 7 m; ranges in 2 mm.
  EXPECT_LT(worst_off_the_walls(*cloud), 0.003);
  EXPECT_GT(measured(*cloud), cloud->pattern.beams() * 99 / 100);
  EXPECT_EQ(told(*device), "");
  EXPECT_EQ(device->packets_lost(), 0U);
}

TEST_F(UdpScannerLoop, AnOusterFillsItsPatternInOneTurnAndMore) {
  build(Kind::ouster);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << told(*device);
  EXPECT_EQ(cloud->pattern.columns, 1024U);
  EXPECT_EQ(cloud->pattern.rows, 32U);
  EXPECT_LT(worst_off_the_walls(*cloud), 0.001);
  EXPECT_GT(measured(*cloud), cloud->pattern.beams() * 99 / 100);
  EXPECT_EQ(device->identity().serial, "992000000042");
  EXPECT_EQ(told(*device), "");
}

TEST_F(UdpScannerLoop, BeamsKeepToTheirCells) {
  for (const Kind kind : {Kind::velodyne, Kind::ouster}) {
    halt_all();
    build(kind);
    const auto cloud = scan();
    ASSERT_TRUE(cloud);
    const auto& pattern = cloud->pattern;
    for (std::uint32_t c = 0; c < pattern.columns; ++c)
      for (std::uint32_t r = 0; r < pattern.rows; ++r) {
        const auto& d = cloud->beams[std::size_t{c} * pattern.rows + r].S_direction;
        const double azimuth = pattern.azimuth_first_rad + c * pattern.azimuth_step_rad;
        const double elevation = pattern.elevation_first_rad + r * pattern.elevation_step_rad;
        ASSERT_NEAR(std::remainder(std::atan2(d.y(), d.x()) - azimuth, 2 * std::numbers::pi), 0,
                    0.501 * pattern.azimuth_step_rad);
        ASSERT_NEAR(std::asin(d.z()), elevation, 0.1 * pattern.elevation_step_rad);
      }
  }
}

TEST_F(UdpScannerLoop, TheHourOfAVlp16MayTurnDuringAScan) {
  build(Kind::velodyne, kVelodyneHour_us - 1'200'000);
  ASSERT_TRUE(scan()) << told(*device);
  ASSERT_TRUE(scan()) << told(*device);
  EXPECT_EQ(device->packets_lost(), 0U);
  EXPECT_EQ(told(*device), "");
}

TEST_F(UdpScannerLoop, LostPacketsLeaveNothingThatWouldBeTakenForEmptySpace) {
  build(Kind::ouster);
  ASSERT_TRUE(scan());
  sim::LinkFaults loss;
  loss.loss = 0.3;
  wire->set_faults(loss);
  EXPECT_EQ(scan().error(), std::errc::io_error);
  EXPECT_NE(device->problem().find("packets are lost"), std::string::npos);
  loss.loss = 0.01;
  wire->set_faults(loss);
  const auto cloud = scan();
  ASSERT_TRUE(cloud) << device->problem();
  for (const float range_m : cloud->ranges_m) ASSERT_NE(range_m, 0);  // A closed room.
}

TEST_F(UdpScannerLoop, NamesPacketsOfAnotherSensor) {
  build(Kind::ouster);
  ASSERT_TRUE(scan());
  halt_all();
  OusterConfig other;
  other.metadata = metadata();
  other.metadata.serial_number = "7";
  wire.emplace(clock);
  sim::OusterUnitConfig config;
  config.metadata = metadata();
  ouster_unit.emplace(config, world, clock, wire->sender(), *faults);
  device = std::make_unique<Ouster>(other, clock, wire->receiver());
  spawn(ouster_unit->run());
  spawn(device->run());
  EXPECT_TRUE(comes_to(*device, "other packets", 5s));
  EXPECT_NE(told(*device).find("serial number"), std::string::npos) << told(*device);
  EXPECT_EQ(scan().error(), std::errc::not_connected);
}

TEST_F(UdpScannerLoop, SaysWhenAnOusterRunsHot) {
  build(Kind::ouster);
  ASSERT_TRUE(scan());
  ouster_unit->set_thermal_shutdown(true);
  EXPECT_TRUE(comes_to(*device, "thermal shutdown", 2s));
  ouster_unit->set_thermal_shutdown(false);
  run_for(1s);
  EXPECT_EQ(told(*device), "");
}

TEST_F(UdpScannerLoop, ComesBackAfterTheCableWasOut) {
  build(Kind::velodyne);
  ASSERT_TRUE(scan());
  wire->cut();
  EXPECT_TRUE(comes_to(*device, "no packets", 5s));
  EXPECT_EQ(scan().error(), std::errc::not_connected);
  wire->mend();
  EXPECT_TRUE(scan());
  run_for(5s);
  EXPECT_EQ(told(*device), "");
}

struct FaultCase {
  Kind kind;
  sim::FaultSetting setting;
  std::string trouble;
};
class UdpScannerFault : public UdpScannerLoop, public testing::WithParamInterface<FaultCase> {};

TEST_P(UdpScannerFault, IsNamedAndEndsWithIt) {
  build(GetParam().kind);
  ASSERT_TRUE(scan());
  EXPECT_EQ(told(*device), "");
  faults->set(GetParam().setting);
  EXPECT_TRUE(comes_to(*device, GetParam().trouble, 20s)) << told(*device);
  run_for(2s);
  faults->clear();
  run_for(5s);
  EXPECT_EQ(told(*device), "");
  EXPECT_TRUE(scan()) << told(*device) << device->problem();
}

std::vector<FaultCase> fault_cases() {
  std::vector<FaultCase> cases;
  for (const Kind kind : {Kind::velodyne, Kind::ouster})
    for (const auto& [setting, trouble] : std::vector<std::pair<sim::FaultSetting, std::string>>{
             {{UnitFault::off, 0}, "no packets"},
             {{UnitFault::stuck, 0}, "same scan again and again"},
             {{UnitFault::garbage, 0}, "other packets"},
             {{UnitFault::wrong, 0.5}, "scans too slow"},
             {{UnitFault::slow, 2.5}, "scans too slow"},
             {{UnitFault::delayed, 0.5}, "scans come late"},
             {{UnitFault::intermittent, 0.4}, "scans get lost"},
             {{UnitFault::duplicated_reordered, 0}, "scans out of order"}})
      cases.push_back({kind, setting, trouble});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(All, UdpScannerFault, testing::ValuesIn(fault_cases()),
                         [](const auto& each) {
                           std::string name = sim::to_text(each.param.setting);
                           name = name.substr(0, name.find(':'));
                           for (char& c : name)
                             if (c == '-') c = '_';
                           return (each.param.kind == Kind::velodyne ? "velodyne_" : "ouster_") +
                                  name;
                         });

}  // namespace
}  // namespace drivers
