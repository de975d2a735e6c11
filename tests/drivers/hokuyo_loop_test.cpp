#include <cmath>
#include <numbers>

#include "drivers/hokuyo.hpp"
#include "sim/hokuyo_unit.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using drivers_test::FailsOnce;
using sim::UnitFault;
constexpr double kRadPerDeg = std::numbers::pi / 180;

sim::HokuyoUnitConfig exact() {
  return drivers_test::exact<sim::HokuyoUnitConfig>();
}

class HokuyoLoop : public drivers_test::ProfileRig<Hokuyo, sim::HokuyoUnit> {
 protected:
  void build(const HokuyoConfig& config = {}, const sim::HokuyoUnitConfig& unit_config = exact(),
             double bytes_per_s = 0) {
    connect(config, unit_config, bytes_per_s);
  }
};

TEST_F(HokuyoLoop, StartsIdentifiesAndMeasures) {
  HokuyoConfig config;
  config.model = "UST-20LX";
  build(config);
  ASSERT_TRUE(comes_up(*device, 5s)) << told(*device);
  EXPECT_EQ(device->identity().maker, "Hokuyo Automatic Co.,Ltd.");
  EXPECT_EQ(device->identity().model, "UST-20LX");
  EXPECT_EQ(device->identity().serial, "H1234567");
  ASSERT_TRUE(start()) << told(*device);
  const auto profiles = take(100);
  ASSERT_EQ(profiles.size(), 100U);
  EXPECT_EQ(profiles[0].ranges_m.size(), 1081U);
  EXPECT_NEAR(profiles[0].angle_first_rad, -135 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(profiles[0].angle_step_rad, 0.25 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(profiles[0].beam_period_s, 0.025 / 1440, 1e-9);
  EXPECT_EQ(device->lost(), 0U);
  const double ahead_m = std::min(5 / std::cos(0.3), 5.5 / std::sin(0.3));
  EXPECT_NEAR(profiles[50].ranges_m[540], ahead_m, 1e-3);
  ASSERT_TRUE(result_of(device->stop()).has_value());
  EXPECT_FALSE(unit->streaming());
  EXPECT_FALSE(result_of(device->next_profile()));
  EXPECT_EQ(told(*device), "");
}

TEST_F(HokuyoLoop, StampsAreThoseOfTheFirstBeamToAMillisecondOrTwo) {
  auto unit_config = exact();
  unit_config.skew = 120e-6;
  unit_config.clock_start_ms = 0xFFFFFF - 9000;  // Wraps after 9 s.
  build({}, unit_config);
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  const auto profiles = take(2000);
  ASSERT_EQ(profiles.size(), 2000U);
  EXPECT_EQ(told(*device), "");
  // A scan comes 0.5 ms after its last beam, three quarters of a turn after its first.
  const double since_first_s = hal::seconds(clock.now() - profiles.back().stamp);
  EXPECT_NEAR(since_first_s, 0.025 * 1081 / 1440 + 0.0005, 0.002);
  for (std::size_t i = 1; i < profiles.size(); ++i)
    ASSERT_NEAR(hal::seconds(profiles[i].stamp - profiles[i - 1].stamp), 0.025, 0.0021) << i;
}

TEST_F(HokuyoLoop, SendsIntensitiesOfAPartOfTheCircle) {
  HokuyoConfig config;
  config.intensities = true;
  config.step_first = 180;
  config.step_last = 900;
  build(config);
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start()) << told(*device);
  const auto profiles = take(3);
  ASSERT_EQ(profiles.size(), 3U);
  EXPECT_EQ(profiles[2].ranges_m.size(), 721U);
  EXPECT_EQ(profiles[2].intensities.size(), 721U);
  EXPECT_NEAR(profiles[0].angle_first_rad, -90 * kRadPerDeg, 1e-9);
}

TEST_F(HokuyoLoop, RefusesAnotherModel) {
  HokuyoConfig config;
  config.model = "UTM-30LX";
  build(config);
  EXPECT_TRUE(comes_to(*device, "wrong model", 5s)) << told(*device);
  EXPECT_FALSE(start());
}

TEST_F(HokuyoLoop, RefusesASectorThatItHasNot) {
  HokuyoConfig config;
  config.step_last = 1200;
  build(config);
  EXPECT_TRUE(comes_to(*device, "impossible sector", 5s)) << told(*device);
}

TEST_F(HokuyoLoop, NamesABrokenLaser) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  unit->break_laser(true);
  EXPECT_FALSE(start());
  EXPECT_TRUE(has(*device, "request refused"));
  EXPECT_NE(told(*device).find("hardware fault"), std::string::npos) << told(*device);
  unit->break_laser(false);
  EXPECT_TRUE(start());
  EXPECT_EQ(told(*device), "");
}

TEST_F(HokuyoLoop, TakesOverAScannerThatStreamsAlready) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  halt_all();
  stops.clear();
  device.emplace(HokuyoConfig{}, clock, wire->a());
  faults->clear();
  unit.emplace(exact(), world, clock, wire->b(), *faults, pan);
  spawn(unit->run());
  spawn(device->run());
  EXPECT_TRUE(comes_up(*device, 10s)) << told(*device);
  EXPECT_TRUE(start());
}

struct HokuyoFaultCase {
  sim::FaultSetting setting;
  std::string trouble;
};
class HokuyoFault : public HokuyoLoop, public testing::WithParamInterface<HokuyoFaultCase> {};

TEST_P(HokuyoFault, IsNamedAndEndsWithIt) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  take(200);
  EXPECT_EQ(told(*device), "");
  faults->set(GetParam().setting);
  EXPECT_TRUE(comes_to(*device, GetParam().trouble, 20s)) << told(*device);
  take_for(10s);
  faults->clear();
  take_for(60s);
  EXPECT_EQ(told(*device), "");
  EXPECT_TRUE(running(*device));
  EXPECT_EQ(take(100).size(), 100U);
}

INSTANTIATE_TEST_SUITE_P(
    All, HokuyoFault,
    testing::Values(HokuyoFaultCase{{UnitFault::off, 0}, "scans stopped"},
                    HokuyoFaultCase{{UnitFault::stuck, 0}, "same scan again and again"},
                    HokuyoFaultCase{{UnitFault::garbage, 0}, "not SCIP"},
                    HokuyoFaultCase{{UnitFault::wrong, 0.5}, "scans too slow"},
                    HokuyoFaultCase{{UnitFault::slow, 2.5},
                                    "scans too slow"},  // A whole factor looks like loss.
                    HokuyoFaultCase{{UnitFault::delayed, 0.5}, "scans come late"},
                    HokuyoFaultCase{{UnitFault::intermittent, 0.4}, "scans get lost"},
                    HokuyoFaultCase{{UnitFault::duplicated_reordered, 0}, "scans out of order"}),
    [](const auto& each) {
      std::string name = sim::to_text(each.param.setting);
      name = name.substr(0, name.find(':'));
      for (char& c : name)
        if (c == '-') c = '_';
      return name;
    });

TEST_F(HokuyoLoop, ComesUpWhereverTheCableIsCut) {
  build();
  for (std::uint64_t bytes = 1; bytes < 3000; bytes += 67) {
    sim::LinkFaults cut;
    cut.cut_after = bytes;
    wire->set_faults(cut);
    (void)result_of(device->start());
    take_for(3s);
    wire->set_faults({});
    wire->cut();
    wire->mend();
    ASSERT_TRUE(comes_up(*device, 60s)) << bytes << '\n' << told(*device);
    ASSERT_TRUE(start()) << bytes << '\n' << told(*device);
    ASSERT_EQ(take(3).size(), 3U) << bytes;
    (void)result_of(device->stop());
  }
}

TEST_F(HokuyoLoop, ComesUpWhicheverCallOfTheLinkFails) {
  for (int n = 1; n <= 60; ++n) {
    halt_all();
    build();
    FailsOnce failing(wire->a(), n);
    Hokuyo once({}, clock, failing);
    halt_all();
    spawn(unit->run());
    spawn(once.run());
    (void)result_of(once.start());
    for (int i = 0; i < 40; ++i) (void)result_of(once.next_profile());
    ASSERT_TRUE(failing.failed()) << n;
    ASSERT_TRUE(comes_up(once, 30s)) << n << '\n' << told(once);
    ASSERT_TRUE(result_of(once.start())) << n;
    ASSERT_TRUE(result_of(once.next_profile())) << n;
    halt_all();
  }
}

}  // namespace
}  // namespace drivers
