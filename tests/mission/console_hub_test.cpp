// Several consoles at once: their links fail, flood and stall, and none holds up another.
#include "mission/console_hub.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <memory>

#include "sim/sim_clock.hpp"
#include "tests/mission/console_person.hpp"
#include "tests/mission/console_talk.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace console_test;
using testing::HasSubstr;
using testing::Not;

struct Hub : testing::Test {
  boost::asio::io_context io{1};
  sim::SimClock clock{io};
  test::TempFolder folder;
  FakeRobot robot;
  hal::ComputeHere compute;
  std::uint32_t sessions = 0;
  std::unique_ptr<mission::ConsoleHub> hub = make();

  std::filesystem::path password() const { return folder.path() / "password"; }
  std::unique_ptr<mission::ConsoleHub> make() {
    return std::make_unique<mission::ConsoleHub>(
        mission::ConsoleHub::Config{.password = password(),
                                    .first_number = [this] { return 1000 * ++sessions; }},
        clock, robot, compute);
  }
  std::unique_ptr<Person> sit_down(mission::ConsoleHub::Who who = kAtTheLine, bool reads = true) {
    auto person = std::make_unique<Person>(io.get_executor(), clock, *hub, who, reads);
    wait(100ms);
    return person;
  }
  void wait(hal::Duration span) { clock.run_until(clock.now() + span); }
  std::string ask(Person& person, std::string_view text) {
    (void)person.shown();
    person.type(text);
    wait(300ms);
    return person.shown();
  }
  void set_password(Person& person) {
    EXPECT_THAT(ask(person, "set-password\rcorrect horse\rcorrect horse\r"),
                HasSubstr("the password is set"));
    EXPECT_THAT(ask(person, "login\rcorrect horse\r"), HasSubstr("logged in"));
  }
};

TEST_F(Hub, KeepsThePasswordAsAHashForItsOwnerOnly) {
  const auto person = sit_down();
  set_password(*person);
  struct stat status {};
  ASSERT_EQ(stat(password().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  mission::PasswordFile kept(password());
  EXPECT_TRUE(kept.exists());
  EXPECT_EQ(kept.problem(), "");
  EXPECT_TRUE(kept.is("correct horse"));
  EXPECT_FALSE(kept.is("correct horse "));
  EXPECT_FALSE(kept.is(""));
}

TEST_F(Hub, LetsNobodyInByAFileThatHoldsNoHash) {
  std::ofstream(password()) << "secret\n";
  hub = make();
  const auto person = sit_down();
  EXPECT_THAT(ask(*person, "log\r"), HasSubstr("holds no argon2id hash"));
  EXPECT_THAT(ask(*person, "login\rsecret\r"), HasSubstr("wrong password"));
  EXPECT_THAT(ask(*person, "set-password\r"), HasSubstr("needs a login"))
      << "a damaged file is no way in";
  EXPECT_THAT(hub->log(1).back(), HasSubstr("somebody gave a wrong password"));
}

TEST_F(Hub, SaysWhenThePasswordCannotBeKept) {
  std::filesystem::remove_all(folder.path());
  const auto person = sit_down();
  EXPECT_THAT(ask(*person, "set-password\rcorrect horse\rcorrect horse\r"),
              HasSubstr("cannot write"));
  EXPECT_THAT(ask(*person, "login\r"), HasSubstr("no password was set yet"));
}

TEST_F(Hub, ServesTwoConsolesEachWithItsOwnLogin) {
  const auto one = sit_down(), two = sit_down();
  EXPECT_EQ(hub->sessions(), 2U);
  set_password(*one);
  EXPECT_THAT(ask(*two, "home\r"), HasSubstr("needs a login"));
  ask(*one, "home\r");
  EXPECT_EQ(robot.ordered(), "home\n");
  hub->tell("the robot is stopped");
  wait(100ms);
  for (const auto* person : {one.get(), two.get()})
    EXPECT_TRUE(person->sees("* the robot is stopped"));
  EXPECT_THAT(ask(*two, "log 1\r"), HasSubstr("s  the robot is stopped"));
  ask(*two, "login\rcorrect horse\r");
  EXPECT_THAT(ask(*one, "set-password\ranother one\ranother one\r"), HasSubstr("is set"));
  EXPECT_THAT(ask(*two, "home\r"), HasSubstr("needs a login")) << "by the old password";
  EXPECT_THAT(ask(*two, "login\rcorrect horse\r"), HasSubstr("wrong password"));
}

TEST_F(Hub, OnlyOneOfTwoSetsTheFirstPassword) {
  const auto one = sit_down(), two = sit_down();
  ask(*one, "set-password\rmine is long\r");
  ask(*two, "set-password\ryours as well\ryours as well\r");
  EXPECT_THAT(ask(*one, "mine is long\r"), HasSubstr("somebody else has set one meanwhile"));
  EXPECT_TRUE(mission::PasswordFile(password()).is("yours as well"));
  for (auto* const person : {one.get(), two.get()}) ask(*person, "login\ryours as well\r");
  ask(*one, "set-password\rmine is long\r");
  ask(*two, "set-password\rours is longer\rours is longer\r");
  EXPECT_THAT(ask(*one, "mine is long\r"), HasSubstr("no command")) << "logged out meanwhile";
  EXPECT_TRUE(mission::PasswordFile(password()).is("ours is longer"));
}

TEST_F(Hub, AnswersTwoWhoSetTheFirstPasswordAtOnce) {
  const auto one = sit_down(), two = sit_down();
  for (auto* const person : {one.get(), two.get()})
    person->type("set-password\rmine is long\rmine is long\r");
  wait(1s);
  EXPECT_NE(one->sees("the password is set"), two->sees("the password is set"));
}

// Whoever was cut off in the middle of a line did not mean what comes later.
TEST_F(Hub, BeginsAnewWhenTheLineWasLost) {
  const auto person = sit_down();
  set_password(*person);
  person->type("ho");
  wait(100ms);
  person->wire().cut();
  wait(1s);
  person->wire().mend();
  wait(1s);
  EXPECT_THAT(ask(*person, "me\r"), HasSubstr("no command 'me'"));
  EXPECT_THAT(ask(*person, "home\r"), HasSubstr("needs a login"));
  EXPECT_EQ(robot.ordered(), "");
}

TEST_F(Hub, StopsWhoeverDroveWhenTheLineWasLost) {
  robot.now.released = true;
  const auto person = sit_down();
  set_password(*person);
  ask(*person, "teleop\rwww");
  EXPECT_THAT(robot.ordered(), HasSubstr("drive 0.3 0\n"));
  person->wire().cut();
  wait(300ms);
  EXPECT_EQ(robot.ordered(), "drive stand\n");
  person->wire().mend();
  wait(1s);
  ask(*person, "www\r");
  EXPECT_EQ(robot.ordered(), "");
}

TEST_F(Hub, OfAKeyCutInItsMiddleMovesNothing) {
  robot.now.released = true;
  const auto person = sit_down();
  set_password(*person);
  ask(*person, "teleop numbered\r");
  robot.ordered();
  ask(*person, "w1001.w10");
  EXPECT_EQ(robot.ordered(), "drive 0.3 0\n");
  person->wire().cut();
  wait(300ms);
  person->wire().mend();
  wait(1s);
  ask(*person, "02.w1002.");
  EXPECT_THAT(robot.ordered(), Not(HasSubstr("drive 0.3")));
}

TEST_F(Hub, LosesOutputOfWhoReadsTooSlowlyAndHoldsUpNobody) {
  const auto deaf = sit_down(kAtTheLine, false);
  const auto other = sit_down();
  for (int i = 0; i < 5000; ++i) hub->tell("event " + std::to_string(i) + std::string(60, '.'));
  deaf->type("status\r");
  deaf->type("stop\r");
  wait(1s);
  EXPECT_EQ(robot.ordered(), "stop\n") << "it is heard all the same";
  wait(30s);
  (void)other->shown();
  EXPECT_THAT(ask(*other, "log 1\r"), HasSubstr("event 4999"));
  EXPECT_LE(hub->log(1000).size(), mission::ConsoleHub::kLogMax);
}

TEST_F(Hub, IsNotTakenByAFlood) {
  const auto flood = sit_down(), calm = sit_down();
  std::string noise;
  for (std::uint32_t i = 0; i < 60'000; ++i) {
    const std::uint32_t mixed = i * 2654435761U;
    noise += static_cast<char>(mixed >> 24);
    if (i % 50 == 0) noise += "home\r";
  }
  flood->type(noise);
  wait(2s);
  EXPECT_THAT(ask(*calm, "stop\r"), HasSubstr("vantage>"));
  EXPECT_THAT(robot.ordered(), HasSubstr("stop\n"));
  wait(60s);
  EXPECT_THAT(robot.ordered(), Not(HasSubstr("home")));
  EXPECT_THAT(ask(*flood, "\rwhy\r"), HasSubstr("nobody has armed it"));
}

TEST_F(Hub, EndsAConnectionByQuit) {
  const mission::ConsoleHub::Who visitor{mission::ConsoleHub::Link::connection, false};
  const auto person = sit_down(visitor);
  EXPECT_THAT(ask(*person, "set-password\r"), HasSubstr("is set at the serial line, or as root"));
  EXPECT_THAT(ask(*person, "quit\r"), HasSubstr("bye"));
  EXPECT_EQ(hub->sessions(), 0U);
}

TEST_F(Hub, GivesALineANewSessionAfterQuit) {
  const auto person = sit_down();
  set_password(*person);
  EXPECT_THAT(ask(*person, "quit\r"), HasSubstr("bye"));
  wait(1s);
  EXPECT_THAT(ask(*person, "home\r"), HasSubstr("needs a login"));
}

}  // namespace
