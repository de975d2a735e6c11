// A kerb that no map shows: where it is too high for the robot, it goes round it or does without
// what lies behind.
#include <gmock/gmock.h>

#include <fstream>
#include <set>

#include "tests/mission/box_model.hpp"
#include "tests/mission/mission_site.hpp"

namespace terrain_mission_tests {
namespace {

using testing::HasSubstr;

constexpr double kKerbM = 0.14, kKerbAtM = 16.5;

// A yard of 30 m x 8 m whose east lies 14 cm higher, up to y = to_m; a house stands there. A
// station in the west, and one behind the house.
class KerbYard {
 public:
  explicit KerbYard(double to_m, const std::string& body = "")
      : site_(mission_test::kQuickRobot + "[body]\n" + body) {
    write("footprint.geojson",
          R"({"type":"FeatureCollection","features":[
          {"type":"Feature","properties":{"role":"boundary"},"geometry":{"type":"Polygon",
            "coordinates":[[[0,0],[30,0],[30,8],[0,8],[0,0]]]}},
          {"type":"Feature","properties":{},"geometry":{"type":"Polygon",
            "coordinates":[[[24,3],[27,3],[27,5],[24,5],[24,3]]]}},
          {"type":"Feature","properties":{"role":"start","heading_deg":0},
            "geometry":{"type":"Point","coordinates":[3,4]}}]})");
    model_.add(24, 3, 27, 5, 5);
    model_.add(kKerbAtM, -1, 31, to_m, kKerbM);
    write("model.obj", model_.text());
    write("plan.toml",
          "[[station]]\narea = \"site\"\nname = \"near\"\nx_m = 12\ny_m = 4\n"
          "[[station]]\narea = \"site\"\nname = \"far\"\nx_m = 28.7\ny_m = 7\n");
    write("mission.toml",
          "robot = \"robot.toml\"\nsite = \".\"\nplan = \"plan.toml\"\nreturn_home = "
          "false\n[phase1]\ncandidates = 100\n"
          "[phase2]\nheight_m = 10.0\nheight_max_m = 10.0\ngain_min_voxels = 10\nviews_max = 0\n");
  }
  mission::RunRecord run() const { return site_.run().record; }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(site_.folder() / name) << text;
  }

  mission_test::SmallSite site_;
  mission_test::BoxModel model_;
};

TEST(Kerb, ThatIsTooHighIsNotCrossed) {
  const mission::RunRecord record = KerbYard(9).run();
  ASSERT_TRUE(record.completed) << record.end;
  EXPECT_EQ(mission_test::scanned(record).count("far"), 0U);
  ASSERT_GE(record.dropped.size(), 1U);
  EXPECT_EQ(record.dropped[0].name, "far");
  EXPECT_THAT(record.notes, testing::Contains(HasSubstr("the robot keeps off it")));
  for (const auto& leg_m : record.driven_m)
    for (const Eigen::Vector2d& at_m : leg_m) EXPECT_LT(at_m.x() + 0.5, kKerbAtM);
}

TEST(Kerb, ThatTheRobotCanClimbIsNone) {
  const mission::RunRecord record = KerbYard(9, "step_max_m = 0.2\n").run();
  EXPECT_EQ(mission_test::scanned(record), (std::multiset<std::string>{"near", "far"}));
  EXPECT_TRUE(record.dropped.empty());
  EXPECT_THAT(record.notes, testing::Not(testing::Contains(HasSubstr("keeps off it"))));
}

TEST(Kerb, WithAnEndIsGoneRound) {
  const mission::RunRecord record = KerbYard(5).run();
  EXPECT_EQ(mission_test::scanned(record), (std::multiset<std::string>{"near", "far"}));
  EXPECT_TRUE(record.dropped.empty());
  int beside = 0;
  for (const auto& leg_m : record.driven_m)
    for (const Eigen::Vector2d& at_m : leg_m)
      if (at_m.x() > kKerbAtM - 0.5 && at_m.x() < 22) {
        EXPECT_GT(at_m.y(), 5.4) << "at x = " << at_m.x();
        ++beside;
      }
  EXPECT_GE(beside, 5);
}

}  // namespace
}  // namespace terrain_mission_tests
