// Plan files: what is read back is what was written, and mistakes are told with their place.
#include "mission/plan_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "mission/check.hpp"

namespace mission {
namespace {

using testing::HasSubstr;

SavedPlan random_plan(unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> metres(-1e5, 1e5), degrees(-180, 180);
  SavedPlan plan;
  plan.site = "St. \"Anne\" \\ église";
  plan.made_by = "a test";
  plan.seed = random() >> 1;
  for (int i = 0; i < 40; ++i) {
    SavedStation station;
    station.area = i % 3 == 0 ? "yard" : "yard/2";
    if (i % 5 != 0) station.name = "place " + std::to_string(i);
    station.x_m = metres(random);
    station.y_m = metres(random);
    station.heading_deg = degrees(random);
    plan.stations.push_back(station);
  }
  return plan;
}

TEST(PlanFile, ReadsBackWhatItWroteBitForBit) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const SavedPlan plan = random_plan(seed);
    MissionConfig config;
    const ConfigReading reading = read_plan(plan_text(plan), "plan.toml", config);
    ASSERT_TRUE(reading.errors.empty()) << reading.errors[0].text();
    EXPECT_EQ(config.plan.site, plan.site);
    EXPECT_EQ(config.plan.made_by, plan.made_by);
    EXPECT_EQ(config.plan.seed, plan.seed);
    ASSERT_EQ(config.plan.stations.size(), plan.stations.size());
    for (std::size_t i = 0; i < plan.stations.size(); ++i) {
      EXPECT_EQ(config.plan.stations[i].area, plan.stations[i].area);
      EXPECT_EQ(config.plan.stations[i].name, plan.stations[i].name);
      EXPECT_EQ(config.plan.stations[i].x_m, plan.stations[i].x_m);
      EXPECT_EQ(config.plan.stations[i].y_m, plan.stations[i].y_m);
      EXPECT_EQ(config.plan.stations[i].heading_deg, plan.stations[i].heading_deg);
    }
  }
}

TEST(PlanFile, TellsMistakesWithTheirPlace) {
  const struct {
    const char* text;
    const char* error;
  } kBroken[] = {
      {"", "p.toml:1:1: the plan has no [[station]]"},
      {"[[station]]\narea = \"a\"\nx_m = 1\n", "p.toml:1:1: the station has no 'y_m'"},
      {"seed = 1\n\n[[station]]\nname = \"n\"\nx_m = 1\ny_m = 2\n",
       "p.toml:3:1: station 'n' has no 'area'"},
      {"[[station]]\narea = \"a\"\nx = 1\ny_m = 2\n",
       "p.toml:3:1: unknown key 'x'; did you mean 'x_m' (in m)?"},
      {"[station]\narea = \"a\"\n", "'station' must be tables, found a table; write [[station]]"},
      {"[[stations]]\narea = \"a\"\n", "did you mean [station]?"},
      {"[[station]]\narea = \"a\"\nx_m = \"1\"\ny_m = 2\n",
       "p.toml:3:7: 'x_m' must be a number from -1000000 to 1000000 m, found text '1'"},
      {"[[station]]\narea = \"a\"\nname = \"n\"\nx_m = 1\ny_m = 2\n"
       "[[station]]\narea = \"a\"\nname = \"n\"\nx_m = 1\ny_m = 2\n",
       "p.toml:6:1: two stations are named 'n'"},
  };
  for (const auto& broken : kBroken) {
    MissionConfig config;
    const ConfigReading reading = read_plan(broken.text, "p.toml", config);
    ASSERT_FALSE(reading.errors.empty()) << broken.text;
    EXPECT_THAT(reading.errors[0].text(), HasSubstr(broken.error)) << broken.text;
  }
}

// A yard of 20 x 20 m in region "yard", and another beside it.
std::vector<nav::FreeArea> two_yards() {
  const auto square = [](std::int64_t x0) -> nav::Polygons {
    return {{{{x0, 0}, {x0 + 20'000, 0}, {x0 + 20'000, 20'000}, {x0, 20'000}}, {}}};
  };
  return {{"yard", "yard", 0, square(0), square(0)},
          {"moat", "moat", 0, square(30'000), square(30'000)}};
}

TEST(PlanFile, StationsMustStandInTheAreaThatTheyName) {
  MissionConfig config;
  const std::string text =
      "[[station]]\narea = \"yard\"\nx_m = 10\ny_m = 10\n"
      "[[station]]\narea = \"yard\"\nx_m = 25\ny_m = 10\n"
      "[[station]]\narea = \"yard\"\nname = \"wet\"\nx_m = 40\ny_m = 10\n"
      "[[station]]\narea = \"moat\"\nx_m = 40\ny_m = 11\n";
  ASSERT_TRUE(read_plan(text, "p.toml", config).errors.empty());
  auto errors = check_plan(config, two_yards());
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_THAT(errors[0].text(), HasSubstr("p.toml:5:1: the station at (25.000, 10.000) m does not "
                                          "stand in the free space"));
  EXPECT_THAT(errors[1].text(), HasSubstr("p.toml:9:1: station 'wet' at (40.000, 10.000) m stands "
                                          "in area 'moat', not in 'yard'"));
  config.regions["moat"] = "skip";
  errors = check_plan(config, two_yards());
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_THAT(errors[2].text(), HasSubstr("which the mission skips"));
}

}  // namespace
}  // namespace mission
