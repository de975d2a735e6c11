#include <cmath>
#include <numbers>

#include "drivers/sick_lms.hpp"
#include "sim/sick_lms_unit.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using drivers_test::FailsOnce;
using sim::UnitFault;
constexpr double kDegree = std::numbers::pi / 180;

SickLmsConfig lms111() {
  return {};
}
SickLmsConfig lms511() {
  SickLmsConfig config;
  config.settings.lms5xx = true;
  config.settings.frequency_centihz = 2500;
  config.settings.resolution_1e4deg = 1667;
  config.settings.start_1e4deg = -50000;
  config.settings.stop_1e4deg = 1850000;
  return config;
}
sim::SickLmsUnitConfig unit_of(const SickLmsConfig& config) {
  auto unit = drivers_test::exact<sim::SickLmsUnitConfig>();
  unit.lms5xx = config.settings.lms5xx;
  return unit;
}

class SickLmsLoop : public drivers_test::ProfileRig<SickLms, sim::SickLmsUnit> {
 protected:
  void build(const SickLmsConfig& config, const sim::SickLmsUnitConfig& unit_config) {
    connect(config, unit_config);
  }
  void build(const SickLmsConfig& config = lms111()) { build(config, unit_of(config)); }
};

TEST_F(SickLmsLoop, StartsIdentifiesAndMeasures) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s)) << told(*device);
  EXPECT_EQ(told(*device), "");
  EXPECT_EQ(device->identity().maker, "SICK");
  EXPECT_EQ(device->identity().model, "LMS11x_FieldEval");
  EXPECT_EQ(device->identity().firmware, "V1.80.2");
  ASSERT_TRUE(start());
  const auto profiles = take(200);
  ASSERT_EQ(profiles.size(), 200U);
  EXPECT_EQ(profiles[0].ranges_m.size(), 541U);
  EXPECT_NEAR(profiles[0].angle_first_rad, -135 * kDegree, 1e-9);
  EXPECT_NEAR(profiles[0].angle_step_rad, 0.5 * kDegree, 1e-9);
  EXPECT_NEAR(profiles[0].beam_period_s, 0.02 / 720, 1e-9);
  EXPECT_EQ(device->counts().lost, 0U);
  EXPECT_EQ(device->counts().repeated, 1U);  // As the real one does now and then.
  // In the room (12 x 10 m) from (1, -0.5) at 0.3 rad, level: by hand for the beam straight ahead.
  const double ahead_m = std::min(5 / std::cos(0.3), 5.5 / std::sin(0.3));
  EXPECT_NEAR(profiles[50].ranges_m[270], ahead_m, 1e-3);
  ASSERT_TRUE(result_of(device->stop()).has_value());
  EXPECT_FALSE(unit->streaming());
  EXPECT_FALSE(result_of(device->next_profile()));
}

TEST_F(SickLmsLoop, MeasuresAsAnLms5xxAcrossTheFarWall) {
  build(lms511());
  ASSERT_TRUE(comes_up(*device, 5s)) << told(*device);
  ASSERT_TRUE(start());
  const auto profiles = take(20);
  ASSERT_EQ(profiles.size(), 20U);
  EXPECT_EQ(profiles[0].ranges_m.size(), 1140U);
  EXPECT_NEAR(profiles[0].angle_first_rad, -95 * kDegree, 1e-9);
}

TEST_F(SickLmsLoop, SendsRemissionWhenAsked) {
  auto config = lms111();
  config.settings.remission = true;
  build(config);
  ASSERT_TRUE(comes_up(*device, 5s)) << told(*device);
  ASSERT_TRUE(start());
  const auto profiles = take(3);
  ASSERT_EQ(profiles.size(), 3U);
  EXPECT_EQ(profiles[2].intensities.size(), 541U);
  EXPECT_GT(profiles[2].intensities[270], 0);
}

TEST_F(SickLmsLoop, FindsOutThatOnlyCoLaAIsSpoken) {
  auto unit_config = unit_of(lms111());
  unit_config.only = ColaDialect::ascii;
  build(lms111(), unit_config);
  ASSERT_TRUE(comes_up(*device, 10s)) << told(*device);
  EXPECT_EQ(device->identity().model, "LMS11x_FieldEval");
  ASSERT_TRUE(start());
  const auto profiles = take(50);
  ASSERT_EQ(profiles.size(), 50U);
  EXPECT_EQ(profiles[0].ranges_m.size(), 541U);
}

// Stamps are those of the first beam, whatever the crystal and wherever its clock stands.
void expect_true_stamps(const std::vector<hal::Profile>& profiles, hal::Duration latest) {
  for (std::size_t i = 200; i < profiles.size(); ++i) {
    const double turn_s = hal::seconds(profiles[i].stamp - profiles[i - 1].stamp);
    ASSERT_NEAR(turn_s, 0.02, 0.0004) << i;
  }
  EXPECT_LT(profiles.back().stamp.time_since_epoch(), latest);
}

TEST_F(SickLmsLoop, StampsFollowACrystalThatIsOffAndAClockThatWraps) {
  auto unit_config = unit_of(lms111());
  unit_config.skew = 150e-6;
  unit_config.clock_start_us = 0xFFFFFFFFU - 12'000'000U;  // Wraps after 12 s.
  build(lms111(), unit_config);
  ASSERT_TRUE(comes_up(*device, 5s)) << told(*device);
  ASSERT_TRUE(start());
  const auto profiles = take(2000);
  ASSERT_EQ(profiles.size(), 2000U);
  expect_true_stamps(profiles, clock.now().time_since_epoch());
  EXPECT_NEAR(device->clock_skew(), -150e-6, 20e-6);
  EXPECT_EQ(device->counts().lost, 0U);
  // The mirror turns evenly by its own crystal: a line through the stamps is its.
  const double span_s = hal::seconds(profiles[1999].stamp - profiles[200].stamp);
  EXPECT_NEAR(span_s, 1799 * 0.02 / (1 + 150e-6), 0.0006);
}

TEST_F(SickLmsLoop, StampsDoNotFollowTransportHiccups) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  sim::LinkFaults late;
  late.jitter = 15ms;
  wire->set_faults(late);
  ASSERT_TRUE(start());
  const auto profiles = take(1000);
  ASSERT_EQ(profiles.size(), 1000U);
  double worst_s = 0;
  for (std::size_t i = 300; i < profiles.size(); ++i)
    worst_s =
        std::max(worst_s, std::abs(hal::seconds(profiles[i].stamp - profiles[i - 1].stamp) - 0.02));
  EXPECT_LT(worst_s, 0.001);
}

TEST_F(SickLmsLoop, RefusesAnotherModel) {
  auto unit_config = unit_of(lms111());
  unit_config.ident = "TiM551";
  build(lms111(), unit_config);
  EXPECT_TRUE(comes_to(*device, "wrong model", 10s));
  EXPECT_NE(told(*device).find("TiM551"), std::string::npos) << told(*device);
  EXPECT_FALSE(comes_up(*device, 20s));
  EXPECT_FALSE(start());
}

TEST_F(SickLmsLoop, RefusesSettingsThatTheModelHasNot) {
  auto config = lms111();
  config.settings.frequency_centihz = 7500;
  build(config);
  EXPECT_TRUE(comes_to(*device, "impossible settings", 1s));
  EXPECT_FALSE(start());
}

TEST_F(SickLmsLoop, NamesASettingThatTheScannerRefuses) {
  auto unit_config = unit_of(lms511());
  unit_config.lms5xx = false;  // An LMS1xx that says it is an LMS5xx.
  unit_config.ident = "LMS511_PRO";
  build(lms511(), unit_config);
  ASSERT_TRUE(comes_to(*device, "setting refused", 10s)) << told(*device);
  EXPECT_NE(told(*device).find("frequency"), std::string::npos) << told(*device);
}

TEST_F(SickLmsLoop, WaitsForAScannerThatIsSwitchedOnLater) {
  build();
  faults->set({UnitFault::off, 0});
  ASSERT_TRUE(comes_to(*device, "no answer", 10s)) << told(*device);
  run_for(60s);
  faults->clear();
  EXPECT_TRUE(comes_up(*device, 30s)) << told(*device);
  EXPECT_EQ(told(*device), "");
}

struct LmsFaultCase {
  sim::FaultSetting setting;
  std::string trouble;
};

class SickLmsFault : public SickLmsLoop, public testing::WithParamInterface<LmsFaultCase> {};

TEST_P(SickLmsFault, IsNamedAndEndsWithIt) {
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
    All, SickLmsFault,
    testing::Values(LmsFaultCase{{UnitFault::off, 0}, "scans stopped"},
                    LmsFaultCase{{UnitFault::stuck, 0}, "same scan again and again"},
                    LmsFaultCase{{UnitFault::garbage, 0}, "not CoLa"},
                    LmsFaultCase{{UnitFault::wrong, 0.5}, "settings differ"},
                    LmsFaultCase{{UnitFault::slow, 3}, "scans too slow"},
                    LmsFaultCase{{UnitFault::delayed, 0.5}, "scans come late"},
                    LmsFaultCase{{UnitFault::intermittent, 0.4}, "scans get lost"},
                    LmsFaultCase{{UnitFault::duplicated_reordered, 0}, "scans out of order"}),
    [](const auto& each) {
      std::string name = sim::to_text(each.param.setting);
      name = name.substr(0, name.find(':'));
      for (char& c : name)
        if (c == '-') c = '_';
      return name;
    });

TEST_F(SickLmsLoop, ComesBackAfterTheCableWasOut) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  take(100);
  wire->cut();
  EXPECT_TRUE(comes_to(*device, "no connection", 5s)) << told(*device);
  run_for(20s);
  wire->mend();
  take_for(30s);
  EXPECT_EQ(told(*device), "");
  EXPECT_EQ(take(100).size(), 100U);
  EXPECT_GT(device->counts().lost, 500U);
}

TEST_F(SickLmsLoop, SaysWhenTheWindowIsDirty) {
  build();
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  take(50);
  unit->set_status(2);
  take(2);
  EXPECT_TRUE(has(*device, "pollution warning"));
  unit->set_status(4);
  take(2);
  EXPECT_TRUE(has(*device, "pollution error"));
  EXPECT_FALSE(has(*device, "pollution warning"));
  unit->set_status(0);
  take(2);
  EXPECT_EQ(told(*device), "");
}

TEST_F(SickLmsLoop, LosesTheOldestProfilesWhenNobodyTakesThem) {
  auto config = lms111();
  config.profiles_max = 10;
  build(config);
  ASSERT_TRUE(comes_up(*device, 5s));
  ASSERT_TRUE(start());
  run_for(1s);
  const auto profiles = take(10);
  ASSERT_EQ(profiles.size(), 10U);
  EXPECT_GT(device->counts().lost, 35U);
  EXPECT_EQ(profiles[0].lost_before, device->counts().lost);
  EXPECT_EQ(profiles[1].lost_before, 0U);
}

// Every call of the link is cut once, and still it comes up and measures.
TEST_F(SickLmsLoop, ComesUpWhereverTheCableIsCut) {
  build();
  for (std::uint64_t bytes = 1; bytes < 3000; bytes += 61) {
    sim::LinkFaults cut;
    cut.cut_after = bytes;
    wire->set_faults(cut);
    (void)result_of(device->start());
    take_for(3s);
    wire->set_faults({});
    wire->cut();
    wire->mend();
    const bool up = comes_up(*device, 60s);
    ASSERT_TRUE(up) << bytes << '\n' << told(*device);
    ASSERT_TRUE(start()) << bytes;
    ASSERT_EQ(take(3).size(), 3U) << bytes;
    (void)result_of(device->stop());
  }
}

TEST_F(SickLmsLoop, ComesUpWhicheverCallOfTheLinkFails) {
  for (int n = 1; n <= 60; ++n) {
    halt_all();
    build();
    FailsOnce failing(wire->a(), n);
    SickLms once(lms111(), clock, failing);
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

std::vector<float> some_run(std::uint64_t seed) {
  class Run : public SickLmsLoop {
   public:
    void TestBody() override {}
    std::vector<float> ranges(std::uint64_t its_seed) {
      auto unit_config = unit_of(lms111());
      unit_config.ranges.range_sigma_m = 0.01;
      unit_config.seed = its_seed;
      build(lms111(), unit_config);
      EXPECT_TRUE(comes_up(*device, 5s));
      EXPECT_TRUE(start());
      std::vector<float> all;
      for (const auto& profile : take(100)) {
        all.insert(all.end(), profile.ranges_m.begin(), profile.ranges_m.end());
        all.push_back(static_cast<float>(profile.stamp.time_since_epoch().count() % 1000000));
      }
      return all;
    }
  } run;
  return run.ranges(seed);
}

TEST(SickLmsLoopRepeats, TheSameSeedGivesTheSameProfiles) {
  EXPECT_EQ(some_run(3), some_run(3));
  EXPECT_NE(some_run(3), some_run(4));
}

}  // namespace
}  // namespace drivers
