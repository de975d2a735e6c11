// A password in a file: who may read it, and that nothing says what it is.
#include "mission/account.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "mission/main_corrections.hpp"
#include "mission/main_links.hpp"
#include "mission/main_robot.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using testing::HasSubstr;
using testing::Not;

class AccountTest : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text, mode_t rights) {
    const auto path = folder_.path() / "rtk.account";
    std::ofstream(path, std::ios::binary) << text;
    EXPECT_EQ(chmod(path.c_str(), rights), 0);
    return path;
  }
  test::TempFolder folder_;
};

TEST_F(AccountTest, ReadsUserAndPassword) {
  const auto account = mission::read_account(file("robot:with:colon \r\n", 0600));
  EXPECT_EQ(account.problem, "");
  EXPECT_EQ(account.user, "robot");
  EXPECT_EQ(account.password, "with:colon ");
  EXPECT_EQ(mission::read_account(file("robot:x", 0400)).password, "x");
  EXPECT_EQ(mission::read_account(file("robot:\n", 0600)).password, "");
}

TEST_F(AccountTest, IsRefusedWhereOthersMayReadIt) {
  for (const mode_t rights : {0640U, 0604U, 0660U, 0777U}) {
    const auto account = mission::read_account(file("robot:secret\n", rights));
    EXPECT_THAT(account.problem, HasSubstr("chmod 600"));
    EXPECT_EQ(account.user + account.password, "");
  }
}

TEST_F(AccountTest, NeverTellsWhatIsInIt) {
  for (const char* text : {"secret", ":secret", "robot:secret\nsecret", "", "\n"}) {
    const auto account = mission::read_account(file(text, 0600));
    EXPECT_THAT(account.problem, HasSubstr("USER:PASSWORD")) << text;
    EXPECT_THAT(account.problem, Not(HasSubstr("secret")));
  }
  EXPECT_THAT(mission::read_account(file(std::string(5000, 's'), 0600)).problem,
              Not(HasSubstr("sss")));
  EXPECT_THAT(mission::read_account(folder_.path() / "none").problem, HasSubstr("not there"));
  EXPECT_THAT(mission::read_account(folder_.path()).problem, HasSubstr("no file"));
}

mission::MissionConfig robot(const std::string& text) {
  const auto loaded = mission::parse_mission("", "m.toml", text, "r.toml");
  EXPECT_TRUE(loaded.errors.empty()) << loaded.errors[0].text();
  return loaded.config;
}

std::string text_of(const std::vector<mission::ConfigError>& errors) {
  std::string text;
  for (const auto& error : errors) text += error.text() + "\n";
  return text;
}

TEST_F(AccountTest, IsAskedForByTheRobotFile) {
  const auto open = file("robot:secret\n", 0644);
  const std::string robot_text =
      "[corrections]\ndevice = 'ntrip'\nlink = 'tcp:127.0.0.1:1'\nmountpoint = 'A'\naccount = '";
  const auto config = robot(robot_text + open.string() + "'\n");
  const std::string problems = text_of(mission::link_problems(config));
  EXPECT_THAT(problems, HasSubstr("r.toml:5:1"));
  EXPECT_THAT(problems, HasSubstr("chmod 600"));
  EXPECT_THAT(problems, Not(HasSubstr("secret")));
  ASSERT_EQ(chmod(open.c_str(), 0600), 0);
  EXPECT_EQ(text_of(mission::link_problems(config)), "");
  EXPECT_EQ(text_of(mission::robot_problems(config)), "");
}

TEST(Corrections, AreRefusedWhereTheyCannotWork) {
  const auto problems = [](const std::string& text) {
    return text_of(mission::robot_problems(robot(text)));
  };
  const std::string on = "[corrections]\ndevice = 'ntrip'\n";
  EXPECT_THAT(problems(on), HasSubstr("no mountpoint is named"));
  EXPECT_THAT(problems(on + "mountpoint = 'A B'\n"), HasSubstr("no blanks"));
  EXPECT_THAT(problems(on + "mountpoint = 'A'\nlink = 'serial:/dev/ttyUSB0@9600'\n"),
              HasSubstr("tcp:HOST:PORT"));
  EXPECT_THAT(problems(on + "mountpoint = 'A'\n[gnss]\ndevice = 'nmea'\n"),
              HasSubstr("device = \"ublox\""));
  EXPECT_EQ(problems(on + "mountpoint = 'A'\n"), "");
  EXPECT_EQ(problems(""), "");
}

}  // namespace
