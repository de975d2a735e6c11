// A station behind a barrier that the map lacks: what it alone would have seen is seen from before
// the barrier.
#include <gmock/gmock.h>

#include <boost/json.hpp>
#include <fstream>
#include <set>

#include "tests/mission/box_model.hpp"
#include "tests/mission/killed_run.hpp"
#include "tests/mission/mission_site.hpp"

namespace replacement_mission_tests {
namespace {

using testing::HasSubstr;

// A yard of 40 m x 10 m, a house in its middle, a barrier right across at x = 30 m, and stations
// west, north and east of the house, the last one behind the barrier.
class BlockedYard {
 public:
  explicit BlockedYard(double barrier_to_m = 10.5)
      : site_(mission_test::kQuickRobot + "[obstacles]\ndevice = \"hokuyo\"\n") {
    write("footprint.geojson",
          R"({"type":"FeatureCollection","features":[
          {"type":"Feature","properties":{"role":"boundary"},"geometry":{"type":"Polygon",
            "coordinates":[[[0,0],[40,0],[40,10],[0,10],[0,0]]]}},
          {"type":"Feature","properties":{},"geometry":{"type":"Polygon",
            "coordinates":[[[16,3],[22,3],[22,7],[16,7],[16,3]]]}},
          {"type":"Feature","properties":{"role":"start","heading_deg":0},
            "geometry":{"type":"Point","coordinates":[3,3]}}]})");
    model_.add(16, 3, 22, 7, 5);
    model_.add(30, -0.5, 30.3, barrier_to_m, 2);
    write("model.obj", model_.text());
    write("plan.toml",
          "[[station]]\narea = \"site\"\nname = \"west\"\nx_m = 6\ny_m = 5\n"
          "[[station]]\narea = \"site\"\nname = \"north\"\nx_m = 19\ny_m = 9\n"
          "[[station]]\narea = \"site\"\nname = \"east\"\nx_m = 36\ny_m = 5\n");
    write("mission.toml",
          "robot = \"robot.toml\"\nsite = \".\"\nplan = \"plan.toml\"\n[phase1]\ncandidates = 200\n"
          "[phase2]\nheight_m = 10.0\nheight_max_m = 10.0\ngain_min_voxels = 10\nviews_max = 0\n");
  }

  mission::RunOutcome run(bool resume = false) const {
    return resume ? site_.go_on() : site_.run();
  }
  std::string text(const std::string& product) const {
    std::ifstream file(site_.out() / product);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(site_.folder() / name) << text;
  }

  mission_test::SmallSite site_;
  mission_test::BoxModel model_;
};

TEST(ReplacedStation, IsScannedFromBeforeTheBarrier) {
  const BlockedYard yard;
  const mission::RunOutcome outcome = yard.run();
  const mission::RunRecord& record = outcome.record;
  ASSERT_TRUE(record.completed) << record.end;
  EXPECT_EQ(mission_test::scanned(record), (std::multiset<std::string>{"west", "north", "east a"}));
  ASSERT_EQ(record.dropped.size(), 1U);
  EXPECT_EQ(record.dropped[0].name, "east");
  ASSERT_TRUE(record.dropped[0].instead);
  // The house's east wall is 4 m long, and nothing else sees it.
  EXPECT_NEAR(record.dropped[0].instead->lost_m, 4, 0.05);
  EXPECT_LT(record.dropped[0].instead->left_m, 0.8);
  EXPECT_EQ(record.dropped[0].instead->stations, std::vector<std::string>{"east a"});
  for (const mission::ScanRecord& scan : record.scans) {
    if (scan.name != "east a") continue;
    EXPECT_LT(scan.believed.position_m.x(), 30);
    EXPECT_GT(scan.believed.position_m.x(), 22);
    EXPECT_GT(scan.adds_m, 3);
  }
  // Where people look for it.
  EXPECT_THAT(yard.text("decisions.jsonl"), HasSubstr(R"("decision":"replace","name":"east")"));
  const auto summary = boost::json::parse(yard.text("summary.json"));
  EXPECT_EQ(summary.at("dropped").at(0).at("instead").at("stations").at(0), "east a");
  EXPECT_THAT(yard.text("report.html"), HasSubstr("of wall that nothing else sees"));
}

TEST(ReplacedStation, IsNotLookedForWhereTheRoadIsOpen) {
  const BlockedYard yard(7);
  const mission::RunOutcome outcome = yard.run();
  EXPECT_EQ(mission_test::scanned(outcome.record),
            (std::multiset<std::string>{"west", "north", "east"}));
  EXPECT_THAT(yard.text("decisions.jsonl"), testing::Not(HasSubstr("replace")));
}

TEST(ReplacedStation, IsStillToBeScannedAfterACut) {
  const BlockedYard yard;
  ASSERT_TRUE(mission_test::killed_at_file("0003.beams.part", [&] { return yard.run(); }));
  EXPECT_THAT(yard.text("decisions.jsonl"), HasSubstr(R"("decision":"replace")"));
  const mission::RunOutcome outcome = yard.run(true);
  ASSERT_TRUE(outcome.record.completed) << outcome.record.end;
  EXPECT_EQ(outcome.record.resumed, 1);
  EXPECT_EQ(mission_test::scanned(outcome.record),
            (std::multiset<std::string>{"west", "north", "east a"}));
  ASSERT_EQ(outcome.record.dropped.size(), 1U);
  ASSERT_TRUE(outcome.record.dropped[0].instead);
  EXPECT_EQ(outcome.record.dropped[0].instead->stations, std::vector<std::string>{"east a"});
}

}  // namespace
}  // namespace replacement_mission_tests
