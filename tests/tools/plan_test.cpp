// `vantage plan`: what it prints is what the library plans, and what an outsider would measure.
#include <gmock/gmock.h>

#include <cmath>

#include "mission/check_report.hpp"
#include "mission/plan_preview.hpp"
#include "planning/visibility.hpp"
#include "tests/support/xml_check.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

using test::Outcome;
using test::read_text;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Plan : public test::VantageTest {
 protected:
  // The same site through the library.
  struct Site {
    mission::MissionCheck check;
    mission::SiteTasks tasks;
    std::vector<mission::PlannedArea> areas;
  };
  static Site library(const std::string& folder, std::uint64_t seed) {
    Site site{mission::check_mission(
                  {}, {.site_folder = folder, .robot_file = {}, .has_seed = true, .seed = seed}),
              {},
              {}};
    site.tasks = mission::assign_areas(site.check.config, site.check.site.map, site.check.areas);
    site.areas =
        mission::plan_areas(site.check.config, site.check.site.map, site.tasks, /*threads=*/1);
    return site;
  }
};

TEST_F(Plan, IsTheLibrarysPlanStationByStation) {
  for (const std::string name : {"church", "courtyard", "tower"}) {
    const Outcome outcome = run("plan --json --seed 5 --site " + site(name));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto json = outcome.json();
    const Site own = library(site(name), 5);
    const auto& areas = json.at("areas").as_array();
    ASSERT_EQ(areas.size(), own.areas.size()) << name;
    for (std::size_t a = 0; a < areas.size(); ++a) {
      const mission::AreaPlan& plan = own.areas[a].plan;
      EXPECT_EQ(areas[a].at("name").as_string(), plan.area.name);
      EXPECT_EQ(areas[a].at("mode").as_string(), plan.mode);
      EXPECT_NEAR(areas[a].at("covered_m").to_number<double>(), plan.cover.covered_m, 0.002);
      EXPECT_NEAR(areas[a].at("tour_m").to_number<double>(), plan.tour_m, 0.001);
      const auto& stations = areas[a].at("stations").as_array();
      ASSERT_EQ(stations.size(), plan.tour.size());
      for (std::size_t i = 0; i < stations.size(); ++i) {
        const auto& own_station = plan.cover.stations[static_cast<std::size_t>(plan.tour[i])];
        EXPECT_EQ(stations[i].at("x_m").to_number<double>(),
                  nav::to_m(own_station.at.position).x());
        EXPECT_EQ(stations[i].at("y_m").to_number<double>(),
                  nav::to_m(own_station.at.position).y());
        EXPECT_NEAR(stations[i].at("adds_m").to_number<double>(), own_station.adds_m, 0.001);
        EXPECT_NEAR(stations[i].at("overlaps_m").to_number<double>(), own_station.overlaps_m,
                    0.001);
      }
    }
  }
}

// Every 2 cm of target wall asked by itself from each station that the command names.
TEST_F(Plan, WhatItCallsUncoveredIsUncoveredWhenEveryPlaceIsAsked) {
  const Outcome outcome = run("plan --json --site " + site("church"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = outcome.json();
  const auto& area = json.at("areas").at(0);
  const Site own = library(site("church"), 1);
  const auto& walls = own.areas[0].plan.walls;
  constexpr double kStepM = 0.02;
  std::vector<std::vector<std::uint8_t>> seen(walls.size());
  double target_m = 0, missed_m = 0;
  for (std::size_t w = 0; w < walls.size(); ++w)
    seen[w].resize(static_cast<std::size_t>(walls[w].length_m() / kStepM));
  for (const auto& station : area.at("stations").as_array()) {
    const Eigen::Vector2d at_m(station.at("x_m").to_number<double>(),
                               station.at("y_m").to_number<double>());
    for (const auto& piece : planning::visible_walls(
             {nav::to_mm(at_m), 0}, walls, mission::sensor_limits(own.check.config.robot.scanner)))
      for (std::size_t i = 0; i < seen[static_cast<std::size_t>(piece.wall)].size(); ++i) {
        const double place_m = (static_cast<double>(i) + 0.5) * kStepM;
        if (place_m >= piece.from_m && place_m <= piece.to_m)
          seen[static_cast<std::size_t>(piece.wall)][i] = 1;
      }
  }
  for (std::size_t w = 0; w < walls.size(); ++w) {
    if (!walls[w].target) continue;
    target_m += walls[w].length_m();
    for (const auto one : seen[w]) missed_m += one ? 0 : kStepM;
  }
  EXPECT_NEAR(area.at("target_m").to_number<double>(), target_m, 0.01);
  EXPECT_NEAR(target_m - area.at("covered_m").to_number<double>(), missed_m, 0.02 * target_m);
  double told_m = 0;
  for (const auto& piece : area.at("uncovered_over_0.5_m").as_array()) {
    EXPECT_GT(piece.at("length_m").to_number<double>(), 0.5);
    EXPECT_FALSE(piece.at("reason").as_string().empty());
    EXPECT_FALSE(piece.at("remedy").as_string().empty());
    told_m += piece.at("length_m").to_number<double>();
  }
  EXPECT_GT(told_m, 0);
  EXPECT_LE(told_m, target_m - area.at("covered_m").to_number<double>() + 0.01);
}

TEST_F(Plan, TimeAndBatteryFollowTheRobotFile) {
  const auto robot = write("r.toml",
                           "[scanner]\nscan_s = 60\n"
                           "[battery]\ncapacity_wh = 100\ndrive_w = 360\nscan_w = 36\n");
  const Outcome outcome =
      run("plan --json --site " + site("courtyard") + " --robot " + robot.string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = outcome.json();
  const auto& total = json.at("total");
  const double stations = total.at("stations").to_number<double>();
  const double drive_min = total.at("minutes").at("drive").to_number<double>();
  EXPECT_DOUBLE_EQ(total.at("minutes").at("scan").to_number<double>(), stations);
  // 1 m/s at most, with turns and slow places on top.
  EXPECT_GT(drive_min * 60, total.at("tour_m").to_number<double>());
  EXPECT_LT(drive_min * 60, 2 * total.at("tour_m").to_number<double>() + 60);
  const double used_wh = total.at("battery").at("used_wh").to_number<double>();
  EXPECT_NEAR(used_wh, drive_min / 60 * 360 + stations / 60 * 36, 0.05);
  EXPECT_NEAR(total.at("battery").at("share").to_number<double>(), used_wh / 100, 1e-3);
}

TEST_F(Plan, SavedAsTomlIsTouredAsItStands) {
  const auto saved = (folder_.path() / "plan.toml").string();
  const Outcome planned = run("plan --json --seed 3 --site " + site("church") + " --out " + saved);
  ASSERT_EQ(planned.code, 0) << planned.err;
  const auto mission =
      write("m.toml", "site = '" + site("church") + "'\nseed = 3\nplan = 'plan.toml'\n");
  const Outcome toured = run("plan --json --mission " + mission.string());
  ASSERT_EQ(toured.code, 0) << toured.err;
  EXPECT_EQ(planned.json().at("areas").at(0).at("stations"),
            toured.json().at("areas").at(0).at("stations"));
  EXPECT_EQ(planned.json().at("total").at("covered_m"), toured.json().at("total").at("covered_m"));
  EXPECT_THAT(std::string(toured.json().at("areas").at(0).at("end").as_string()),
              HasSubstr("The stations were given"));
}

TEST_F(Plan, AStationThatStandsInAWallIsRefusedWithItsLine) {
  write("plan.toml", "seed = 1\n[[station]]\narea = 'interior'\nx_m = 0\ny_m = 900\n");
  const auto mission = write("m.toml", "site = '" + site("church") + "'\nplan = 'plan.toml'\n");
  for (const std::string& command :
       {"plan --mission " + mission.string(), "check " + mission.string()}) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.code, 2) << command;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_THAT(outcome.err, HasSubstr("plan.toml:2:1: the station at (0.000, 900.000) m does not "
                                       "stand in the free space"));
  }
}

TEST_F(Plan, DrawsOneSelfContainedPicture) {
  const auto svg = (folder_.path() / "plan.svg").string();
  ASSERT_EQ(run("plan --site " + site("tower") + " --svg " + svg).code, 0);
  const std::string text = read_text(svg);
  EXPECT_EQ(test::XmlCheck::problem_in(text), "");
  EXPECT_THAT(text, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(text, Not(HasSubstr("var(")));  // Not every viewer knows variables,
  EXPECT_THAT(text, Not(HasSubstr("href")));  // and none should have to fetch anything.
  EXPECT_THAT(text, HasSubstr(">N</text>"));
  EXPECT_THAT(text, HasSubstr(" m</text>"));
}

TEST_F(Plan, ProvesHowFewStationsWouldDoAndNamesTheLinksThatHoldTheScansTogether) {
  const Outcome outcome = run("plan --json --bound cbc --bound-s 20 --site " + site("church"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = outcome.json();
  const auto& area = json.at("areas").at(0);
  const int stations = area.at("stations_planned").to_number<int>();
  const int at_least = area.at("stations_at_least").to_number<int>();
  EXPECT_GE(at_least, 2);
  EXPECT_LE(at_least, stations);
  EXPECT_LE(stations, area.at("stations_greedy").to_number<int>());
  EXPECT_LE(area.at("cbc").at("at_least").to_number<int>(), stations);
  EXPECT_GE(area.at("cbc").at("stations").to_number<int>(), at_least);
  const auto& overlap = area.at("overlap");
  int weak = 0;
  for (const auto& link : overlap.at("links").as_array()) weak += link.at("weak").as_bool();
  EXPECT_EQ(weak, overlap.at("weak_links").to_number<int>());
  EXPECT_EQ(overlap.at("parts").to_number<int>(), 1);
}

TEST_F(Plan, TextNamesStationsTimeBatteryAndRemedies) {
  const Outcome outcome = run("plan --site " + site("church"));
  EXPECT_EQ(outcome.code, 0);
  for (const char* part : {"church: ", "interior 1", "battery ", "drives ", "not covered"})
    EXPECT_THAT(outcome.out, HasSubstr(part));
}

TEST_F(Plan, RefusesWhatItCannotPlan) {
  const auto empty = (folder_.path() / "empty").string();
  std::filesystem::create_directories(empty);
  const struct {
    std::string arguments;
    std::string error;
  } kWrong[] = {
      {"plan", "give --site FOLDER"},
      {"plan --site " + empty, "footprint.geojson is missing"},
      {"plan --site " + empty + "/none", "does not exist"},
      {"plan --site " + site("church") + " --robot none.toml", "robot file 'none.toml'"},
      {"plan --site " + site("church") + " --mission none.toml", "mission file cannot be read"},
      {"plan --site " + site("church") + " --out plan.txt", "must end in .toml"},
      {"plan --site " + site("church") + " --svg " + empty + "/a/b.svg", "cannot write"},
  };
  for (const auto& wrong : kWrong) {
    const Outcome outcome = run(wrong.arguments);
    EXPECT_EQ(outcome.code, 2) << wrong.arguments;
    EXPECT_THAT(outcome.err, HasSubstr(wrong.error)) << wrong.arguments;
    const Outcome json = run(wrong.arguments + " --json");
    EXPECT_EQ(json.code, 2);
    EXPECT_FALSE(json.json().at("ok").as_bool());
    EXPECT_THAT(std::string(json.json().at("errors").at(0).at("message").as_string()),
                HasSubstr(wrong.error));
  }
}

}  // namespace
