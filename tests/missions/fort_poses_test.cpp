// How well the robot knows where it stands on the fort, without satellites in the courtyard that it
// drives in: over many seeds, before its scans are laid over each other and after.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/json.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "run_mission.hpp"
#include "tests/support/temp_folder.hpp"

namespace fort_poses_tests {
namespace {

double number(const boost::json::value& value) {
  return value.to_number<double>();
}

struct Errors {
  std::vector<double> position_m, heading_deg;

  void add(const boost::json::value& pose, const boost::json::value& truth) {
    const auto off = [&](const char* key) { return number(pose.at(key)) - number(truth.at(key)); };
    position_m.push_back(std::hypot(off("x_m"), off("y_m")));
    heading_deg.push_back(std::abs(std::remainder(off("heading_deg"), 360)));
  }
};

double share(std::vector<double> values, double part) {
  std::ranges::sort(values);
  const auto last = static_cast<std::size_t>(std::ceil(part * double(values.size()))) - 1;
  return values.at(last);
}

std::string in_words(const char* when, const Errors& errors) {
  return fmt::format(
      "{} of {}: 95 % within {:.4f} m and {:.4f} deg, all within {:.4f} m and "
      "{:.4f} deg\n",
      when, errors.position_m.size(), share(errors.position_m, 0.95),
      share(errors.heading_deg, 0.95), share(errors.position_m, 1), share(errors.heading_deg, 1));
}

// The fort with stations only. `regions`: what is made of those that a person scans.
class Fort {
 public:
  explicit Fort(const std::string& regions, const std::string& robot_file = "scout_lms511.toml") {
    const auto configs = missions::configs();
    std::string robot = missions::read_text(configs / "robots" / robot_file);
    const std::string sim = "[sim]\n";
    robot.insert(robot.find(sim) + sim.size(), "gnss_outage = \"inner\"\n");
    std::ofstream(folder_.path() / "robot.toml") << robot;
    std::filesystem::copy_file(configs / "robots" / "os1_32.json", folder_.path() / "os1_32.json");
    std::ofstream(folder_.path() / "fort.toml")
        << "robot = \"robot.toml\"\nsite = \"" << (configs / "sites" / "fort").string()
        << "\"\n[regions]\ninner = \"robot\"\nouter = \"" << regions << "\"\nmoat = \"" << regions
        << "\"\n[phase1]\ncoverage_goal = 0.985\ngain_min = 0.005\n[phase2]\nviews_max = 0\n";
  }

  void run(int seed) {
    const auto run = missions::run(folder_.path() / "fort.toml", "poses",
                                   {"--seed", std::to_string(seed), "--quiet"});
    ASSERT_EQ(run.exit_code, 0) << "seed " << seed << ": " << run.output;
    for (const auto& scan : run.summary.at("scans").as_array()) {
      after.add(scan.at("believed"), scan.at("truth"));
      if (scan.at("by_hand").as_bool()) continue;
      before.add(scan.at("registration").at("localizer"), scan.at("truth"));
      arrived.add(scan.at("arrived"), scan.at("truth"));
      claimed_m.push_back(number(scan.at("arrived").at("sigma_position_m")));
    }
    std::filesystem::remove_all(run.folder);
  }
  // Of a robot that holds on to walls on its way, before its scan says anything.
  void expect_as_promised_on_arrival() const {
    EXPECT_LE(share(arrived.position_m, 0.95), 0.30);
    EXPECT_LE(share(arrived.heading_deg, 0.95), 1.5);
    // What it claims along its worse axis: at most a few are more than three times as far off.
    std::size_t beyond = 0;
    for (std::size_t i = 0; i < claimed_m.size(); ++i)
      beyond += arrived.position_m[i] > 3 * claimed_m[i];
    EXPECT_LE(beyond, claimed_m.size() / 50);
  }
  void expect_as_promised() const {
    std::printf("%s%s%s", in_words("on arrival", arrived).c_str(),
                in_words("before", before).c_str(), in_words("after", after).c_str());
    EXPECT_LE(share(before.position_m, 0.95), 0.30);
    EXPECT_LE(share(before.heading_deg, 0.95), 1.5);
    EXPECT_LE(share(after.position_m, 0.95), 0.03);
    EXPECT_LE(share(after.heading_deg, 0.95), 0.1);
  }

  Errors arrived, before, after;
  std::vector<double> claimed_m;  // On arrival.

 private:
  test::TempFolder folder_;
};

bool nightly() {
  return std::getenv("VANTAGE_NIGHTLY") != nullptr;
}

// Where the robot scans: five stations a seed. What the walls of the map say of a scan counts as
// known before it is laid over the others.
TEST(FortPoses, OfTheRobotAreAsPromised) {
  Fort fort("skip");
  for (int seed = 1; seed <= (nightly() ? 50 : 2); ++seed) fort.run(seed);
  EXPECT_GE(fort.before.position_m.size(), 8U);
  fort.expect_as_promised();
}

// The same with a robot that looks ahead: the walls in sight keep its place on the way.
TEST(FortPoses, OfARobotThatLooksAheadAreAsPromisedOnArrival) {
  Fort fort("skip", "scout_looking.toml");
  for (int seed = 1; seed <= (nightly() ? 50 : 2); ++seed) fort.run(seed);
  EXPECT_GE(fort.arrived.position_m.size(), 8U);
  fort.expect_as_promised_on_arrival();
  fort.expect_as_promised();
}

// And with robots whose only eye is the scanner of their scans: a VLP-16, an Ouster.
class FortPosesOfScanner : public testing::TestWithParam<const char*> {};

TEST_P(FortPosesOfScanner, AreAsPromisedOnArrival) {
  if (!nightly()) GTEST_SKIP() << "takes half an hour: set VANTAGE_NIGHTLY";
  Fort fort("skip", GetParam());
  for (int seed = 1; seed <= 10; ++seed) fort.run(seed);
  EXPECT_GE(fort.arrived.position_m.size(), 8U);
  std::printf("%s", in_words("on arrival", fort.arrived).c_str());
  fort.expect_as_promised_on_arrival();
}

INSTANTIATE_TEST_SUITE_P(FortPoses, FortPosesOfScanner,
                         testing::Values("bunker_vlp16.toml", "scout_ouster.toml"),
                         [](const auto& param) {
                           const std::string name = param.param;
                           return name.substr(0, name.find('.'));
                         });

// All 27 stations, those of a person too, and all pairs together when the tour closes: ten seeds
// each, as one takes half a minute and more.
class FortTours : public testing::TestWithParam<int> {};

TEST_P(FortTours, PutAllScansWhereTheyAre) {
  if (!nightly()) GTEST_SKIP() << "takes half an hour: set VANTAGE_NIGHTLY";
  Fort fort("manual");
  for (int seed = 10 * GetParam() + 1; seed <= 10 * GetParam() + 10; ++seed) fort.run(seed);
  fort.expect_as_promised();
}

INSTANTIATE_TEST_SUITE_P(Tens, FortTours, testing::Range(0, 5));

}  // namespace
}  // namespace fort_poses_tests
