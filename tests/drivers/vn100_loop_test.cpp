// The VN-100's loop against its simulated unit.
#include <cmath>

#include "drivers/vn100.hpp"
#include "sim/vn100_unit.hpp"
#include "tests/drivers/stream_loop.hpp"

namespace {

using drivers::DeviceState;
using drivers_test::detail_of;
using drivers_test::names;
using sim::UnitFault;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

struct Options {
  drivers::Vn100Config driver;
  sim::Vn100UnitConfig unit;
  bool sets_baud = true;
  int fail_call = 0;  // 0: none
  sim::StreamWire::Config wire;
};

struct Imu : drivers_test::StreamLoop {
  explicit Imu(const Options& options = {})
      : StreamLoop(options.wire),
        link(wire.a(), options.fail_call),
        unit(options.unit, world, clock, wire.b(), faults),
        driver(options.driver, clock, link,
               options.sets_baud ? baud_setter() : drivers::SetBaud()) {
    unit.uart().set_host_baud(options.driver.settings.baud);
    spawn(unit.run());
    spawn(driver.run());
    spawn(take());
  }

  drivers::SetBaud baud_setter() {
    return [this](int baud) -> hal::Result<void> {
      unit.uart().set_host_baud(baud);
      return {};
    };
  }
  hal::Task<void> take() {
    for (;;) {
      const auto sample = co_await driver.next_sample();
      if (sample)
        samples.push_back(*sample);
      else
        ++errors;
    }
  }
  std::size_t samples_in(double span_s) {
    const std::size_t before = samples.size();
    run_for(span_s);
    return samples.size() - before;
  }

  drivers_test::FailingStream link;
  sim::Vn100Unit unit;
  drivers::Vn100 driver;
  std::vector<hal::ImuSample> samples;
  int errors = 0;
};

Options ascii() {
  Options options;
  options.driver.settings.ascii = true;
  return options;
}

TEST(Vn100Loop, StartsIdentifiesAndSendsAtTheRate) {
  Imu imu;
  imu.run_for(2);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
  EXPECT_EQ(imu.driver.identity().model, "VN-100T-CR");
  EXPECT_EQ(imu.driver.identity().serial, "0100013270");
  EXPECT_EQ(imu.driver.identity().firmware, "2.1.0.0");
  EXPECT_THAT(names(imu.driver), IsEmpty());
  EXPECT_EQ(imu.samples_in(10), 500U);
}

TEST(Vn100Loop, LinesGiveTheSameRateOfTurn) {
  Imu imu(ascii());
  imu.run_for(2);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
  EXPECT_EQ(imu.samples_in(10), 500U);
  EXPECT_THAT(names(imu.driver), IsEmpty());
}

TEST(Vn100Loop, TurningLeftIsPositive) {
  for (const bool lines : {false, true}) {
    Imu imu(lines ? ascii() : Options());
    imu.run_for(2);
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(imu.world.command({0, 0.5}));
      imu.run_for(0.1);
    }
    EXPECT_NEAR(imu.samples.back().yaw_rate_radps, 0.5, 0.05);
  }
}

// The world's reader draws the same noise whoever reads it: what a mission got from it directly, it
// gets through the wire, to the float that the wire carries.
TEST(Vn100Loop, TheWireCarriesWhatTheWorldSays) {
  Imu imu;
  imu.run_for(1);
  imu.samples.clear();
  imu.run_for(1);
  sim::World other(imu.scene, sim::WorldConfig());
  std::vector<float> said;
  for (int i = 0; i < 200; ++i)
    said.push_back(static_cast<float>(other.sample_imu().yaw_rate_radps));
  std::vector<float> heard;
  for (const auto& sample : imu.samples) heard.push_back(static_cast<float>(sample.yaw_rate_radps));
  ASSERT_EQ(heard.size(), 50U);
  EXPECT_NE(std::search(said.begin(), said.end(), heard.begin(), heard.end()), said.end());
}

TEST(Vn100Loop, StampsByTheDevicesClockFittedToOurs) {
  for (const double skew : {-80e-6, 0.0, 120e-6}) {
    Options options;
    options.unit.clock_skew = skew;
    options.unit.running_since_before = std::chrono::hours(77);
    options.wire.bytes_per_s = 11520;
    Imu imu(options);
    sim::LinkFaults hiccups;
    hiccups.jitter = std::chrono::milliseconds(8);
    imu.wire.set_faults(hiccups);
    imu.run_for(120);
    imu.samples.clear();
    imu.run_for(20);
    ASSERT_EQ(imu.samples.size(), 1000U) << skew;
    for (const auto& sample : imu.samples) {
      const double since_s = hal::seconds(sample.stamp);
      const double off_s = since_s - std::round(since_s * 50) / 50;
      // The wire's own 4 ms, and what is left of hiccups of up to 8.
      EXPECT_NEAR(off_s, 0.0042, 0.0008) << skew;
    }
    EXPECT_NEAR(imu.driver.clock_fit().skew(), -skew, 15e-6);
  }
}

TEST(Vn100Loop, FindsTheRateOfThePort) {
  for (const int baud : drivers::kVn100Bauds) {
    Options options;
    options.unit.baud = baud;
    Imu imu(options);
    imu.run_for(5);
    EXPECT_EQ(imu.driver.state(), DeviceState::running) << baud;
    EXPECT_EQ(imu.driver.baud(), baud);
    EXPECT_THAT(names(imu.driver), IsEmpty());
  }
}

TEST(Vn100Loop, NamesAnotherBitRateThatItCannotSet) {
  Options options;
  options.unit.baud = 57600;
  options.sets_baud = false;
  Imu imu(options);
  imu.run_for(5);
  EXPECT_EQ(imu.driver.state(), DeviceState::starting);
  EXPECT_THAT(names(imu.driver), testing::ElementsAre("not understood"));
}

TEST(Vn100Loop, RefusesAnotherModel) {
  Options options;
  options.unit.model = "VN-200T-CR";
  Imu imu(options);
  imu.run_for(5);
  EXPECT_EQ(imu.driver.state(), DeviceState::starting);
  EXPECT_THAT(names(imu.driver), testing::ElementsAre("another device"));
  EXPECT_THAT(detail_of(imu.driver, "another device"), HasSubstr("VN-200T-CR"));
  EXPECT_TRUE(imu.samples.empty());
}

TEST(Vn100Loop, SaysThatNobodyIsThere) {
  Imu imu;
  imu.faults.set({UnitFault::off, 0});
  imu.run_for(5);
  EXPECT_THAT(names(imu.driver), testing::ElementsAre("silent"));
  imu.faults.clear();
  imu.run_for(5);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
  EXPECT_THAT(names(imu.driver), IsEmpty());
}

// A receiver on the port speaks once a second, at whatever moment: never is it called silence.
TEST(Vn100Loop, NamesADeviceThatSpeaksOnceASecond) {
  for (int phase_ms = 0; phase_ms < 1000; phase_ms += 50) {
    drivers_test::StreamLoop loop{sim::StreamWire::Config()};
    drivers::Vn100 driver({}, loop.clock, loop.wire.a());
    const auto speak = [](Imu::StreamLoop& on, int after_ms) -> hal::Task<void> {
      const std::string_view said = "$GNRMC,,V,,,,,,,,,,N*4D\r\n";
      const drivers::Bytes sentence(said.begin(), said.end());
      co_await on.clock.sleep_for(std::chrono::milliseconds(after_ms));
      for (;;) {
        (void)co_await on.wire.b().write(sentence);
        co_await on.clock.sleep_for(std::chrono::seconds(1));
      }
    };
    loop.spawn(speak(loop, phase_ms));
    loop.spawn(driver.run());
    loop.run_for(2.5);
    for (int i = 0; i < 50; ++i) {
      loop.run_for(0.1);
      EXPECT_THAT(names(driver), testing::ElementsAre("another device")) << phase_ms;
    }
  }
}

TEST(Vn100Loop, SaysWhichSettingWasRefused) {
  Imu imu;
  // It refuses once: the setting is repeated, and taken.
  imu.unit.refuse_settings(7);
  imu.run_for(3);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
}

struct Case {
  sim::FaultSetting fault;
  std::string named;
};

TEST(Vn100Loop, EveryFaultIsNamedAndOver) {
  const Case cases[] = {
      {{UnitFault::off, 0}, "silent"},
      {{UnitFault::stuck, 0}, "frozen"},
      {{UnitFault::garbage, 0}, "damaged bytes"},
      {{UnitFault::wrong, 0.5}, "values impossible"},
      {{UnitFault::slow, 3}, "slower than set"},
      {{UnitFault::delayed, 0.5}, "messages late"},
      {{UnitFault::intermittent, 2}, "silent"},
      {{UnitFault::duplicated_reordered, 0}, "messages repeated or out of order"}};
  for (const bool lines : {false, true})
    for (const Case& each : cases) {
      // Lines carry no time: that they come late is not seen.
      if (lines && each.fault.fault == UnitFault::delayed) continue;
      const std::string what = sim::to_text(each.fault) + (lines ? " in lines" : "");
      Imu imu(lines ? ascii() : Options());
      imu.run_for(10);
      ASSERT_EQ(imu.driver.state(), DeviceState::running) << what;
      imu.faults.set(each.fault);
      bool named = false;
      for (int i = 0; i < 50; ++i) {
        imu.run_for(0.1);
        const auto now = names(imu.driver);
        named |= std::find(now.begin(), now.end(), each.named) != now.end();
      }
      EXPECT_TRUE(named) << what << " was not named " << each.named;
      imu.faults.clear();
      imu.run_for(8);
      EXPECT_EQ(imu.driver.state(), DeviceState::running) << what;
      EXPECT_THAT(names(imu.driver), IsEmpty()) << what;
      EXPECT_EQ(imu.samples_in(2), 100U) << what;
    }
}

TEST(Vn100Loop, TellsWhoeverWaitsThatItIsLost) {
  Imu imu;
  imu.run_for(5);
  EXPECT_EQ(imu.errors, 0);
  imu.faults.set({UnitFault::off, 0});
  imu.run_for(0.3);
  EXPECT_THAT(names(imu.driver), Contains("silent"));
  imu.run_for(3);
  EXPECT_EQ(imu.driver.state(), DeviceState::lost);
  EXPECT_GE(imu.errors, 1);
}

TEST(Vn100Loop, IsToldAgainAfterALossOfPower) {
  Imu imu;
  imu.run_for(20);
  imu.unit.restart();  // It sends lines at 40 Hz now, as sold.
  imu.run_for(4);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
  EXPECT_EQ(imu.samples_in(2), 100U);
  EXPECT_THAT(names(imu.driver), IsEmpty());
  EXPECT_NEAR(hal::seconds(imu.samples.back().stamp), hal::seconds(imu.clock.now()), 0.03);
}

TEST(Vn100Loop, ComesBackAfterACutCable) {
  Imu imu;
  imu.run_for(5);
  imu.wire.cut();
  imu.run_for(5);
  EXPECT_EQ(imu.driver.state(), DeviceState::lost);
  EXPECT_THAT(names(imu.driver), Contains("link lost"));
  imu.wire.mend();
  imu.run_for(4);
  EXPECT_EQ(imu.driver.state(), DeviceState::running);
  EXPECT_THAT(names(imu.driver), IsEmpty());
}

TEST(Vn100Loop, ComesBackWhicheverCallFails) {
  int failed = 0;
  for (int nth = 1; nth <= 120; ++nth) {
    Options options;
    options.fail_call = nth;
    Imu imu(options);
    imu.run_for(6);
    failed += imu.link.failed();
    EXPECT_EQ(imu.driver.state(), DeviceState::running) << nth;
    EXPECT_EQ(imu.samples_in(1), 50U) << nth;
    EXPECT_THAT(names(imu.driver), IsEmpty()) << nth;
  }
  EXPECT_EQ(failed, 120);
}

TEST(Vn100Loop, NamesWhatItsFilterSays) {
  Imu imu;
  imu.run_for(3);
  imu.unit.set_vpe_status(3 | 1 << 2);
  imu.run_for(1);
  EXPECT_THAT(names(imu.driver),
              testing::UnorderedElementsAre("attitude lost", "gyroscope saturated"));
  imu.unit.set_vpe_status(0);
  imu.run_for(1);
  EXPECT_THAT(names(imu.driver), IsEmpty());
}

TEST(Vn100Loop, OnADirtyLineOnlyTheDamagedIsLost) {
  Imu imu;
  imu.run_for(3);
  sim::LinkFaults dirt;
  dirt.corruption = 0.05;
  imu.wire.set_faults(dirt);
  const auto came = imu.samples_in(20);
  EXPECT_GT(came, 900U);
  EXPECT_LT(came, 990U);
  EXPECT_THAT(names(imu.driver), Contains("damaged bytes"));
  for (const auto& sample : imu.samples) EXPECT_LT(std::abs(sample.yaw_rate_radps), 0.01);
}

TEST(Vn100Loop, RepeatsToTheLastBit) {
  std::vector<std::vector<hal::ImuSample>> runs;
  for (int run = 0; run < 2; ++run) {
    Options options;
    options.unit.clock_skew = 33e-6;
    Imu imu(options);
    imu.run_for(3);
    imu.faults.set({UnitFault::duplicated_reordered, 0});
    imu.run_for(10);
    runs.push_back(imu.samples);
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].stamp, runs[1][i].stamp);
    EXPECT_EQ(runs[0][i].yaw_rate_radps, runs[1][i].yaw_rate_radps);
  }
}

TEST(Vn100Settings, AreRefusedWithTheReason) {
  using drivers::vn100_settings_problem;
  EXPECT_EQ(vn100_settings_problem({50, false, 115200}), "");
  EXPECT_EQ(vn100_settings_problem({50, true, 115200}), "");
  EXPECT_THAT(vn100_settings_problem({30, true, 115200}), HasSubstr("lines come at"));
  EXPECT_THAT(vn100_settings_problem({300, false, 115200}), HasSubstr("800"));
  EXPECT_THAT(vn100_settings_problem({50, true, 57600}), HasSubstr("do not fit"));
  EXPECT_THAT(vn100_settings_problem({50, false, 12345}), HasSubstr("12345"));
}

}  // namespace
