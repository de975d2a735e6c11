// Missions in simulation that an operator at a console interferes with.
#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <memory>
#include <sstream>

#include "mission/main_console.hpp"
#include "mission/main_gate.hpp"
#include "tests/mission/console_person.hpp"
#include "tests/mission/console_talk.hpp"
#include "tests/mission/disk_trace.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

using namespace console_test;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A mission in its yard, and who sits at its console, logged in.
class Mission {
 public:
  // With what the mission's file says besides.
  explicit Mission(std::string_view more = {})
      : ready_(prepared_with(more)),
        backend_(ready_.config, ready_.tasks, std::move(ready_.sim), 1),
        store_(mission::RunStore::open(site_.out()).value()),
        survey_(ready_.config, ready_.site.map, ready_.tasks, 1,
                {backend_.clock(), backend_.devices(), store_, progress_, compute_}),
        robot_({backend_.gate(), survey_, backend_.drivers(), {}}),
        hub_({.password = site_.folder() / "password", .first_number = [] { return 1000; }},
             backend_.clock(), robot_, compute_),
        person_(std::make_unique<Person>(backend_.executor(), backend_.clock(), hub_, kAtTheLine)) {
    backend_.gate().watch_surroundings([this] { return survey_.surroundings(); });
    survey_.orders().tell_to([this](const std::string& what) { hub_.tell(what); });
    boost::asio::co_spawn(backend_.executor(), carry_out(), [this](std::exception_ptr error) {
      over_ = true;
      try {
        if (error) std::rethrow_exception(error);
      } catch (const std::exception& e) {
        failure_ = e.what();
      }
    });
    ask("set-password\rcorrect horse\rcorrect horse\r");
    EXPECT_THAT(ask("login\rcorrect horse\r"), HasSubstr("logged in"));
  }

  bool run_until(const std::function<bool()>& holds, hal::Duration patience = 1h) {
    const hal::Time late = now() + patience;
    return backend_.run([&] { return holds() || now() > late; }) && holds();
  }
  void wait(hal::Duration span) {
    const hal::Time until = now() + span;
    backend_.run([&] { return now() >= until; });
  }
  bool run_until_driven(double m) {
    return run_until([&, from_m = driven_m()] { return driven_m() - from_m > m; });
  }
  bool run_until_scanning() {
    return run_until([&] { return survey_.orders().is_scanning(); });
  }
  bool run_to_the_end() {
    return run_until([&] { return over_; }, 3h);
  }
  std::string ask(std::string_view text) {
    (void)person_->shown();
    person_->type(text);
    wait(300ms);
    return person_->shown();
  }
  bool run_until_shown(std::string_view text) {
    return run_until([&] { return person_->sees(text); }, 10min);
  }
  // Held down for so long.
  void hold(char key, hal::Duration span) {
    for (hal::Duration passed{}; passed < span; passed += 50ms) {
      person_->type(std::string(1, key));
      wait(50ms);
    }
  }

  hal::Time now() { return backend_.clock().now(); }
  double driven_m() { return backend_.world().driven_m(); }
  double speed_mps() { return std::abs(backend_.world().rolling().forward_mps); }
  hal::Pose2 where() { return backend_.world().robot().pose; }
  const mission::RunRecord& record() { return survey_.record(); }
  mission::SimBackend& backend() { return backend_; }
  Person& person() { return *person_; }
  const std::string& failure() const { return failure_; }
  std::string decisions() { return read(site_.out() / "decisions.jsonl"); }
  hal::Pose2 station(std::size_t of_tour) {
    const mission::AreaPlan& plan = record().plans.at(0);
    return mission::pose_of(
        plan.cover.stations.at(static_cast<std::size_t>(plan.tour.at(of_tour))).at);
  }
  std::size_t stations() { return record().plans.at(0).tour.size(); }
  const hal::Pose2& start() const { return ready_.tasks.start; }

 private:
  mission::Prepared prepared_with(std::string_view more) {
    std::ofstream(site_.folder() / "mission.toml", std::ios::app) << more;
    return site_.prepared();
  }
  hal::Task<void> carry_out() {
    (void)co_await backend_.drivers().started(60s);
    co_await mission::arm(backend_.gate());
    co_await survey_.run();
  }

  mission_test::SmallSite site_;
  mission::Prepared ready_;
  mission::SimBackend backend_;
  mission::RunStore store_;
  std::ostringstream told_;
  mission::ProgressPrinter progress_{told_, false};
  hal::ComputeHere compute_;
  mission::Survey survey_;
  mission::RobotConsole robot_;
  mission::ConsoleHub hub_;
  std::unique_ptr<Person> person_;
  bool over_ = false;
  std::string failure_;
};

TEST(ConsoleMission, WaitsWhenPausedAndGoesOn) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  EXPECT_THAT(mission.ask("status\r"),
              AllOf(HasSubstr("mode     autonomous, armed"), HasSubstr("mission  Phase I"),
                    HasSubstr("pose     (")));
  EXPECT_THAT(mission.ask("pause\r"), HasSubstr("the mission waits"));
  mission.wait(2s);
  const double stopped_m = mission.driven_m();
  mission.wait(5min);
  EXPECT_NEAR(mission.driven_m(), stopped_m, 0.01);
  EXPECT_THAT(mission.ask("why\r"), HasSubstr("the mission waits for the operator's `resume`"));
  EXPECT_THAT(mission.ask("resume\r"), HasSubstr("the mission goes on"));
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
  EXPECT_EQ(mission.record().scans.size(), mission.stations());
  EXPECT_THAT(mission.decisions(), AllOf(HasSubstr(R"("decision":"order","order":"pause")"),
                                         HasSubstr(R"("order":"resume")")));
}

TEST(ConsoleMission, FinishesItsScanBeforeItWaits) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_scanning());
  EXPECT_THAT(mission.ask("pause\r"), HasSubstr("waits when this scan is finished"));
  mission.wait(3min);
  EXPECT_EQ(mission.record().scans.size(), 1U);
  const double stopped_m = mission.driven_m();
  mission.wait(1min);
  EXPECT_NEAR(mission.driven_m(), stopped_m, 0.01);
  mission.ask("resume\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_EQ(mission.record().scans.size(), mission.stations());
}

TEST(ConsoleMission, LetsTheOperatorDriveAndGoesOnFromThere) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  EXPECT_THAT(mission.ask("teleop\r"), AllOf(HasSubstr("the mission waits"), HasSubstr("hold w")));
  mission.wait(3s);
  EXPECT_LT(mission.speed_mps(), 0.01) << "nobody drives yet";
  const double before_m = mission.driven_m();
  mission.hold('x', 5s);
  EXPECT_GT(mission.driven_m() - before_m, 0.5);
  mission.wait(2s);
  EXPECT_LT(mission.speed_mps(), 0.01);
  EXPECT_THAT(mission.ask("q"), HasSubstr("`resume` hands the robot back"));
  mission.wait(1min);
  EXPECT_LT(mission.speed_mps(), 0.01) << "it goes on by itself";
  mission.ask("resume\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
  EXPECT_EQ(mission.record().scans.size(), mission.stations());
  EXPECT_TRUE(mission.record().dropped.empty());
  EXPECT_THAT(mission.decisions(),
              AllOf(HasSubstr(R"("order":"take over")"), HasSubstr(R"("decision":"retour")")));
}

// What the mission wants counts for nothing from the first key on.
TEST(ConsoleMission, IsTakenOverWithinOneCycleOfTheGate) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  mission::GatedDrive& gate = mission.backend().gate();
  ASSERT_EQ(gate.mode(), mission::Mode::autonomous);
  mission::OperatorPacket back{.sequence = 1, .dead_man = true, .twist = {-0.2, 0}};
  gate.hear(back);
  const hal::Time heard = mission.now();
  ASSERT_TRUE(mission.run_until([&] { return gate.mode() == mission::Mode::teleop; }, 1s));
  EXPECT_LE(mission.now() - heard, mission::kGatePeriod);
  mission.wait(150ms);
  const double driven_m = mission.driven_m();
  gate.hear(back);  // Repeated: nothing.
  mission.wait(60ms);
  EXPECT_NE(gate.mode(), mission::Mode::teleop) << "200 ms after the last that counted";
  EXPECT_GE(mission.driven_m(), driven_m);
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
}

TEST(ConsoleMission, StopsTheRobot200msAfterTheLastKey) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  mission.ask("teleop\r");
  mission.wait(3s);
  mission.hold('w', 2s);
  const hal::Time last = mission.now();
  ASSERT_GT(mission.speed_mps(), 0.1);
  ASSERT_TRUE(mission.run_until([&] { return mission.speed_mps() < 0.01; }, 5s));
  EXPECT_LE(mission.now() - last, 900ms) << "200 ms, and how long the base takes to brake";
  mission.hold('w', 1s);
  ASSERT_GT(mission.speed_mps(), 0.1);
  mission.person().wire().cut();
  ASSERT_TRUE(mission.run_until([&] { return mission.speed_mps() < 0.01; }, 5s));
  mission.person().wire().mend();
  mission.wait(1s);
  mission.ask("login\rcorrect horse\r");
  mission.ask("resume\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
}

TEST(ConsoleMission, LeavesOutAStation) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  mission.ask("skip\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed);
  ASSERT_EQ(mission.record().dropped.size(), 1U);
  EXPECT_EQ(mission.record().dropped[0].reason, "left out by the operator");
  EXPECT_EQ(mission.record().scans.size(), mission.stations() - 1);
}

TEST(ConsoleMission, LeavesOutAStationWhoseScanHasBegun) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_scanning());
  mission.wait(8s);
  mission.ask("skip\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
  EXPECT_EQ(mission.record().dropped.size(), 1U);
  EXPECT_EQ(mission.record().scans.size(), mission.stations() - 1)
      << "the scanner is of no use after a scan that was broken off";
}

TEST(ConsoleMission, GoesHome) {
  Mission mission;
  ASSERT_TRUE(mission.run_until([&] { return mission.record().scans.size() == 1; }));
  ASSERT_TRUE(mission.run_until_driven(2));
  EXPECT_THAT(mission.ask("home\r"), HasSubstr("the robot drives home"));
  EXPECT_THAT(mission.ask("home\r"), HasSubstr("on its way home"));
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_EQ(mission.record().end, "sent home by the operator");
  EXPECT_FALSE(mission.record().completed);
  EXPECT_EQ(mission.record().scans.size(), 1U);
  EXPECT_LT((mission.where().position_m - mission.start().position_m).norm(), 0.5);
}

TEST(ConsoleMission, ThatIsOnItsWayHomeNeedsNobodyToSendIt) {
  Mission mission;
  ASSERT_TRUE(mission.run_until([&] { return !mission.record().end.empty(); }));
  const std::string end = mission.record().end;
  EXPECT_THAT(mission.ask("home\r"), HasSubstr("on its way home"));
  EXPECT_THAT(mission.ask("status\r"), HasSubstr("on its way home"));
  mission.ask("pause\r");
  EXPECT_THAT(mission.ask("status\r"), HasSubstr("waits for the operator"));
  mission.ask("resume\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_EQ(mission.record().end, end);
  EXPECT_TRUE(mission.record().completed) << mission.failure();
  EXPECT_LT((mission.where().position_m - mission.start().position_m).norm(), 0.5);
}

TEST(ConsoleMission, SaysWhyTheRobotGoesHomeWithoutItsDisk) {
  bool disk_fails = false;
  int failed = 0;
  mission_test::DiskTrace disk([&](mission_test::DiskOp::Kind kind) {
    using enum mission_test::DiskOp::Kind;
    if (!disk_fails || (kind != write && kind != sync)) return 0;
    ++failed;
    return ENOSPC;
  });
  disk.record = false;
  Mission mission("[disk]\npatience_s = 20\nthen = \"home\"\n");
  ASSERT_TRUE(mission.run_until([&] { return mission.record().scans.size() == 1; }));
  ASSERT_TRUE(mission.run_until_driven(2));
  EXPECT_THAT(mission.ask("faults\r"), Not(HasSubstr("F70")));

  disk_fails = true;
  ASSERT_TRUE(mission.run_until([&] { return failed > 0; }));
  mission.wait(15s);
  EXPECT_THAT(mission.ask("faults\r"),
              AllOf(HasSubstr("F700-disk-full hold: cannot "), Not(HasSubstr("F704"))));
  mission.wait(15s);
  ASSERT_GT(mission.speed_mps(), 0) << "it waits no longer";
  EXPECT_THAT(mission.ask("faults\r"),
              AllOf(HasSubstr("F704-disk-given-up home: "), HasSubstr("F700-disk-full hold: ")));
  EXPECT_THAT(mission.ask("status\r"), AllOf(HasSubstr("sent home by its disk"), HasSubstr("F70")));
  disk_fails = false;  // That sends it nowhere else.
  mission.wait(3s);
  EXPECT_THAT(mission.ask("faults\r"),
              AllOf(HasSubstr("F704-disk-given-up"), Not(HasSubstr("F700"))));
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_THAT(mission.record().end, testing::StartsWith("F704-disk-given-up"));
  EXPECT_LT((mission.where().position_m - mission.start().position_m).norm(), 0.5);
}

TEST(ConsoleMission, RunsErrandsAndGoesOn) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(1));
  const hal::Pose2 last = mission.station(mission.stations() - 1);
  mission.ask(fmt::format("goto {:.2f} {:.2f}\r", last.position_m.x(), last.position_m.y()));
  ASSERT_TRUE(mission.run_until_shown("* goto: there"));
  EXPECT_LT((mission.where().position_m - last.position_m).norm(), 0.5);
  EXPECT_THAT(mission.ask("scan\r"), HasSubstr("it scans"));
  EXPECT_THAT(mission.ask("scan\r"), HasSubstr("a scan is being taken"));
  ASSERT_TRUE(mission.run_until_shown("* ordered 1: scan 1 is taken"));
  mission.ask("login\rcorrect horse\r");
  mission.person().type("goto 3 3\r");
  ASSERT_TRUE(mission.run_until_shown("* goto: the goal")) << "there is a house";
  mission.ask("resume\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
  EXPECT_EQ(mission.record().scans.size(), mission.stations() + 1);
  EXPECT_THAT(mission.decisions(), HasSubstr(R"("order":"goto","goal":)"));
}

TEST(ConsoleMission, StandsWhenStoppedUntilItIsArmed) {
  Mission mission;
  ASSERT_TRUE(mission.run_until_driven(2));
  mission.ask("logout\r");
  EXPECT_THAT(mission.ask("stop\r"), HasSubstr("the robot stands until `arm`"));
  mission.wait(1s);
  const double stopped_m = mission.driven_m();
  mission.wait(1min);
  EXPECT_NEAR(mission.driven_m(), stopped_m, 0.01);
  EXPECT_THAT(mission.ask("why\r"), HasSubstr("a person stopped it"));
  EXPECT_THAT(mission.ask("arm\r"), HasSubstr("needs a login"));
  mission.ask("login\rcorrect horse\r");
  mission.ask("teleop\r");
  mission.hold('w', 1s);
  EXPECT_NEAR(mission.driven_m(), stopped_m, 0.01) << "keys are no release";
  mission.ask(
      "\x15"
      "arm\r");
  ASSERT_TRUE(mission.run_to_the_end());
  EXPECT_TRUE(mission.record().completed) << mission.failure();
}

TEST(ConsoleMission, WritesTheSameDecisionsTwice) {
  const auto run = [] {
    Mission mission;
    EXPECT_TRUE(mission.run_until_driven(2));
    mission.ask("teleop\r");
    mission.hold('x', 2s);
    mission.ask("q");
    mission.ask("resume\r");
    EXPECT_TRUE(mission.run_until_driven(2));
    mission.ask("skip\r");
    EXPECT_TRUE(mission.run_to_the_end());
    return mission.decisions();
  };
  const std::string once = run();
  EXPECT_THAT(once, HasSubstr("take over"));
  EXPECT_EQ(once, run());
}

}  // namespace
