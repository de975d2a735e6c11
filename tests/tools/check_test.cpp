// `vantage check` and `vantage keys`: what they print where, and their exit codes.
#include <gmock/gmock.h>

#include <algorithm>

#include "mission/config_schema.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

namespace fs = std::filesystem;
using test::read_text;
using testing::HasSubstr;
using testing::IsEmpty;

class Vantage : public test::VantageTest {
 protected:
  // A yard of 40 x 40 m with a hut in it and a pond around a corner; the hut's first corner twice.
  void write_site(const std::string& folder) const {
    write(folder + "/footprint.geojson", R"({"type": "FeatureCollection", "features": [
 {"type": "Feature", "properties": {"role": "boundary"}, "geometry": {"type": "Polygon",
  "coordinates": [[[0, 0], [40, 0], [40, 40], [0, 40], [0, 0]]]}},
 {"type": "Feature", "properties": {"role": "obstacle", "name": "hut"}, "geometry": {"type": "Polygon",
  "coordinates": [[[10, 10], [10, 10], [14, 10], [14, 14], [10, 14], [10, 10]]]}},
 {"type": "Feature", "properties": {"role": "region", "name": "yard"}, "geometry": {"type": "Polygon",
  "coordinates": [[[0, 0], [40, 0], [40, 40], [0, 40], [0, 0]]]}}]}
)");
  }
};

TEST_F(Vantage, CheckSaysWhatAGoodMissionWillUseOnOneScreen) {
  write_site("yard");
  write("crawler.toml", "[scanner]\nrange_max_m = 42\n");
  const auto mission = write("m.toml", "robot = 'crawler.toml'\nsite = 'yard'\nseed = 9\n");
  const auto outcome = run("check " + mission.string());
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_THAT(outcome.out, HasSubstr("m.toml: fine"));
  EXPECT_THAT(outcome.out, HasSubstr("seed 9*"));
  EXPECT_THAT(outcome.out, HasSubstr("range_max_m 42*"));
  EXPECT_THAT(outcome.out, HasSubstr("candidates 1000,"));
  EXPECT_THAT(outcome.out, HasSubstr("room to stand: yard "));
  EXPECT_LE(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 40);
}

TEST_F(Vantage, CheckReportsErrorsOfMissionRobotAndSiteInOneRunOnStderr) {
  write_site("yard");
  write("crawler.toml", "[scanner]\nrange_max = 42\n");
  const auto mission = write(
      "m.toml", "robot = 'crawler.toml'\nsite = 'yard'\nseeed = 9\n[regions]\nyrad = 'robot'\n");
  const auto outcome = run("check " + mission.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, HasSubstr("m.toml:3:1: unknown key 'seeed'; did you mean 'seed'?\n"));
  EXPECT_THAT(outcome.err, HasSubstr("crawler.toml:2:1: unknown key 'range_max'; did you mean "
                                     "'range_max_m' (in m)?\n"));
  EXPECT_THAT(outcome.err, HasSubstr("m.toml:5:1: the map has no region 'yrad'; did you mean "
                                     "'yard'?\n"));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 3);
}

TEST_F(Vantage, CheckNamesARobotThatItsDevicesCannotBe) {
  write_site("yard");
  write("fast.toml", "[scanner]\nazimuth_step_deg = 1.0\nelevation_step_deg = 0.5\n");
  const auto mission = write("m.toml", "robot = 'fast.toml'\nsite = 'yard'\n");
  const auto outcome = run("check " + mission.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("fast.toml: this field of view needs the pan unit to turn"));
  EXPECT_THAT(outcome.err, HasSubstr("turn more slowly by a smaller azimuth_step_deg"));
}

TEST_F(Vantage, CheckAsJsonHoldsErrorsRepairsValuesAndAreas) {
  write_site("yard");
  const auto mission = write("m.toml", "site = 'yard'\nseed = 9\n");
  const auto outcome = run("check --json " + mission.string());
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const auto json = boost::json::parse(outcome.out);
  EXPECT_TRUE(json.at("ok").as_bool());
  EXPECT_TRUE(json.at("errors").as_array().empty());
  EXPECT_EQ(json.at("areas").at(0).at("region").as_string(), "yard");
  EXPECT_NEAR(json.at("areas").at(0).at("area_m2").to_number<double>(), 39 * 39 - 25 + 0.2, 0.5);
  const auto& values = json.at("values").as_array();
  const auto seed = std::find_if(values.begin(), values.end(), [](const auto& value) {
    return value.at("key").as_string() == "seed";
  });
  ASSERT_NE(seed, values.end());
  EXPECT_EQ(seed->at("value").as_string(), "9");
  EXPECT_THAT(std::string(seed->at("origin").as_string()), HasSubstr("m.toml:2"));

  const auto broken = run("check --json " + write("b.toml", "site = 'nowhere'\n").string());
  EXPECT_EQ(broken.code, 2);
  const auto errors = boost::json::parse(broken.out).at("errors").as_array();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].at("line").to_number<int>(), 1);
  EXPECT_EQ(errors[0].at("column").to_number<int>(), 1);
}

TEST_F(Vantage, CheckTakesTheSiteAndTheSeedFromTheCommandLine) {
  write_site("yard");
  const auto mission = write("m.toml", "");
  EXPECT_EQ(run("check " + mission.string()).code, 2);
  const auto site = (folder_.path() / "yard").string();
  const auto outcome = run("check --seed 77 --site " + site + " " + mission.string());
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("seed 77*"));
}

TEST_F(Vantage, CheckRefusesABrokenMap) {
  const auto mission = write("m.toml", "site = 'yard'\n");
  write("yard/footprint.geojson", "{\"type\": \"FeatureCollection\", \"features\": [");
  const auto outcome = run("check " + mission.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("footprint.geojson:1:"));
}

TEST_F(Vantage, EveryShippedMissionThatNamesASiteIsFine) {
  const auto missions = fs::path(VANTAGE_SOURCE_DIR) / "configs/missions";
  int checked = 0;
  for (const auto& entry : fs::directory_iterator(missions)) {
    const auto text = read_text(entry.path());
    if (entry.path().extension() != ".toml" || text.find("\nsite = ") == std::string::npos)
      continue;
    const auto outcome = run("check " + entry.path().string());
    EXPECT_EQ(outcome.code, 0) << entry.path() << "\n" << outcome.err;
    ++checked;
  }
  EXPECT_GE(checked, 5);
}

TEST_F(Vantage, CoverJudgesThePlanOfEveryArea) {
  write_site("yard");
  const auto mission = write("m.toml", "site = 'yard'\n[phase1]\ncandidates = 60\n");
  const auto outcome = run("cover --exact-s 30 " + mission.string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::istringstream text(outcome.out);
  std::string heading, area;
  std::getline(text, heading);
  EXPECT_THAT(heading, HasSubstr("CBC at least"));
  int greedy = 0, refined = 0, at_least = 0, exact = 0, exact_at_least = 0;
  ASSERT_TRUE(text >> area >> greedy >> refined >> at_least >> exact >> exact_at_least);
  EXPECT_EQ(area, "yard");
  EXPECT_GE(greedy, refined);
  EXPECT_GE(refined, exact);
  EXPECT_GE(exact, exact_at_least);
  EXPECT_GE(exact, at_least);
  EXPECT_GE(at_least, 2);  // Nobody sees a hut from all sides at once.
  EXPECT_EQ(run("cover nowhere.toml").code, 2);
}

TEST_F(Vantage, HelpHasExamplesAndWrongUseIsTold) {
  const auto help = run("--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("vantage check configs/missions/fort.toml"));
  EXPECT_EQ(run("check --help").code, 0);
  const auto nothing = run("");
  EXPECT_EQ(nothing.code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("--help"));
  EXPECT_EQ(run("chek x.toml").code, 2);
  EXPECT_EQ(run("check").code, 2);
  EXPECT_EQ(run("check --seed -3 x.toml").code, 2);
}

TEST_F(Vantage, KeysPrintsTheReference) {
  const auto outcome = run("keys");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out, mission::config_reference());
}

}  // namespace
