// `vantage doctor` and `vantage-units` talk over pseudo terminals and TCP: two programs of ours,
// and between them only what a real robot has, too.
#include <signal.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <chrono>
#include <map>
#include <thread>

#include "tests/tools/vantage_test.hpp"

namespace {

using namespace std::chrono_literals;

const std::string kSource = VANTAGE_SOURCE_DIR;

// The robot file with every device that it may have.
std::string full_robot() {
  std::string robot = test::read_text(kSource + "/configs/robots/scout_lms511.toml");
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
  void start_units(const std::string& typed) {
    const auto original = write("original.toml", full_robot());
    const auto folder = folder_.path().string();
    const std::string command = "{ printf '" + typed + "\\n'; sleep 60; } | " + VANTAGE_BINARY_DIR +
                                "/vantage-units " + kSource +
                                "/configs/missions/courtyard.toml --robot " + original.string() +
                                " --folder " + folder + "/ports >" + folder + "/links 2>" + folder +
                                "/units_err & echo $! >" + folder + "/pid";
    ASSERT_EQ(std::system(command.c_str()), 0);
    for (int i = 0; i < 300 && links().find("safety_link") == std::string::npos; ++i)
      std::this_thread::sleep_for(100ms);
    robot_ = write("robot.toml", with_links(full_robot()));
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
