// `vantage doctor` and `vantage-units` talk over pseudo terminals and TCP: two programs of ours,
// and between them only what a real robot has, too.
#include <signal.h>
#include <unistd.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>
#include <chrono>
#include <map>
#include <thread>

#include "tests/tools/vantage_test.hpp"

namespace {

using namespace std::chrono_literals;

const std::string kSource = VANTAGE_SOURCE_DIR;

std::string shipped(const std::string& robot) {
  return test::read_text(kSource + "/configs/robots/" + robot);
}

// The robot file with every device that it may have.
std::string full_robot() {
  std::string robot = shipped("scout_lms511.toml");
  for (const char* line : {"[power]", "battery_link", "board_link", "safety_link"}) {
    const auto at = robot.find(std::string("# ") + line);
    EXPECT_NE(at, std::string::npos) << line;
    robot.erase(at, 2);
  }
  return robot;
}

class DoctorTest : public test::VantageTest {
 protected:
  // Starts the units with what a person types; robot_ then has their links.
  void start_units(const std::string& typed, const std::string& robot = full_robot()) {
    const auto original = write("original.toml", robot);
    const auto folder = folder_.path().string();
    // Nothing that stays behind may hold what the test prints to: whoever reads it would wait.
    const std::string command =
        "( exec 2>/dev/null; printf '" + typed + "\\n'; exec sleep 60 ) | " + VANTAGE_BINARY_DIR +
        "/vantage-units " + kSource + "/configs/missions/courtyard.toml --robot " +
        original.string() + " --folder " + folder + "/ports >" + folder + "/links 2>" + folder +
        "/units_err & echo $! >" + folder + "/pid";
    ASSERT_EQ(std::system(command.c_str()), 0);
    for (int i = 0; i < 300 && links().find("[gnss]") == std::string::npos; ++i)
      std::this_thread::sleep_for(100ms);
    robot_ = write("robot.toml", with_links(robot));
  }
  void TearDown() override {
    const int pid = std::atoi(test::read_text(folder_.path() / "pid").c_str());
    if (pid > 0) kill(pid, SIGTERM);
  }
  std::string links() const { return test::read_text(folder_.path() / "links"); }

  // The tables that vantage-units printed, over the robot file's own.
  std::string with_links(std::string robot) const {
    std::istringstream lines(links());
    std::string table;
    for (std::string line; std::getline(lines, line);) {
      if (line.front() == '[') {
        table = line;
        continue;
      }
      const std::string key = line.substr(0, line.find(" ="));
      const auto section = robot.find(table);
      const auto at = robot.find("\n" + key + " =", section) + 1;
      robot.replace(at, robot.find('\n', at) - at, line);
    }
    return robot;
  }

  // By role.
  std::map<std::string, boost::json::object> diagnose(const std::string& wait_s) const {
    const test::Outcome outcome = run("doctor " + robot_.string() + " --json --wait " + wait_s);
    EXPECT_EQ(outcome.code, 1) << "there is no CAN here\n" << outcome.err;
    std::map<std::string, boost::json::object> devices;
    const boost::json::value report = outcome.json();
    for (const auto& device : report.at("devices").as_array())
      devices[std::string(device.at("role").as_string())] = device.as_object();
    return devices;
  }
  static std::string names(const boost::json::object& device) {
    std::string text;
    for (const auto& trouble : device.at("troubles").as_array()) {
      text += trouble.at("name").as_string();
      text += "; ";
      EXPECT_FALSE(trouble.at("remedy").as_string().empty()) << text;
    }
    return text;
  }

  std::filesystem::path robot_;
};

TEST_F(DoctorTest, FindsAndIdentifiesWhatIsThereAndSaysWhatIsNot) {
  start_units("pan none");
  auto devices = diagnose("15");
  ASSERT_EQ(devices.size(), 6U);
  for (const char* role : {"scanner", "pan", "imu", "gnss", "power"}) {
    EXPECT_TRUE(devices[role].at("healthy").as_bool()) << role << ": " << names(devices[role]);
    EXPECT_FALSE(devices[role].at("model").as_string().empty()) << role;
  }
  EXPECT_EQ(devices["scanner"].at("model").as_string(), "LMS511_PRO");
  EXPECT_EQ(devices["imu"].at("serial").as_string(), "0100013270");
  EXPECT_FALSE(devices["drive"].at("healthy").as_bool());
  EXPECT_NE(names(devices["drive"]).find("not there"), std::string::npos)
      << names(devices["drive"]);
}

class ShippedRobots : public DoctorTest, public testing::WithParamInterface<const char*> {};

// Their scanners on TCP, a serial line and UDP; all kinds of satellite receivers.
TEST_P(ShippedRobots, AreHealthyButForTheMissingCan) {
  std::string robot = shipped(GetParam());
  if (GetParam() == std::string("scout_ouster.toml")) write("os1_32.json", shipped("os1_32.json"));
  start_units("pan none", robot);
  auto devices = diagnose("15");
  ASSERT_GE(devices.size(), 4U);
  for (const auto& [role, device] : devices) {
    // On a busy machine packets come late, and the doctor says so: that is no fault of the robot.
    const bool late = names(device) == "scans come late; ";
    EXPECT_EQ(device.at("healthy").as_bool() || late, role != "drive") << role << names(device);
    EXPECT_EQ(device.at("state").as_string() == "running", role != "drive") << role;
    if (role == "scanner" || role == "imu") {
      EXPECT_FALSE(device.at("maker").as_string().empty()) << role;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedRobots,
                         testing::Values("avenue.toml", "bunker_vlp16.toml", "scout_ouster.toml",
                                         "scout_hokuyo.toml", "mini_lms111.toml",
                                         "scout_looking.toml"),
                         [](const auto& param) {
                           const std::string name = param.param;
                           return name.substr(0, name.find('.'));
                         });

// The caster's address, mountpoint and version are the robot file's; what flows is told.
TEST_F(DoctorTest, SaysHowOldCorrectionsAreAndWhyThereAreNone) {
  start_units("pan none", shipped("scout_looking.toml"));
  auto devices = diagnose("15");
  EXPECT_TRUE(devices["corrections"].at("healthy").as_bool()) << names(devices["corrections"]);
  const std::string condition(devices["corrections"].at("condition").as_string());
  EXPECT_NE(condition.find("base 3.3 km away"), std::string::npos) << condition;
  EXPECT_NE(devices["gnss"].at("condition").as_string().find("since the last came"),
            std::string::npos);
  std::string robot = test::read_text(robot_);
  robot.replace(robot.find("\"SITE0\""), 7, "\"SITE1\"");
  robot_ = write("wrong.toml", robot);
  devices = diagnose("6");
  EXPECT_NE(names(devices["corrections"]).find("no such mountpoint"), std::string::npos)
      << names(devices["corrections"]);
}

TEST_F(DoctorTest, FindsAHokuyoOnASerialLine) {
  std::string robot = shipped("scout_hokuyo.toml");
  const auto at = robot.find("tcp:192.168.0.10:10940");
  robot.replace(at, std::string("tcp:192.168.0.10:10940").size(), "serial:/dev/ttyACM1@115200");
  start_units("pan none", robot);
  auto devices = diagnose("12");
  EXPECT_TRUE(devices["scanner"].at("healthy").as_bool()) << names(devices["scanner"]);
  EXPECT_NE(devices["scanner"].at("link").as_string().find("serial:"), std::string::npos);
}

// A robot whose wiring or settings are wrong in one place: what is written instead of the right
// text, and what the doctor then says and advises.
struct Wrong {
  const char* name;
  const char* role;
  const char* table;
  const char* key;
  const char* instead;  // "@RATE": the same line at that rate; "swap TABLE": that device's link.
  const char* says;
  const char* advises;
};

void PrintTo(const Wrong& wrong, std::ostream* to) {
  *to << wrong.name;
}

class WrongWiring : public DoctorTest, public testing::WithParamInterface<Wrong> {
 protected:
  static std::string link_in(const std::string& robot, const std::string& table) {
    const auto key = robot.find("\nlink = \"", robot.find("[" + table + "]")) + 9;
    return robot.substr(key, robot.find('"', key) - key);
  }
  static void put(std::string& robot, const std::string& table, const std::string& key,
                  const std::string& text) {
    const auto at = robot.find("\n" + key + " = \"", robot.find("[" + table + "]")) + 1;
    robot.replace(at, robot.find('\n', at) - at, key + " = \"" + text + "\"");
  }
  static std::string with(std::string robot, const Wrong& wrong) {
    const std::string instead = wrong.instead, own = link_in(robot, wrong.table);
    if (instead.starts_with("swap ")) {
      const std::string other = instead.substr(5);
      put(robot, wrong.table, wrong.key, link_in(robot, other));
      put(robot, other, wrong.key, own);
    } else if (instead.starts_with("@")) {  // Another rate on the same line.
      put(robot, wrong.table, wrong.key, own.substr(0, own.find('@')) + instead);
    } else {
      put(robot, wrong.table, wrong.key, instead);
    }
    return robot;
  }
};

TEST_P(WrongWiring, IsNamedWithItsRemedy) {
  const Wrong& wrong = GetParam();
  start_units("pan none");
  robot_ = write("wrong.toml", with(test::read_text(robot_), wrong));
  // A driver that finds nothing where it looks first says so, and then looks on: the doctor shows
  // where it is at the end of the wait.
  bool found = false;
  std::string said;
  for (int tries = 0; tries < 3 && !found; ++tries) {
    auto devices = diagnose("9");
    const boost::json::object& device = devices[wrong.role];
    EXPECT_FALSE(device.at("healthy").as_bool());
    said += names(device);
    for (const auto& trouble : device.at("troubles").as_array())
      found = found || (trouble.at("name").as_string() == wrong.says &&
                        trouble.at("remedy").as_string().find(wrong.advises) != std::string::npos);
  }
  EXPECT_TRUE(found) << said;
}

INSTANTIATE_TEST_SUITE_P(
    Doctor, WrongWiring,
    testing::Values(Wrong{"BaudOfThePanUnit", "pan", "pan", "link", "@19200", "not understood",
                          "set the bit rate of the robot file"},
                    Wrong{"BaudOfTheImu", "imu", "imu", "link", "@57600", "not understood",
                          "set the bit rate of the robot file"},
                    Wrong{"BaudOfTheReceiver", "gnss", "gnss", "link", "@4800", "not understood",
                          "set the bit rate of the robot file"},
                    Wrong{"PortOfTheScanner", "scanner", "scanner", "link", "tcp:127.0.0.1:1",
                          "connection refused", "check the port"},
                    Wrong{"AddressOfTheScanner", "scanner", "scanner", "link",
                          "tcp:no-such-host.invalid:2112", "unknown host name",
                          "write the IP address"},
                    Wrong{"NoSuchSerialPort", "imu", "imu", "link",
                          "serial:/dev/no-such-port@115200", "not there", "plug it in"},
                    Wrong{"ImuAndReceiverSwapped", "imu", "imu", "link", "swap gnss",
                          "another device", "correct the port"},
                    Wrong{"ReceiverWhereGpsdIsNamed", "gnss", "gnss", "device", "gpsd",
                          "another device", "the model in the robot file"}),
    [](const auto& param) { return std::string(param.param.name); });

// And what to write instead, which helps.
TEST_F(DoctorTest, SaysAtWhichRateAPanUnitAnswers) {
  start_units("pan none");
  std::string robot = test::read_text(robot_);
  const std::string right = folder_.path().string() + "/ports/pan@9600";
  const std::string wrong = folder_.path().string() + "/ports/pan@115200";
  robot.replace(robot.find(right), right.size(), wrong);
  robot_ = write("wrong.toml", robot);
  auto devices = diagnose("9");
  EXPECT_EQ(names(devices["pan"]), "not understood; ");
  const auto& troubles = devices["pan"].at("troubles").as_array();
  ASSERT_EQ(troubles.size(), 1U);
  const std::string said(troubles[0].at("detail").as_string());
  const std::string before = "answers at 9600 baud, not at 115200: set link = \"";
  ASSERT_TRUE(said.starts_with(before)) << said;
  const std::string link = said.substr(before.size(), said.size() - before.size() - 1);
  robot.replace(robot.find("serial:" + wrong), 7 + wrong.size(), link);
  robot_ = write("right.toml", robot);
  devices = diagnose("9");
  EXPECT_TRUE(devices["pan"].at("healthy").as_bool()) << names(devices["pan"]);
}

TEST_F(DoctorTest, APanUnitWithoutPowerDoesNotAnswer) {
  start_units("pan off");
  const auto devices = diagnose("9");
  EXPECT_EQ(names(devices.at("pan")), "no answer; ");
}

// As a user who is not in the port's group.
TEST_F(DoctorTest, NamesTheGroupThatMayOpenAPort) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can become a user without rights";
  start_units("pan none");
  std::filesystem::permissions(
      folder_.path(), std::filesystem::perms::others_read | std::filesystem::perms::others_exec,
      std::filesystem::perm_options::add);
  const test::Outcome outcome =
      test::run_program("vantage", "doctor " + robot_.string() + " --json --wait 2", folder_.path(),
                        "setpriv --reuid=65534 --regid=65534 --clear-groups ");
  const boost::json::value report = outcome.json();
  for (const auto& device : report.at("devices").as_array())
    if (device.at("role").as_string() == "imu") {
      EXPECT_NE(names(device.as_object()).find("not permitted"), std::string::npos);
      EXPECT_NE(serialize(device).find("usermod -aG GROUP USER"), std::string::npos);
      EXPECT_NE(serialize(device).find("; group "), std::string::npos);
    }
}

TEST_F(DoctorTest, TellsASilentDeviceFromHealthyOnes) {
  start_units("imu off");
  auto devices = diagnose("8");
  EXPECT_FALSE(devices["imu"].at("healthy").as_bool());
  EXPECT_NE(names(devices["imu"]), "") << "no reason";
  EXPECT_TRUE(devices["scanner"].at("healthy").as_bool()) << names(devices["scanner"]);
}

TEST_F(DoctorTest, RefusesARobotWhoseLinksCannotBe) {
  const auto robot = write("odd.toml",
                           "[drive]\nlink = \"serial:/dev/ttyUSB0@9600\"\n"
                           "[pan]\nlink = \"seriel:/dev/ttyUSB0\"\n");
  const test::Outcome outcome = run("doctor " + robot.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("odd.toml:2:"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("odd.toml:4:"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("can:can0"), std::string::npos) << outcome.err;
}

}  // namespace
