// `vantaged` on hardware, as a person starts it; `vantage-units` is the hardware. There is no CAN
// here: what a whole mission does, tests/kernel asks.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <sstream>
#include <thread>

#include "tests/tools/vantage_test.hpp"

namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kYard = VANTAGE_SOURCE_DIR "/tests/yard";

class Hardware : public test::VantageTest {
 protected:
  // A copy of the yard whose robot has these tables besides.
  void make_yard(const std::string& tables) {
    for (const char* name : {"footprint.geojson", "mission.toml", "model.obj"})
      write(std::string("yard/") + name, test::read_text(kYard / name));
    std::string robot = test::read_text(kYard / "robot.toml");
    const auto at = robot.find("\"sim\"");
    robot.replace(at, 5, "\"hardware\"");
    // Lines of tables that the robot file has already go below their headers.
    std::istringstream lines(tables);
    std::string section, rest;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with('[')) section = line + "\n";
      const auto there = robot.find(section);
      if (there == std::string::npos)
        rest += line + "\n";
      else if (!line.starts_with('['))
        robot.insert(there + section.size(), line + "\n");
    }
    write("yard/robot.toml", robot + rest);
  }
  std::string run_folder() const { return (folder_.path() / "run").string(); }
  std::string arguments() const {
    return (folder_.path() / "yard/mission.toml").string() + " --out " + run_folder();
  }
  test::Outcome vantaged(const std::string& before = "") const {
    const std::string command = before + std::string(VANTAGE_BINARY_DIR) + "/vantaged " +
                                arguments() + " >" + (folder_.path() / "out").string() + " 2>" +
                                (folder_.path() / "err").string();
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, test::read_text(folder_.path() / "out"),
            test::read_text(folder_.path() / "err")};
  }
};

TEST_F(Hardware, IsRefusedWithLinksThatCannotBe) {
  make_yard("[drive]\nlink = \"tcp:127.0.0.1:1\"\n[imu]\nlink = \"seriel:/dev/ttyUSB9\"\n");
  const test::Outcome outcome = vantaged();
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("a drive hangs on CAN"));
  EXPECT_THAT(outcome.err, HasSubstr("2 errors; nothing was written"));
  EXPECT_FALSE(std::filesystem::exists(run_folder()));
}

TEST_F(Hardware, IsRefusedWhereTheMapDoesNotSayWhereItLies) {
  make_yard("");
  std::string map = test::read_text(kYard / "footprint.geojson");
  const auto at = map.find("\"origin\"");
  map.erase(at, map.find("},", at) + 2 - at);
  write("yard/footprint.geojson", map);
  const test::Outcome outcome = vantaged();
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("where it lies on the earth"));
  EXPECT_THAT(outcome.err, HasSubstr("\"origin\""));
}

// The units of everything but the drive run; vantaged says what it waits for.
class WaitingHardware : public Hardware {
 protected:
  void SetUp() override {
    Hardware::SetUp();
    const std::string folder = folder_.path().string();
    const std::string units = std::string(VANTAGE_BINARY_DIR) + "/vantage-units " +
                              (kYard / "mission.toml").string() + " --folder " + folder +
                              "/ports </dev/null >" + folder + "/links 2>&1 & echo $! >" + folder +
                              "/pid";
    ASSERT_EQ(std::system(units.c_str()), 0);
    const auto links = [&] { return test::read_text(folder_.path() / "links"); };
    for (int i = 0; i < 300 && links().find("[gnss]") == std::string::npos; ++i)
      std::this_thread::sleep_for(100ms);
    std::this_thread::sleep_for(500ms);
    make_yard("[drive]\nlink = \"can:vantage9\"\n" + links());
  }
  bool is_for_one_alone(const std::string& port) const {
    const std::string path = (folder_.path() / "ports" / port).string();
    const int look = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (look < 0) return errno == EBUSY;
    int exclusive = 0;
    EXPECT_EQ(ioctl(look, TIOCGEXCL, &exclusive), 0);
    close(look);
    return exclusive != 0;
  }
  void TearDown() override {
    const int pid = std::atoi(test::read_text(folder_.path() / "pid").c_str());
    if (pid > 0) kill(pid, SIGTERM);
  }
};

TEST_F(WaitingHardware, SaysWhatItWaitsForAndStopsForASignal) {
  const test::Outcome outcome = vantaged("timeout --foreground --preserve-status -s TERM 20 ");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("waits for drive (agilex-scout2 at can:vantage9): not there"));
  for (const char* role : {"; scanner (", "; pan (", "; imu (", "; gnss ("})
    EXPECT_THAT(outcome.err.substr(outcome.err.rfind("waits for")), Not(HasSubstr(role)));
  EXPECT_THAT(outcome.out, HasSubstr("NOT completed: stopped by SIGTERM"));
  EXPECT_TRUE(std::filesystem::exists(run_folder() + "/report.html"));
  // The units hold their ports open: what the program locked has to be open to the next one's user.
  for (const char* name : {"pan", "imu", "gnss"}) EXPECT_FALSE(is_for_one_alone(name)) << name;
}

// As `timeout` without --foreground does it, or a terminal whose shell hands the signal on.
TEST_F(WaitingHardware, TakesASignalThatComesThreeTimesAtOnceForOne) {
  const test::Outcome outcome =
      vantaged("sh -c 'until grep -qs waits " + (folder_.path() / "err").string() +
               "; do sleep 0.2; done; kill $PPID; kill $PPID; kill $PPID' & exec ");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("NOT completed: stopped by SIGTERM"));
}

// Without a drive there is no mission yet; whoever sits at the console learns why.
TEST_F(WaitingHardware, ServesItsConsoleBeforeThereIsAMission) {
  const std::string folder = folder_.path().string(), socket = folder + "/console.sock";
  write("yard/robot.toml", test::read_text(folder_.path() / "yard/robot.toml") +
                               "\n[console]\nsocket = \"" + socket + "\"\npassword = \"" + folder +
                               "/password\"\n");
  const std::string ask = "sh -c 'until grep -qs waits " + folder + "/err; do sleep 0.2; done; " +
                          "printf \"status\\rwhy\\rfaults\\rstop\\rarm\\r\" | " +
                          VANTAGE_BINARY_DIR + "/vantage console --socket " + socket + " >" +
                          folder + "/seen 2>&1; kill $PPID' & exec ";
  const test::Outcome outcome = vantaged(ask);
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  const std::string seen = test::read_text(folder_.path() / "seen");
  EXPECT_THAT(seen, HasSubstr("mission  none"));
  EXPECT_THAT(seen, HasSubstr("not all devices have started yet"));
  EXPECT_THAT(seen, HasSubstr("F500-link-absent hold: drive: not there"));
  EXPECT_THAT(seen, HasSubstr("the robot stands until `arm`"));
  EXPECT_THAT(seen, HasSubstr("no password was set yet"));
  EXPECT_FALSE(std::filesystem::exists(socket)) << "left behind";
}

}  // namespace
