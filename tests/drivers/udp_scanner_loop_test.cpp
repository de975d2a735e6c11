#include <algorithm>
#include <cmath>
#include <map>
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
      VelodyneConfig its;
      its.scan.look_max_rad = kLookMax_rad;
      device = std::make_unique<Velodyne>(its, clock, wire->receiver());
      spawn(velodyne_unit->run());
    } else {
      sim::OusterUnitConfig config;
      config.metadata = metadata();
      config.ranges = exact();
      ouster_unit.emplace(config, world, clock, wire->sender(), *faults);
      OusterConfig its;
      its.metadata = metadata();
      its.scan.turns = 2;
      its.scan.look_max_rad = kLookMax_rad;
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
  std::vector<hal::Turn> turns(int count) {
    std::vector<hal::Turn> taken;
    for (int i = 0; i < count; ++i) {
      auto turn = result_of(device->next_turn());
      if (!turn) {
        ADD_FAILURE() << turn.error().message() << told(*device);
        break;
      }
      taken.push_back(std::move(*turn));
    }
    return taken;
  }

  static std::size_t measured(const hal::ScanCloud& cloud) {
    std::size_t count = 0;
    for (const float range_m : cloud.ranges_m) count += range_m > 0;
    return count;
  }

  sim::UnitFaults* fresh_faults() {
    faults.emplace(clock, 5);
    return &*faults;
  }

  static constexpr double kLookMax_rad = 0.05;
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

// Each beam of a turn against rays that are cast where it says that it went: within its column, and
// as exactly as the packets tell.
TEST_F(UdpScannerLoop, TurnsOnTheWayAreWhatRaysOfTheWorldMeet) {
  for (const auto& [kind, count] : {std::pair(Kind::velodyne, 9U), {Kind::ouster, 18U}}) {
    halt_all();
    build(kind);
    ASSERT_TRUE(scan());
    ASSERT_TRUE(result_of(device->start()));
    const auto taken = turns(3);
    ASSERT_EQ(taken.size(), 3U);
    const auto T_W_S = world.robot().T_W_S(world.config().scanner.height_m);
    const std::vector<hal::BeamRow>& rows = taken[1].rows;
    EXPECT_EQ(rows.size(), count);
    EXPECT_LT(std::abs(rows[taken[1].level].elevation_rad), 1.01 * std::numbers::pi / 180);
    EXPECT_LT(rows.back().elevation_rad, kLookMax_rad);
    std::size_t beams = 0, known = 0;
    for (const hal::BeamRow& row : rows)
      for (std::size_t i = 0; i < row.ranges_m.size(); ++i) {
        const double half = std::abs(taken[1].angle_step_rad) / 2;
        const double angle = taken[1].angle_first_rad + double(i) * taken[1].angle_step_rad;
        double nearest_m = 1e9, farthest_m = 0;
        for (const double at : {angle - half, angle, angle + half}) {
          const Vector3d way(std::cos(row.elevation_rad) * std::cos(at),
                             std::cos(row.elevation_rad) * std::sin(at),
                             std::sin(row.elevation_rad));
          const auto hit =
              scene.cast(T_W_S * Vector3d(0, 0, row.tip_z_m), T_W_S.linear() * way, 0.05, 50);
          ASSERT_TRUE(hit);
          nearest_m = std::min(nearest_m, hit->distance_m);
          farthest_m = std::max(farthest_m, hit->distance_m);
        }
        ++beams;
        if (std::isnan(row.ranges_m[i])) continue;
        ++known;
        ASSERT_GE(row.ranges_m[i], nearest_m - 0.004) << row.elevation_rad << " " << angle;
        ASSERT_LE(row.ranges_m[i], farthest_m + 0.004) << row.elevation_rad << " " << angle;
      }
    EXPECT_GT(known, beams * 98 / 100);
    EXPECT_NEAR(hal::seconds(taken[2].stamp - taken[1].stamp), 0.1, 0.003);
  }
}

// A robot that turns on the spot: each beam is placed by where the robot was when it was measured.
TEST_F(UdpScannerLoop, StampsOfTurnsTellWhereARobotThatTurnsLooked) {
  for (const Kind kind : {Kind::velodyne, Kind::ouster}) {
    halt_all();
    build(kind);
    ASSERT_TRUE(scan());
    ASSERT_TRUE(result_of(device->start()));
    std::map<hal::Time, hal::Pose2> went;
    std::optional<hal::Profile> seen;
    const hal::Time end = clock.now() + 2s;
    while (clock.now() < end) {
      ASSERT_TRUE(world.command({0, 0.7}));
      run_for(5ms);
      went[clock.now()] = world.robot().pose;
      if (clock.now() + 200ms > end && !seen) seen = hal::level_profile(turns(1).at(0));
    }
    ASSERT_TRUE(seen);
    double worst_m = 0;
    for (std::size_t i = 0; i < seen->ranges_m.size(); ++i) {
      if (!(seen->ranges_m[i] > 0)) continue;
      const hal::Time at = seen->stamp + hal::from_seconds(double(i) * seen->beam_period_s);
      const hal::Pose2 pose = std::prev(went.upper_bound(at))->second;
      const double angle =
          pose.heading_rad + seen->angle_first_rad + double(i) * seen->angle_step_rad;
      const double away_m = double{seen->ranges_m[i]};
      const double x = pose.position_m.x() + away_m * std::cos(angle);
      const double y = pose.position_m.y() + away_m * std::sin(angle);
      worst_m = std::max(worst_m, std::min(std::abs(std::abs(x) - 6), std::abs(std::abs(y) - 5)));
    }
    // Ticks of the world are 20 ms: 0.8 deg, 10 cm at 7 m. A turn of 0.1 s would be 4 deg off.
    EXPECT_LT(worst_m, 0.16);
  }
}

TEST_F(UdpScannerLoop, TurnsThatLostMuchAreNotTold) {
  build(Kind::velodyne);
  ASSERT_TRUE(scan());
  EXPECT_EQ(result_of(device->next_profile()).error(), std::errc::operation_not_permitted);
  ASSERT_TRUE(result_of(device->start()));
  ASSERT_EQ(turns(1).size(), 1U);
  sim::LinkFaults loss;
  loss.loss = 0.5;
  wire->set_faults(loss);
  run_for(3s);
  while (result_of(device->next_profile())) {
  }
  wire->set_faults({});
  const auto again = turns(2);
  ASSERT_EQ(again.size(), 2U);
  EXPECT_GT(again[0].lost_before, 20U);
  EXPECT_EQ(again[1].lost_before, 0U);
  ASSERT_TRUE(result_of(device->stop()));
  EXPECT_EQ(result_of(device->next_profile()).error(), std::errc::operation_not_permitted);
  EXPECT_TRUE(scan()) << "it scans as before";
}

// Nobody takes them for a minute: the newest few wait, and the rest are counted.
TEST_F(UdpScannerLoop, TurnsThatNobodyTakesAreBounded) {
  build(Kind::ouster);
  ASSERT_TRUE(scan());
  ASSERT_TRUE(result_of(device->start()));
  run_for(20s);
  const auto taken = turns(5);
  ASSERT_EQ(taken.size(), 5U);
  EXPECT_GT(taken[0].lost_before, 180U);
  EXPECT_GT(taken[0].stamp, clock.now() - 1s);
}

// A person who stands before the wall is seen, and nothing comes back of one who is too near.
TEST_F(UdpScannerLoop, PeopleAreSeen) {
  for (const Kind kind : {Kind::velodyne, Kind::ouster})
    for (const double away_m : {2.0, 0.6}) {
      halt_all();
      sim::WorldConfig config = world_config();
      config.people = {{.way_m = {{1.0 + away_m, -0.5}}}};
      sim::World crowded(scene, config);
      ASSERT_TRUE(crowded.put_robot({{1.0, -0.5}, 0}, 0));
      wire.emplace(clock);
      sim::ScannerModel ranges = exact();
      ranges.range_min_m = 0.8;
      sim::VelodyneUnitConfig vlp;
      sim::OusterUnitConfig os;
      vlp.ranges = os.ranges = ranges;
      os.metadata = metadata();
      std::optional<sim::VelodyneUnit> vlp_unit;
      std::optional<sim::OusterUnit> os_unit;
      if (kind == Kind::velodyne) {
        vlp_unit.emplace(vlp, crowded, clock, wire->sender(), *fresh_faults());
        device = std::make_unique<Velodyne>(VelodyneConfig{}, clock, wire->receiver());
        spawn(vlp_unit->run());
      } else {
        OusterConfig its;
        its.metadata = metadata();
        os_unit.emplace(os, crowded, clock, wire->sender(), *fresh_faults());
        device = std::make_unique<Ouster>(its, clock, wire->receiver());
        spawn(os_unit->run());
      }
      spawn(device->run());
      ASSERT_TRUE(scan());
      ASSERT_TRUE(result_of(device->start()));
      const auto taken = turns(2);
      const hal::Profile turn = hal::level_profile(taken.at(1));
      const auto ahead = static_cast<std::size_t>(
          std::lround((-2 * std::numbers::pi - turn.angle_first_rad) / turn.angle_step_rad));
      const double near_m = away_m - sim::Person{}.radius_m;
      EXPECT_NEAR(turn.ranges_m.at(ahead), near_m < 0.8 ? 0 : near_m, 0.02);
      halt_all();
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
