// What an operator sees and orders at a console, as transcripts.
#include "mission/console.hpp"

#include <gmock/gmock.h>

#include "mission/console_keys.hpp"
#include "mission/console_text.hpp"
#include "tests/mission/console_talk.hpp"

namespace {

using namespace console_test;
using mission::FaultCode;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(Console, ShowsInOneLookWhatIs) {
  Talk talk;
  talk.robot.now.mission = "Phase I  3/26 inner  12:40";
  talk.robot.now.pose = hal::Pose2{{1.5, -2.25}, 1.5707963};
  talk.robot.now.sigma_m = 0.034;
  EXPECT_EQ(talk.session.greeting(),
            "\r\nVantage. `help` lists the commands; `stop` always stops the robot.\r\nvantage> ");
  EXPECT_EQ(talk.type("status\r"), R"(status
mode     autonomous, armed
mission  Phase I  3/26 inner  12:40
orders   none
pose     (1.50, -2.25) m, heading 90 deg, within 0.03 m (1 sigma)
faults   none
session  not logged in
vantage> )");
  talk.robot.now.mode = mission::Mode::stopped;
  talk.robot.now.released = false;
  talk.robot.now.pose.reset();
  talk.robot.now.mission.clear();
  talk.robot.now.why = "F001-estop-pressed: somebody pressed it; do: look";
  talk.robot.now.orders = "the mission waits";
  talk.robot.now.faults = {{FaultCode::estop_pressed, ""}, {FaultCode::gnss_silent, "gnss: off"}};
  EXPECT_EQ(talk.type("status\r"), R"(status
mode     stopped, not armed
mission  none
orders   the mission waits
pose     not known
faults   2, the gravest is F001-estop-pressed; `faults` lists them
session  not logged in
stands   `why` tells the reason
vantage> )");
}

TEST(Console, SaysWhyAndWhatIsWrong) {
  Talk talk;
  EXPECT_EQ(talk.type("why\rfaults\r"), "why\nnothing is wrong\nvantage> faults\nnone\nvantage> ");
  talk.robot.now.faults = {{FaultCode::drive_silent, "drive: no reports"},
                           {FaultCode::gnss_silent, ""}};
  EXPECT_EQ(talk.type("faults\r"), R"(faults
F012-drive-silent stop: drive: no reports
F310-gnss-silent note: no power, a loose cable, or a wrong port
`explain ID` tells cause and remedy
vantage> )");
  EXPECT_THAT(talk.type("why\r"), HasSubstr("nothing holds it; `faults` lists what is"));
  talk.robot.now.released = false;
  EXPECT_THAT(talk.type("why\r"), HasSubstr("nobody has armed it: `arm`"));
  talk.robot.now.why = "F012-drive-silent: no power; do: look";
  EXPECT_THAT(talk.type("why\r"), HasSubstr("F012-drive-silent: no power; do: look"));
}

TEST(Console, KeepsListsToOneScreen) {
  Talk talk;
  for (int i = 0; i < 60; ++i)
    talk.robot.now.faults.push_back({FaultCode::gnss_silent, std::string(200, 'x')});
  for (int i = 0; i < 60; ++i) talk.robot.happened.push_back(std::string(200, 'y'));
  for (const char* command : {"faults\r", "log 20\r", "help\r", "help teleop\r", "history\r"}) {
    const std::string shown = talk.type(command);
    EXPECT_LE(std::ranges::count(shown, '\n'), 24) << shown;
    std::istringstream lines(shown);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 79U) << line;
  }
  EXPECT_THAT(talk.type("faults\r"), HasSubstr("and 40 more"));
}

TEST(Console, ExplainsFaults) {
  Talk talk;
  EXPECT_THAT(talk.type("explain f012\r"), HasSubstr("F012-drive-silent: stop\n  cause   "));
  EXPECT_THAT(talk.type("explain drive-silnt\r"), HasSubstr("did you mean 'drive-silent'?"));
  EXPECT_THAT(talk.type("explain\r"), HasSubstr("explain which?"));
}

TEST(Console, ShowsTheLog) {
  Talk talk;
  EXPECT_THAT(talk.type("log\r"), HasSubstr("nothing happened yet"));
  for (int i = 1; i <= 15; ++i) talk.robot.happened.push_back("event " + std::to_string(i));
  EXPECT_EQ(talk.type("log 2\r"), "log 2\nevent 14\nevent 15\nvantage> ");
  EXPECT_THAT(talk.type("log\r"), StartsWith("log\nevent 6\n"));
  for (const char* bad : {"log 0\r", "log 21\r", "log x\r", "log 1e99\r"})
    EXPECT_THAT(talk.type(bad), HasSubstr("log takes a number from 1 to 20")) << bad;
}

TEST(Console, HelpsWithEveryCommand) {
  Talk talk;
  const std::string all = talk.type("help\r");
  EXPECT_THAT(all, HasSubstr("goto X Y [HEADING]    drive there by the roads, and wait (login)"));
  EXPECT_EQ(talk.type("?\r").substr(2), all.substr(5));
  for (const char* name :
       {"status", "why",          "faults", "explain", "log",    "stop",   "disarm", "arm",
        "teleop", "goto",         "scan",   "pause",   "resume", "skip",   "home",   "login",
        "logout", "set-password", "help",   "history", "quit",   "restart"}) {
    EXPECT_THAT(all, HasSubstr("\n" + std::string(name) + " ")) << name;
    EXPECT_THAT(talk.type("help " + std::string(name) + "\r"), Not(HasSubstr("no command")))
        << name;
  }
  EXPECT_THAT(talk.type("help nothing\r"), HasSubstr("no command 'nothing'"));
}

TEST(Console, AsksWhetherAnotherCommandWasMeant) {
  Talk talk;
  EXPECT_EQ(talk.type("stauts\r"),
            "stauts\nno command 'stauts'; did you mean 'status'?; `help` lists them\nvantage> ");
  EXPECT_THAT(talk.type("status now\r"), HasSubstr("too many words: status"));
  EXPECT_EQ(talk.type("\r"), "\nvantage> ");
}

TEST(Console, EditsAndRepeatsLines) {
  Talk talk;
  EXPECT_EQ(talk.type("whx\x7Fy\r"), "whx\b \by\nnothing is wrong\nvantage> ");
  EXPECT_THAT(talk.type("\b\b"), "") << "nothing to rub out";
  EXPECT_THAT(talk.type("nonsense\x15why\r"), HasSubstr("nothing is wrong"));
  EXPECT_THAT(talk.type("!!\r"), HasSubstr("nothing is wrong"));
  EXPECT_EQ(talk.type("history\r"), "history\nwhy\nhistory\nvantage> ");
  EXPECT_EQ(talk.type("\x1B[A\x1B[A\r"),
            "history\b \b\b \b\b \b\b \b\b \b\b \b\b \bwhy\n"
            "nothing is wrong\nvantage> ");
  EXPECT_EQ(talk.type("\x1B[A\x1B[Bstop\r"), "why\b \b\b \b\b \bstop\nvantage> ");
  EXPECT_EQ(talk.type("wh\ny\r\n\n"),
            "wh\nno command 'wh'; did you mean 'why'?; `help` lists "
            "them\nvantage> y\nno command 'y'; `help` lists them\n"
            "vantage> \nvantage> ");
}

TEST(Console, DoesNothingForALineThatIsTooLongOrDamaged) {
  Talk talk;
  talk.log_in();
  EXPECT_THAT(talk.type("home " + std::string(200, 'x') + "\r"),
              HasSubstr("line too long: at most 160 characters; nothing was done"));
  EXPECT_THAT(talk.type("ho\xFEme\r"), HasSubstr("line damaged"));
  EXPECT_THAT(talk.type("ho\x01me\r"), HasSubstr("nothing was done"));
  EXPECT_EQ(talk.robot.ordered(), "");
  talk.type("\xFF\x80stop\r");
  EXPECT_EQ(talk.robot.ordered(), "stop\n") << "noise must not keep it from stopping";
  talk.type("home\r");
  EXPECT_EQ(talk.robot.ordered(), "home\n") << "the next line is a new one";
}

// --- Logins.

TEST(Console, OrdersMotionOnlyAfterALogin) {
  Talk talk;
  for (const char* moves : {"arm", "teleop", "goto 1 2", "scan", "resume", "resume from-start",
                            "skip", "home", "restart"}) {
    EXPECT_THAT(talk.type(std::string(moves) + "\r"), HasSubstr("needs a login: `login`")) << moves;
    EXPECT_EQ(talk.robot.ordered(), "") << moves;
  }
  for (const char* stands : {"stop", "disarm", "pause", "stop now, please"})
    talk.type(std::string(stands) + "\r");
  EXPECT_EQ(talk.robot.ordered(), "stop\nstop\npause\nstop\n");
}

TEST(Console, LogsInByAPasswordThatIsNeverShown) {
  Talk talk;
  EXPECT_EQ(talk.type("login\r"), "login\npassword: ");
  EXPECT_EQ(talk.type("sec\bcret\r"), "\nvantage> ");
  EXPECT_EQ(talk.robot.ordered(), "check password 'secret'\n");
  EXPECT_THAT(talk.type("login\r"), HasSubstr("a password is being checked"));
  EXPECT_EQ(talk.type("stop\r"), "stop\nvantage> ") << "not while it is checked?";
  EXPECT_EQ(talk.plain(talk.session.password_checked(true)), "\n* logged in\nvantage# ");
  EXPECT_THAT(talk.type("login\r"), HasSubstr("you are logged in"));
  talk.robot.ordered();
  talk.type("arm\rgoto 1.5 -2\rgoto 1 2 90\rscan\rpause\rresume\rskip\rhome\r");
  EXPECT_EQ(talk.robot.ordered(),
            "arm\ngo 1.5 -2\ngo 1 2 1.5708\nscan\npause\nresume\nskip\nhome\n");
  EXPECT_THAT(talk.type("resume anew\r"), HasSubstr("resume, or resume from-start"));
  talk.type("restart\rresume from-start\r");
  EXPECT_EQ(talk.robot.ordered(), "restart\nresume from start\n");
  EXPECT_THAT(talk.type("history\r"), Not(HasSubstr("secret")));
  EXPECT_THAT(talk.type("logout\r"), HasSubstr("logged out\nvantage> "));
  EXPECT_THAT(talk.type("arm\r"), HasSubstr("needs a login"));
  EXPECT_THAT(talk.type("login\r\r"), HasSubstr("not logged in"));
}

TEST(Console, RefusesPlacesThatAreNone) {
  Talk talk;
  talk.log_in();
  for (const char* bad :
       {"goto", "goto 1", "goto a b", "goto 1 nan", "goto inf 1", "goto 1e7 0", "goto 1 2x"})
    EXPECT_THAT(talk.type(std::string(bad) + "\r"), HasSubstr("goto takes two numbers")) << bad;
  EXPECT_THAT(talk.type("goto 1 2 north\r"), HasSubstr("the heading is a number"));
  EXPECT_THAT(talk.type("goto 1 2 3 4\r"), HasSubstr("too many words"));
  EXPECT_EQ(talk.robot.ordered(), "");
}

TEST(Console, LocksOutForAMinuteAfterFiveWrongPasswords) {
  Talk talk;
  for (int i = 1; i <= 5; ++i) {
    EXPECT_THAT(talk.type("login\rguess\r"), HasSubstr("password: ")) << i;
    const std::string said = talk.session.password_checked(false);
    EXPECT_THAT(said, HasSubstr(i < 5 ? fmt::format("{} more may be tried", 5 - i)
                                      : "nobody may try for 60 s"));
  }
  talk.robot.ordered();
  talk.wait(20s);
  EXPECT_THAT(talk.type("login\r"), HasSubstr("too many wrong passwords: wait 40 s"));
  EXPECT_EQ(talk.robot.ordered(), "");
  mission::ConsoleSession other({}, talk.robot, talk.limit, talk.time);
  const std::string_view login = "login\r";
  EXPECT_THAT(
      other.receive({reinterpret_cast<const std::uint8_t*>(login.data()), login.size()}, talk.time),
      HasSubstr("too many wrong passwords"))
      << "another console is no way round it";
  talk.wait(40s);
  talk.type("login\rsecret\r");
  EXPECT_EQ(talk.robot.ordered(), "check password 'secret'\n");
  EXPECT_THAT(talk.session.password_checked(true), HasSubstr("logged in"));
  for (int i = 0; i < 4; ++i) {
    talk.type("logout\rlogin\rguess\r");
    talk.session.password_checked(false);
  }
  talk.type("login\rsecret\r");
  talk.session.password_checked(true);
  EXPECT_TRUE(talk.session.logged_in()) << "a right one in time begins the count anew";
  talk.type("logout\r");
  EXPECT_THAT(talk.type("login\r"), HasSubstr("password: "));
}

TEST(Console, CountsATryBeforeItIsAnswered) {
  Talk talk;
  std::vector<std::unique_ptr<mission::ConsoleSession>> others;
  for (int i = 0; i < 8; ++i) {
    others.push_back(std::make_unique<mission::ConsoleSession>(mission::ConsoleSession::Config{},
                                                               talk.robot, talk.limit, talk.time));
    const std::string_view tries = "login\rguess\r";
    others.back()->receive({reinterpret_cast<const std::uint8_t*>(tries.data()), tries.size()},
                           talk.time);
  }
  EXPECT_EQ(talk.robot.orders.size(), 5U);
}

TEST(Console, LogsOutWhoHasGone) {
  Talk talk;
  talk.log_in();
  EXPECT_EQ(talk.wait(10min - 1s), "");
  talk.type("x");
  EXPECT_EQ(talk.wait(9min), "");
  EXPECT_TRUE(talk.session.logged_in());
  EXPECT_EQ(talk.wait(61s), "\n* logged out: nothing was typed for 10 minutes\nvantage> ");
  EXPECT_FALSE(talk.session.logged_in());
  EXPECT_EQ(talk.wait(1h), "");
}

TEST(Console, CanOnlySetAPasswordWhereThereIsNone) {
  Talk talk;
  talk.robot.now.has_password = false;
  for (const char* moves :
       {"arm", "teleop", "goto 1 2", "scan", "resume", "skip", "home", "restart"})
    EXPECT_THAT(talk.type(std::string(moves) + "\r"), HasSubstr("no password was set yet"));
  EXPECT_THAT(talk.type("login\r"), HasSubstr("no password was set yet"));
  EXPECT_EQ(talk.robot.ordered(), "");
  EXPECT_EQ(talk.type("set-password\r"), "set-password\nnew password: ");
  EXPECT_THAT(talk.type("short\r"), HasSubstr("too short: at least 8 characters"));
  EXPECT_EQ(talk.type("set-password\rlong enough\r"), "set-password\nnew password: \nagain: ");
  EXPECT_THAT(talk.type("long enouhg\r"), HasSubstr("the two differ; nothing was changed"));
  EXPECT_EQ(talk.robot.ordered(), "");
  talk.type("set-password\rlong enough\rlong enough\r");
  EXPECT_EQ(talk.robot.ordered(), "set password 'long enough'\n");
  talk.robot.now.has_password = true;
  EXPECT_THAT(talk.session.password_set(""), HasSubstr("the password is set: `login` with it"));
  EXPECT_FALSE(talk.session.logged_in());
  EXPECT_THAT(talk.type("set-password\r"), HasSubstr("set-password needs a login"));
}

TEST(Console, LetsOnlyTheLineOrRootSetTheFirstPassword) {
  Talk talk({.may_set_first_password = false, .first_number = 1});
  talk.robot.now.has_password = false;
  EXPECT_THAT(talk.type("set-password\r"),
              HasSubstr("the first password is set at the serial line, or as root"));
  talk.robot.now.has_password = true;
  talk.log_in();
  EXPECT_THAT(talk.type("set-password\r"), HasSubstr("new password: "));
}

TEST(Console, TellsWhatHappensAndKeepsTheLine) {
  Talk talk;
  talk.type("sta");
  EXPECT_EQ(talk.plain(talk.session.notice("the robot is stopped")),
            "\n* the robot is stopped\nvantage> sta");
  EXPECT_THAT(talk.type("tus\r"), HasSubstr("mode "));
  talk.type("login\rsec");
  EXPECT_EQ(talk.plain(talk.session.notice("x")), "\n* x\npassword: ") << "shows the password";
  EXPECT_THAT(talk.plain(talk.session.notice("\x1B[2J\x07")), HasSubstr("* ?[2J?"));
}

TEST(Console, Quits) {
  Talk talk;
  talk.log_in();
  EXPECT_EQ(talk.type("quit\rhome\r"), "quit\nbye\n");
  EXPECT_TRUE(talk.session.quits());
  EXPECT_FALSE(talk.session.logged_in());
  EXPECT_EQ(talk.robot.ordered(), "");
}

// --- Driving by hand.

TEST(Teleop, DrivesByKeysAndStopsForAnyOther) {
  Talk talk;
  talk.log_in();
  EXPECT_THAT(talk.type("teleop\r"), HasSubstr("any other key stops, q leaves\n"));
  EXPECT_EQ(talk.robot.ordered(), "take over\n");
  EXPECT_EQ(talk.type("wwx"), "forward\nback\n");
  EXPECT_EQ(talk.type("ad"), "left\nright\n");
  EXPECT_EQ(talk.robot.ordered(),
            "drive 0.3 0\ndrive 0.3 0\ndrive -0.2 0\ndrive 0 0.4\ndrive 0 -0.4\n");
  for (const char key : std::string_view("s top1\r\x1B\xFF")) {
    talk.type("w");
    talk.robot.ordered();
    EXPECT_EQ(talk.type(std::string(1, key)), "stands\n") << key;
    EXPECT_EQ(talk.robot.ordered(), "drive stand\n") << key;
  }
  EXPECT_THAT(talk.type("q"), HasSubstr("you no longer drive; `resume` hands the robot back"));
  EXPECT_EQ(talk.robot.ordered(), "drive stand\n");
  EXPECT_FALSE(talk.session.drives());
  EXPECT_THAT(talk.type("wwww\r"), HasSubstr("no command 'wwww'"));
  EXPECT_EQ(talk.robot.ordered(), "");
}

TEST(Teleop, NoLetterOfStopMovesAnything) {
  for (const char letter : std::string_view("stop"))
    EXPECT_FALSE(mission::teleop_twist(letter)) << letter;
  Talk talk;
  talk.log_in();
  talk.type("teleop\r");
  talk.robot.ordered();
  talk.type("stop\r");
  EXPECT_THAT(talk.robot.ordered(), Not(HasSubstr("drive 0")));
}

TEST(Teleop, ShowsThatSilenceStops) {
  Talk talk;
  talk.log_in();
  talk.type("teleop\rw");
  EXPECT_EQ(talk.wait(150ms), "");
  EXPECT_EQ(talk.wait(60ms), "stands\n");
  EXPECT_EQ(talk.type("w"), "forward\n");
}

TEST(Teleop, IsRefusedUnarmedAndEndsWhenTheRobotIsStopped) {
  Talk talk;
  talk.log_in();
  talk.robot.now.released = false;
  EXPECT_THAT(talk.type("teleop\r"), HasSubstr("the robot is not armed: `arm` first"));
  EXPECT_EQ(talk.robot.ordered(), "");
  talk.robot.now.released = true;
  talk.type("teleop\rw");
  talk.robot.now.released = false;
  EXPECT_THAT(talk.type("w"), HasSubstr("not armed\nyou no longer drive"));
  EXPECT_FALSE(talk.session.drives());
  EXPECT_THAT(talk.type("teleop sideways\r"), HasSubstr("teleop, or teleop numbered"));
}

TEST(Teleop, EndsWithTheLinkAndAfterTenMinutes) {
  Talk talk;
  talk.log_in();
  talk.type("teleop\rw");
  talk.robot.ordered();
  talk.session.log_out();
  EXPECT_EQ(talk.robot.ordered(), "drive stand\n");
  EXPECT_FALSE(talk.session.drives());
  talk.log_in();
  talk.type("teleop\r");
  talk.wait(10min);
  EXPECT_FALSE(talk.session.drives());
  EXPECT_FALSE(talk.session.logged_in());
}

// --- Numbered keys.

struct Numbered : testing::Test, Talk {
  Numbered() {
    log_in();
    EXPECT_THAT(type("teleop numbered\r"), HasSubstr("numbers after 1000\n"));
    robot.ordered();
  }
  int moves() {
    int count = 0;
    for (const std::string& order : robot.orders) count += order != "drive stand";
    robot.orders.clear();
    return count;
  }
};

TEST_F(Numbered, CountOnce) {
  type("w1001.");
  EXPECT_EQ(moves(), 1);
  type("w1001.w1001.");
  EXPECT_EQ(moves(), 0) << "repeated";
  type("w1002.a1003.w1001.w1000.");
  EXPECT_EQ(moves(), 2) << "older ones came late";
  type("w1066.");
  EXPECT_EQ(moves(), 1) << "lost ones in between";
}

TEST_F(Numbered, AreNothingWithoutTheirNumber) {
  for (const char* bytes : {"w", "wwww", "w.", "w10", "1004.", "w99999999999999999999.", "w-5.",
                            "w4294967297.", "w 1004.", "x1001x"}) {
    type(bytes);
    type(".s");
    EXPECT_EQ(moves(), 0) << bytes;
  }
}

TEST_F(Numbered, OfAnotherSessionMoveNothing) {
  std::string recorded = "login\rsecret\rteleop numbered\r";
  for (int i = 1; i <= 50; ++i) recorded += "w" + std::to_string(1000 + i) + ".";
  Talk later({.may_set_first_password = true, .first_number = 777'123});
  for (const char byte : recorded) {
    later.type(std::string(1, byte));
    if (byte == '\r' && !later.session.logged_in()) later.session.password_checked(true);
  }
  EXPECT_TRUE(later.session.drives());
  for (const std::string& order : later.robot.orders)
    EXPECT_THAT(order, Not(StartsWith("drive 0")));
  recorded.clear();
  for (int i = 1; i <= 50; ++i) recorded += "w" + std::to_string(1000 + i) + ".";
  type(recorded);
  EXPECT_EQ(moves(), 50);
  type(recorded);
  EXPECT_EQ(moves(), 0) << "the same once more";
}

TEST_F(Numbered, StopWithoutANumber) {
  type("w1001.");
  EXPECT_EQ(type("s"), "stands\n");
  EXPECT_THAT(type("w1002.q"), HasSubstr("you no longer drive"));
}

TEST_F(Numbered, AreWhatTheClientSends) {
  mission::ConsoleKeys keys;
  EXPECT_EQ(keys.send("teleop\rwxad"), "teleop\rwxad");
  keys.hear("teleop\r\nthe mission waits\r\nnumbers af");
  keys.hear("ter 1000\r\n");
  const std::string sent = keys.send("wwas");
  EXPECT_EQ(sent, "w1001.w1002.a1003.s");
  type(sent);
  EXPECT_EQ(moves(), 3);
  keys.hear("forward\r\nyou no longer drive; `resume`\r\n");
  EXPECT_EQ(keys.send("why\r"), "why\r");
}

TEST(Teleop, IsNumberedForAProgramThatSaysSo) {
  Talk talk;
  talk.log_in();
  EXPECT_EQ(talk.type("\x05"), "");
  EXPECT_THAT(talk.type("teleop\r"), HasSubstr("numbers after 1000\n"));
}

TEST(ConsoleText, BreaksLongLinesBetweenWords) {
  EXPECT_EQ(mission::console_text(""), "");
  EXPECT_EQ(mission::console_text("a\n\nb\n"), "a\r\n\r\nb\r\n");
  EXPECT_EQ(mission::console_text(std::string(79, 'x')), std::string(79, 'x') + "\r\n");
  EXPECT_EQ(mission::console_text(std::string(80, 'x')), std::string(79, 'x') + "\r\n  x\r\n");
  EXPECT_EQ(mission::console_text(std::string(78, 'x') + " yy"),
            std::string(78, 'x') + "\r\n  yy\r\n");
}

}  // namespace
