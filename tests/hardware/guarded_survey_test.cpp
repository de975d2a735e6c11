// A mission whose devices can be lost: the shipped drivers on simulated units, in virtual time and
// in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>
#include <sstream>

#include "drivers/real_clock.hpp"
#include "mission/main_hardware.hpp"
#include "mission/main_worker.hpp"
#include "sim/sim_clock.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace std::chrono_literals;
using mission::GuardedSurvey;
using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;

mission::Prepared prepared_yard() {
  return mission::prepare(VANTAGE_SOURCE_DIR "/tests/yard/mission.toml",
                          {.site_folder = {}, .robot_file = {}, .has_seed = false, .seed = 0},
                          mission::WorldUse::world);
}

// The robot in its yard, with its units on links in memory.
class Yard {
 public:
  Yard(boost::asio::io_context& io, hal::Clock& clock, hal::Compute& compute,
       GuardedSurvey::Config config = {})
      : io_(io),
        prepared_(prepared_yard()),
        world_(prepared_.config, prepared_.tasks, std::move(prepared_.sim), 1),
        robot_(prepared_.config.robot, mission::kSimAnchor, 1, 1, world_.world(), clock),
        survey_(prepared_, 1, std::move(config),
                {io.get_executor(), clock, robot_.drivers(), store_, progress_, compute}) {}

  void start() {
    boost::asio::co_spawn(io_, robot_.units().run(), [](std::exception_ptr error) {
      if (error) std::rethrow_exception(error);
    });
    survey_.start();
  }
  GuardedSurvey& survey() { return survey_; }
  sim::UnitFaults& faults(const char* role) { return *robot_.units().faults(role); }
  sim::AgilexUnit& base() { return *robot_.units().agilex(); }
  Eigen::Vector2d where_m() { return world_.world().robot().pose.position_m; }
  double driven_m() { return world_.world().driven_m(); }
  std::string notes() {
    std::string all;
    for (const std::string& note : survey_.watch().notes()) all += note + "\n";
    return all;
  }

 private:
  boost::asio::io_context& io_;
  test::TempFolder folder_;
  mission::RunStore store_ = mission::RunStore::open(folder_.path() / "run").value();
  std::ostringstream told_;
  mission::ProgressPrinter progress_{told_, false};
  mission::Prepared prepared_;
  mission::SimWorld world_;
  mission::SimulatedRobot robot_;
  GuardedSurvey survey_;
};

// In virtual time.
struct SimYard {
  explicit SimYard(GuardedSurvey::Config config = {}) : yard(io, clock, compute, config) {
    yard.start();
  }
  bool run_until_it_drives(double driven_m) {
    return clock.run([&] { return yard.driven_m() > driven_m; });
  }
  bool run_to_the_end() {
    const hal::Time late = clock.now() + 1h;
    return clock.run([&] { return yard.survey().ended() || clock.now() > late; }) &&
           yard.survey().ended();
  }

  boost::asio::io_context io{1};
  sim::SimClock clock{io};
  hal::ComputeHere compute;
  Yard yard;
};

TEST(GuardedSurvey, SurveysToTheEnd) {
  SimYard sim;
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_EQ(sim.yard.survey().failure(), "");
  const mission::RunRecord& record = sim.yard.survey().survey().record();
  EXPECT_TRUE(record.completed);
  EXPECT_EQ(record.scans.size(), 2U);
  EXPECT_EQ(sim.yard.notes(), "");
}

// A unit is switched off on the way to the second scan.
class Losing : public testing::TestWithParam<const char*> {};

TEST_P(Losing, StopsTheRobotUntilItIsBack) {
  SimYard sim;
  ASSERT_TRUE(sim.run_until_it_drives(1));
  sim.yard.faults(GetParam()).set({sim::UnitFault::off, 0});
  const hal::Time late = sim.clock.now() + 30s;
  ASSERT_TRUE(
      sim.clock.run([&] { return !sim.yard.survey().watch().well() || sim.clock.now() > late; }));
  ASSERT_LT(sim.clock.now(), late) << "not missed";
  sim.clock.run_until(sim.clock.now() + 1s);
  const double stopped_m = sim.yard.driven_m();
  sim.clock.run_until(sim.clock.now() + 10s);
  EXPECT_NEAR(sim.yard.driven_m(), stopped_m, 0.01) << "it drives without " << GetParam();
  EXPECT_THAT(sim.yard.notes(), HasSubstr(std::string("misses ") + GetParam()));
  EXPECT_THAT(sim.yard.notes(), HasSubstr("; do: "));

  sim.yard.faults(GetParam()).clear();
  if (GetParam() == std::string("drive")) {
    sim.clock.run_until(sim.clock.now() + 20s);
    EXPECT_NEAR(sim.yard.driven_m(), stopped_m, 0.01) << "nobody has released it";
    EXPECT_THAT(sim.yard.notes(), HasSubstr("F012-drive-silent"));
    sim.yard.survey().gate().ask_release();
  }
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_EQ(sim.yard.survey().failure(), "");
  EXPECT_TRUE(sim.yard.survey().survey().record().completed);
  EXPECT_THAT(sim.yard.notes(), HasSubstr("all devices are back"));
}

TEST_P(Losing, EndsTheMissionWithTheReasonWhenItStaysAway) {
  GuardedSurvey::Config config;
  config.watch.patience = 20s;
  SimYard sim(config);
  ASSERT_TRUE(sim.run_until_it_drives(1));
  sim.yard.faults(GetParam()).set({sim::UnitFault::off, 0});
  const hal::Time lost = sim.clock.now();
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_LT(sim.clock.now() - lost, 40s);
  const mission::RunRecord& record = sim.yard.survey().survey().record();
  EXPECT_FALSE(record.completed);
  EXPECT_EQ(record.scans.size(), 1U) << "what was scanned counts";
  for (const std::string& reason : {sim.yard.survey().failure(), record.end}) {
    EXPECT_THAT(reason, HasSubstr("waited 20 s in vain for ")) << record.end;
    EXPECT_THAT(reason, HasSubstr(GetParam()));
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, Losing,
                         testing::Values("drive", "imu", "gnss", "scanner", "pan"));

TEST(GuardedSurvey, WaitsForAPersonAfterAnEstopHoweverLongItIsPressed) {
  SimYard sim;
  ASSERT_TRUE(sim.run_until_it_drives(1));
  sim.yard.base().press_estop(true);
  sim.clock.run_until(sim.clock.now() + 5min);
  sim.yard.base().press_estop(false);
  const double stopped_m = sim.yard.driven_m();
  sim.clock.run_until(sim.clock.now() + 5min);
  EXPECT_NEAR(sim.yard.driven_m(), stopped_m, 0.01);
  EXPECT_FALSE(sim.yard.survey().ended());
  EXPECT_THAT(sim.yard.notes(), HasSubstr("to release it, press the reset button"));
  sim.yard.survey().gate().ask_release();
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_EQ(sim.yard.survey().failure(), "");
  EXPECT_THAT(sim.yard.notes(), HasSubstr("the robot was released after F001-estop-pressed"));
}

// The next start must not take its own for a release.
TEST(GuardedSurvey, TellsWhetherItWasLeftStopped) {
  for (const bool stopped : {false, true}) {
    SimYard sim;
    ASSERT_TRUE(sim.run_until_it_drives(1));
    if (stopped) sim.yard.base().press_estop(true);
    sim.clock.run_until(sim.clock.now() + 2s);
    if (stopped) sim.yard.base().press_estop(false);
    sim.clock.run_until(sim.clock.now() + 2s);
    sim.yard.survey().stop("SIGTERM");
    ASSERT_TRUE(sim.run_to_the_end());
    EXPECT_EQ(sim.yard.survey().left_held(), stopped);
  }
}

TEST(GuardedSurvey, IsStillLeftStoppedWhereItEndsBeforeItsDevicesAreThere) {
  for (const bool held : {false, true}) {
    GuardedSurvey::Config config;
    config.starts_held = held;
    SimYard sim(config);
    sim.clock.run_until(sim.clock.now() + 100ms);
    ASSERT_FALSE(sim.yard.survey().gate().begun());
    sim.yard.survey().stop("SIGTERM");
    ASSERT_TRUE(sim.run_to_the_end());
    EXPECT_EQ(sim.yard.survey().left_held(), held);
  }
}

TEST(GuardedSurvey, StandsWhileAMotorIsTooHotAndGoesOnWhenItHasCooled) {
  SimYard sim;
  ASSERT_TRUE(sim.run_until_it_drives(1));
  sim.yard.base().set_fault_bits(0, 0x02);
  sim.clock.run_until(sim.clock.now() + 3s);
  const double stopped_m = sim.yard.driven_m();
  sim.clock.run_until(sim.clock.now() + 3min);
  EXPECT_NEAR(sim.yard.driven_m(), stopped_m, 0.01);
  EXPECT_THAT(sim.yard.notes(), HasSubstr("the robot holds: F020-drive-hot"));
  sim.yard.base().set_fault_bits(0, 0);
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_EQ(sim.yard.survey().failure(), "");
  EXPECT_TRUE(sim.yard.survey().survey().record().completed);
}

TEST(GuardedSurvey, TakesAScanAgainThatLostItsScanner) {
  SimYard sim;
  const auto scans = [&] { return sim.yard.survey().survey().record().scans.size(); };
  ASSERT_TRUE(sim.run_until_it_drives(0.2));
  sim.clock.run_until(sim.clock.now() + 8s);
  ASSERT_EQ(scans(), 0U);
  sim.yard.faults("scanner").set({sim::UnitFault::off, 0});
  sim.clock.run_until(sim.clock.now() + 5s);
  sim.yard.faults("scanner").clear();
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_EQ(sim.yard.survey().failure(), "") << sim.yard.notes();
  EXPECT_EQ(scans(), 2U);
  EXPECT_THAT(sim.yard.notes(), HasSubstr("scan failed: "));
}

// Three tries at a stop: no more, whoever else would try again. The yard has one station.
TEST(GuardedSurvey, TriesAScanThreeTimesAndDoesNotCallNoScanASurvey) {
  SimYard sim;
  ASSERT_TRUE(sim.run_until_it_drives(0.2));
  sim.yard.faults("pan").set({sim::UnitFault::wrong, 0.3});
  ASSERT_TRUE(sim.run_to_the_end());
  const std::string notes = sim.yard.notes();
  int failed = 0;
  for (auto at = notes.find("scan failed: "); at != std::string::npos;
       at = notes.find("scan failed: ", at + 1))
    ++failed;
  EXPECT_EQ(failed, 3) << notes;
  EXPECT_FALSE(sim.yard.survey().survey().record().completed);
  EXPECT_THAT(sim.yard.survey().failure(), HasSubstr("not one scan was taken"));
  EXPECT_THAT(sim.yard.survey().failure(), HasSubstr("no scan, tried 3 times"));
}

TEST(GuardedSurvey, StandsAtOnceWhenStopped) {
  SimYard sim;
  ASSERT_TRUE(sim.run_until_it_drives(1));
  sim.yard.survey().stop("stopped by a test");
  sim.yard.survey().stop("a second time");
  sim.clock.run_until(sim.clock.now() + 1s);
  const Eigen::Vector2d stopped = sim.yard.where_m();
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_LT((sim.yard.where_m() - stopped).norm(), 0.01);
  EXPECT_LT(hal::seconds(sim.clock.now().time_since_epoch()), 600);
  EXPECT_EQ(sim.yard.survey().failure(), "stopped by a test");
  EXPECT_EQ(sim.yard.survey().survey().record().end, "stopped by a test");
  EXPECT_FALSE(sim.yard.survey().survey().record().completed);
}

TEST(GuardedSurvey, SaysWhichDeviceDoesNotStart) {
  GuardedSurvey::Config config;
  config.start_patience = 10s;
  SimYard sim(config);
  sim.yard.faults("imu").set({sim::UnitFault::off, 0});
  ASSERT_TRUE(sim.run_to_the_end());
  EXPECT_THAT(sim.yard.survey().failure(), HasSubstr("not every device started: imu (vn100"));
  EXPECT_DOUBLE_EQ(sim.yard.driven_m(), 0);
  EXPECT_EQ(sim.yard.survey().survey().record().end, sim.yard.survey().failure());
}

// The same in real time, with planning on a thread.
TEST(GuardedSurvey, SurveysInRealTime) {
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  mission::Worker worker;
  Yard yard(io, clock, worker);
  yard.start();
  const hal::Time began = clock.now(), late = began + 5min;
  while (!yard.survey().ended() && clock.now() < late) io.run_one_for(100ms);
  ASSERT_TRUE(yard.survey().ended());
  EXPECT_EQ(yard.survey().failure(), "") << yard.notes();
  const mission::RunRecord& record = yard.survey().survey().record();
  EXPECT_TRUE(record.completed) << record.end;
  EXPECT_EQ(record.scans.size(), 2U);
  EXPECT_LT(record.mission_s, hal::seconds(clock.now() - began)) << "it counts from its own start";
}

}  // namespace
