// vantaged on a folder that holds an unfinished run, as whoever starts it meets it.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/json.hpp>
#include <chrono>
#include <fstream>

#include "mission/resume.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Outcome {
  int code = -1;
  std::string out;  // Both outputs.
};

// vantaged, or vantage, from the build.
Outcome program(const std::string& name, const std::string& words) {
  const std::string command = std::string(VANTAGE_BINARY_DIR) + "/" + name + " " + words + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  Outcome outcome;
  std::array<char, 4096> piece{};
  for (std::size_t got; (got = fread(piece.data(), 1, piece.size(), pipe)) > 0;)
    outcome.out.append(piece.data(), got);
  outcome.code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

class ResumeProgram : public testing::Test {
 protected:
  ResumeProgram() { (void)mission_test::crossing(site_); }

  std::string words(const std::string& more = "") const {
    return (site_.folder() / "mission.toml").string() + " --quiet --threads 1 --out " +
           site_.out().string() + " " + more;
  }
  // Kills it as soon as there are two scans.
  void leave_unfinished() const {
    const pid_t child = fork();
    if (child == 0) {
      const std::string path = std::string(VANTAGE_BINARY_DIR) + "/vantaged";
      const std::string mission = (site_.folder() / "mission.toml").string();
      const std::string out = site_.out().string();
      execl(path.c_str(), path.c_str(), mission.c_str(), "--quiet", "--threads", "1", "--out",
            out.c_str(), nullptr);
      _exit(127);
    }
    const fs::path third = site_.out() / "scans" / "0003.ply";
    while (!fs::exists(third) && waitpid(child, nullptr, WNOHANG) == 0) usleep(1000);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }

  mission_test::SmallSite site_{mission_test::kQuickRobot, 1};
};

TEST_F(ResumeProgram, OffersAnUnfinishedRunAndLeavesItAsItIs) {
  leave_unfinished();
  const auto before = mission::read_file(site_.out() / "decisions.jsonl").value();
  const auto began = std::chrono::steady_clock::now();
  const Outcome offer = program("vantaged", words());
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(5));
  EXPECT_EQ(offer.code, 4) << offer.out;
  EXPECT_THAT(offer.out, HasSubstr("an unfinished run of mission lies in"));
  EXPECT_THAT(offer.out, HasSubstr("stations are done"));
  EXPECT_THAT(offer.out, HasSubstr(", whole\n"));
  EXPECT_THAT(offer.out, HasSubstr("it ended because: the program was cut off"));
  EXPECT_THAT(offer.out, HasSubstr("--resume"));
  EXPECT_EQ(before, mission::read_file(site_.out() / "decisions.jsonl").value());

  const Outcome asked = program("vantage", "resume " + site_.out().string() + " --json");
  EXPECT_EQ(asked.code, 0) << asked.out;
  const auto json = boost::json::parse(asked.out);
  EXPECT_TRUE(json.at("unfinished").as_bool());
  EXPECT_GE(json.at("run").at("scans").to_number<int>(), 2);
  EXPECT_TRUE(json.at("run").at("last_scan").at("whole").as_bool());
}

TEST_F(ResumeProgram, GoesOnWithoutTheStationsThatAreSkipped) {
  leave_unfinished();
  const auto left = mission::find_left_run(site_.out()).value();
  ASSERT_TRUE(left);
  const auto& stations = left->history.planned->stations;
  const std::string last = stations.back().second;
  EXPECT_EQ(program("vantaged", words("--resume --skip nowhere")).code, 2);
  const Outcome resumed = program("vantaged", words("--resume --skip '" + last + "'"));
  ASSERT_EQ(resumed.code, 0) << resumed.out;
  const auto summary = boost::json::parse(mission::read_file(site_.out() / "summary.json").value());
  EXPECT_EQ(summary.at("resumed").to_number<int>(), 1);
  ASSERT_EQ(summary.at("dropped").as_array().size(), 1U);
  const auto& dropped = summary.at("dropped").as_array()[0];
  EXPECT_EQ(dropped.at("name").as_string(), last);
  EXPECT_THAT(std::string(dropped.at("reason").as_string()), HasSubstr("skipped"));
  const auto decisions = mission::read_file(site_.out() / "decisions.jsonl").value();
  EXPECT_THAT(decisions, HasSubstr("\"decision\":\"resumed\""));
  EXPECT_THAT(decisions, HasSubstr("\"decision\":\"stations\""));
  EXPECT_THAT(mission::read_file(site_.out() / "report.html").value(),
              HasSubstr("this run went on"));
  EXPECT_EQ(program("vantage", "resume " + site_.out().string()).code, 0);
}

TEST_F(ResumeProgram, RefusesToGoOnFromOtherInputs) {
  leave_unfinished();
  std::ofstream(site_.folder() / "robot.toml", std::ios::app) << "# Another wheel.\n";
  const Outcome robot = program("vantaged", words("--resume"));
  EXPECT_EQ(robot.code, 2) << robot.out;
  EXPECT_THAT(robot.out, HasSubstr("the robot file robot.toml is not the one that the run began"));
  EXPECT_THAT(program("vantaged", words("--resume --seed 99")).out,
              HasSubstr("the seed is not the one that the run began with"));
  std::ofstream(site_.folder() / "extra.geojson") << "{}";
  EXPECT_NE(program("vantaged", words("--resume")).code, 0);
}

TEST_F(ResumeProgram, BeginsAnewWhenToldTo) {
  leave_unfinished();
  const Outcome anew = program("vantaged", words("--restart"));
  ASSERT_EQ(anew.code, 0) << anew.out;
  const auto summary = boost::json::parse(mission::read_file(site_.out() / "summary.json").value());
  EXPECT_EQ(summary.at("resumed").to_number<int>(), 0);
  const Outcome again = program("vantaged", words("--resume"));
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.out, HasSubstr("is finished"));
  EXPECT_EQ(program("vantaged", words()).code, 0) << "a finished run is replaced";
}

}  // namespace
