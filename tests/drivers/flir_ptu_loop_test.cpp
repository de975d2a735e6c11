#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "drivers/flir_ptu.hpp"
#include "drivers/pan_fit.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "tests/drivers/loop_rig.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using drivers_test::FailsOnce;
using sim::UnitFault;
constexpr double kDeg = std::numbers::pi / 180;

class FlirPtuLoop : public drivers_test::LoopRig {
 protected:
  void build(FlirPtuConfig config = {}, sim::FlirPtuUnitConfig unit_config = {},
             double bytes_per_s = 0) {
    sim::StreamWire::Config line;
    line.bytes_per_s = bytes_per_s;
    wire.emplace(clock, line);
    faults.emplace(clock, 5);
    unit.emplace(unit_config, clock, wire->b(), *faults);
    device.emplace(config, clock, wire->a());
    spawn(unit->run());
    spawn(device->run());
  }
  ~FlirPtuLoop() override { halt_all(); }

  double truth() const { return unit->angle_rad(clock.now()); }
  std::error_code move(double angle_rad) {
    const auto moved = result_of(device->move_to(angle_rad));
    return moved ? std::error_code() : std::error_code(moved.error());
  }
  // Asks again and again, as a sweep does.
  void read_for(hal::Duration span) {
    const hal::Time end = clock.now() + span;
    while (clock.now() < end) {
      if (!result_of(device->read())) run_for(100ms);
      run_for(20ms);
    }
  }

  std::optional<sim::StreamWire> wire;
  std::optional<sim::UnitFaults> faults;
  std::optional<sim::FlirPtuUnit> unit;
  std::optional<FlirPtu> device;
};

TEST_F(FlirPtuLoop, StartsWhateverItsTalkAndKnowsItsSteps) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s)) << told(*device);
  EXPECT_EQ(told(*device), "");
  EXPECT_NEAR(device->step_rad(), 46.2857 / 3600 * kDeg, 1e-9);
  EXPECT_EQ(device->identity().maker, "FLIR");
  EXPECT_NE(device->identity().firmware.find("v3.02.2"), std::string::npos);
  run_for(30s);
  ASSERT_TRUE(device->health().has_value());
  EXPECT_NEAR(device->health()->supply_v, 13.2, 1e-9);
}

TEST_F(FlirPtuLoop, MovesThereAndSaysWhenItStands) {
  build();
  for (const double angle : {90 * kDeg, -150 * kDeg, 0.001, 0.0}) {
    EXPECT_FALSE(move(angle)) << told(*device);
    EXPECT_NEAR(truth(), angle, 2 * device->step_rad());
    const double then = truth();
    run_for(1s);
    EXPECT_EQ(truth(), then);
    EXPECT_NEAR(result_of(device->read())->angle_rad, then, device->step_rad());
  }
  EXPECT_EQ(told(*device), "");
}

TEST_F(FlirPtuLoop, RefusesWhatLiesBeyondItsLimits) {
  FlirPtuConfig config;
  config.angle_max_rad = 100 * kDeg;
  build(config);
  EXPECT_EQ(move(101 * kDeg), std::errc::argument_out_of_domain);   // The robot's limit.
  EXPECT_EQ(move(-165 * kDeg), std::errc::argument_out_of_domain);  // The unit's own.
  EXPECT_EQ(result_of(device->turn_to(1, 5)).error(), std::errc::argument_out_of_domain);
  EXPECT_EQ(result_of(device->turn_to(1, 1e-9)).error(), std::errc::argument_out_of_domain);
  EXPECT_FALSE(move(99 * kDeg));
}

TEST_F(FlirPtuLoop, TurnsAtTheRateAskedForAndHalts) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  ASSERT_FALSE(move(-90 * kDeg));
  ASSERT_TRUE(result_of(device->turn_to(90 * kDeg, 25 * kDeg)));
  run_for(3s);
  const double from = truth();
  run_for(1s);
  EXPECT_NEAR(truth() - from, 25 * kDeg, 0.02 * kDeg);
  ASSERT_TRUE(result_of(device->halt()));
  run_for(3s);
  const double stopped = truth();
  EXPECT_LT(stopped, 60 * kDeg);
  run_for(2s);
  EXPECT_EQ(truth(), stopped);
}

// A line through the readings is where the axis really is, at 9600 baud too.
TEST_F(FlirPtuLoop, ReadingsFollowTheAxisOnASlowLine) {
  FlirPtuConfig config;
  config.bytes_per_s = 960;
  build(config, {}, 960);
  ASSERT_TRUE(comes_up(*device, 20s)) << told(*device);
  ASSERT_FALSE(move(-60 * kDeg));
  const double rate = 6 * kDeg;
  ASSERT_TRUE(result_of(device->turn_to(90 * kDeg, rate)));
  run_for(2s);
  std::vector<PanSample> samples;
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const auto reading = result_of(device->read());
    ASSERT_TRUE(reading);
    samples.push_back({reading->asked, reading->answered, reading->angle_rad});
    run_for(20ms);
  }
  const auto fit = fit_pan(samples, 0.01);
  ASSERT_TRUE(fit);
  for (const auto& s : samples)
    worst = std::max(worst, std::abs(fit->angle_at(s.asked) - unit->angle_rad(s.asked)));
  EXPECT_LT(worst, rate * 0.002) << "2 ms of the rate";
  EXPECT_NEAR(fit->rate_radps, rate, 1e-3 * rate);
}

TEST_F(FlirPtuLoop, CountsTheOtherWayWhenMountedSo) {
  FlirPtuConfig config;
  config.counter_clockwise = true;
  sim::FlirPtuUnitConfig unit_config;
  unit_config.counter_clockwise = true;
  build(config, unit_config);
  EXPECT_FALSE(move(1));
  EXPECT_NEAR(truth(), 1, 0.001);
}

TEST_F(FlirPtuLoop, TellsAnotherModelByItsSteps) {
  FlirPtuConfig config;
  config.arcsec_per_step = 185.1428;
  build(config);
  EXPECT_TRUE(comes_to(*device, "wrong model", 10s)) << told(*device);
  EXPECT_EQ(move(0.1), std::errc::not_connected);
}

TEST_F(FlirPtuLoop, ResetsWhenAskedTo) {
  FlirPtuConfig config;
  config.reset_at_start = true;
  build(config);
  unit->lose_steps(50);
  EXPECT_FALSE(comes_up(*device, 8s));
  EXPECT_TRUE(comes_up(*device, 20s)) << told(*device);
  ASSERT_FALSE(move(0.5));
  EXPECT_NEAR(truth(), 0.5, 0.001);
  EXPECT_EQ(told(*device), "");
}

TEST_F(FlirPtuLoop, SaysWhenItRunsHot) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  unit->set_temperature_f(160);
  EXPECT_TRUE(comes_to(*device, "too hot", 20s));
  unit->set_temperature_f(90);
  run_for(20s);
  EXPECT_EQ(told(*device), "");
}

struct FaultCase {
  sim::FaultSetting setting;
  std::string trouble;
};
class FlirPtuFault : public FlirPtuLoop, public testing::WithParamInterface<FaultCase> {};

TEST_P(FlirPtuFault, IsNamedAndEndsWithIt) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  ASSERT_FALSE(move(-1));
  faults->set(GetParam().setting);
  bool named = false;
  for (int i = 0; i < 20 && !named; ++i) {
    (void)move(i % 2 ? 1.5 : -1.5);
    // Often: a fault that comes and goes may be over whenever a move is.
    for (int k = 0; k < 50 && !named; ++k) {
      named = has(*device, GetParam().trouble);
      read_for(20ms);
    }
  }
  EXPECT_TRUE(named) << told(*device);
  faults->clear();
  read_for(40s);
  (void)move(0);
  read_for(30s);
  EXPECT_FALSE(move(1)) << told(*device);
  EXPECT_EQ(told(*device), "");
  EXPECT_TRUE(running(*device));
  EXPECT_NEAR(truth(), 1, 0.001);
}

INSTANTIATE_TEST_SUITE_P(
    All, FlirPtuFault,
    testing::Values(FaultCase{{UnitFault::off, 0}, "no answer"},
                    FaultCase{{UnitFault::stuck, 0}, "does not get there"},
                    FaultCase{{UnitFault::garbage, 0}, "no pan-tilt unit's answers"},
                    FaultCase{{UnitFault::wrong, 0.5}, "does not get there"},
                    FaultCase{{UnitFault::slow, 5}, "does not get there"},
                    FaultCase{{UnitFault::delayed, 0.5}, "answers late"},
                    FaultCase{{UnitFault::intermittent, 4}, "no answer"},
                    FaultCase{{UnitFault::duplicated_reordered, 0}, "answers out of step"}),
    [](const auto& each) {
      std::string name = sim::to_text(each.param.setting);
      name = name.substr(0, name.find(':'));
      for (char& c : name)
        if (c == '-') c = '_';
      return name;
    });

hal::Task<void> listen(hal::ByteStream& line, std::string& heard) {
  std::array<std::uint8_t, 64> buffer;
  for (;;) {
    const auto got = co_await line.read_some(buffer);
    if (!got) co_return;
    heard += as_text(ByteView(buffer).first(*got));
  }
}

// GCC 12 compiled its set-up so that it went on with the next question.
TEST_F(FlirPtuLoop, BeginsAnewWithAUnitThatDoesNotAnswer) {
  wire.emplace(clock, sim::StreamWire::Config{});
  device.emplace(FlirPtuConfig{}, clock, wire->a());
  std::string heard;
  spawn(listen(wire->b(), heard));
  spawn(device->run());
  run_for(20s);
  EXPECT_TRUE(heard.starts_with(" ED  ED ")) << heard;
  EXPECT_EQ(heard.find("PR"), std::string::npos) << heard;
  halt_all();
}

TEST_F(FlirPtuLoop, StopsWithoutPowerAndResetsWhenItComesBack) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  ASSERT_FALSE(move(-1));
  ASSERT_TRUE(result_of(device->turn_to(1, 25 * kDeg)));
  run_for(2s);
  faults->set({UnitFault::off, 0});
  const double without_power = truth();
  run_for(5s);
  EXPECT_EQ(truth(), without_power);
  EXPECT_LT(without_power, 0);
  faults->clear();
  EXPECT_EQ(truth(), 0);
  EXPECT_TRUE(move(0.3));  // It resets, without answers.
  EXPECT_FALSE(comes_up(*device, 5s));
  EXPECT_TRUE(comes_up(*device, 20s)) << told(*device);
  EXPECT_FALSE(move(0.3));
  EXPECT_NEAR(truth(), 0.3, 0.001);
  EXPECT_EQ(told(*device), "");
}

// It echoes and uses words again, and was asked for neither.
TEST_F(FlirPtuLoop, SetsAUnitUpAgainWhosePowerWasAwayForAMoment) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  ASSERT_FALSE(move(-1));
  faults->set({UnitFault::off, 0});
  run_for(10ms);
  faults->clear();
  EXPECT_TRUE(move(0.3));
  EXPECT_TRUE(has(*device, "no answer")) << told(*device);
  EXPECT_TRUE(comes_up(*device, 20s)) << told(*device);
  EXPECT_FALSE(move(0.3)) << told(*device);
  EXPECT_NEAR(truth(), 0.3, 0.001);
}

TEST_F(FlirPtuLoop, ComesBackAfterTheCableWasOut) {
  build();
  ASSERT_TRUE(comes_up(*device, 10s));
  wire->cut();
  EXPECT_TRUE(comes_to(*device, "no connection", 5s));
  run_for(20s);
  EXPECT_EQ(move(0.1), std::errc::not_connected);
  wire->mend();
  EXPECT_TRUE(comes_up(*device, 20s));
  EXPECT_FALSE(move(0.3));
  EXPECT_EQ(told(*device), "");
}

TEST_F(FlirPtuLoop, ComesUpWhereverTheCableIsCut) {
  build();
  for (std::uint64_t bytes = 1; bytes < 400; bytes += 3) {
    sim::LinkFaults cut;
    cut.cut_after = bytes;
    wire->set_faults(cut);
    (void)result_of(device->move_to(0.2));
    read_for(1s);
    wire->set_faults({});
    wire->cut();
    wire->mend();
    ASSERT_TRUE(comes_up(*device, 60s)) << bytes << '\n' << told(*device);
    ASSERT_FALSE(move(-0.2)) << bytes << '\n' << told(*device);
  }
}

TEST_F(FlirPtuLoop, ComesUpWhicheverCallOfTheLinkFails) {
  for (int n = 1; n <= 60; ++n) {
    halt_all();
    build();
    FailsOnce failing(wire->a(), n);
    FlirPtu once({}, clock, failing);
    halt_all();
    spawn(unit->run());
    spawn(once.run());
    (void)result_of(once.move_to(0.3));
    (void)result_of(once.move_to(-0.3));
    ASSERT_TRUE(failing.failed()) << n;
    ASSERT_TRUE(comes_up(once, 30s)) << n << '\n' << told(once);
    ASSERT_TRUE(result_of(once.move_to(0.1))) << n << '\n' << told(once);
    EXPECT_EQ(told(once), "") << n;
    halt_all();
  }
}

}  // namespace
}  // namespace drivers
