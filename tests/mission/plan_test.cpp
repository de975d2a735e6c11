// Phase I on the sites that ship, against every place where the scanner could stand.
#include "mission/plan.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>

#include "mission/check.hpp"
#include "mission/site_io.hpp"
#include "nav/polygons.hpp"
#include "nav/raster.hpp"
#include "planning/spans.hpp"

namespace mission {
namespace {

struct PlannedSite {
  MissionConfig config;
  std::vector<AreaPlan> plans;
};

PlannedSite plan_shipped(const std::string& name) {
  const auto file =
      std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs" / "missions" / (name + ".toml");
  const LoadedMission mission = load_mission(file);
  EXPECT_TRUE(mission.errors.empty());
  const MissionConfig& config = mission.config;
  const nav::RepairedSite site =
      nav::repair_site(load_site(config.site_folder).raw, config.margin_m);
  const auto areas = nav::free_areas(site.map, config.robot.body.radius_m, kFreeAreaMinM2);
  const SiteTasks tasks = assign_areas(config, site.map, areas);
  PlannedSite planned{config, {}};
  for (std::size_t t = 0; t < tasks.tasks.size(); ++t)
    if (tasks.tasks[t].mode != AreaMode::skip)
      planned.plans.push_back(
          plan_area(config, site.map, tasks.tasks[t], std::nullopt, config.seed + t, 2).plan);
  return planned;
}

// One station a square metre: closer together than any gap that matters.
std::vector<planning::Candidate> everywhere(const nav::FreeArea& area) {
  Eigen::AlignedBox2d box;
  for (const nav::SegmentMm& edge : nav::edges(area.standable)) box.extend(nav::to_m(edge.a));
  const nav::RasterGrid grid{box.min(), 1.0, static_cast<int>(box.sizes().x()) + 1,
                             static_cast<int>(box.sizes().y()) + 1};
  const auto inside = nav::rasterize(area.standable, grid);
  std::vector<planning::Candidate> stations;
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x)
      if (inside[grid.index(x, y)]) stations.push_back({nav::to_mm(grid.center_m(x, y)), 0});
  return stations;
}

class ShippedPlan : public testing::TestWithParam<std::string> {};

TEST_P(ShippedPlan, IsCoveredAlmostAsFarAsAnyReachableStationCould) {
  const double goal = GetParam() == "fort" ? 0.98 : 0.95;
  const PlannedSite site = plan_shipped(GetParam());
  ASSERT_FALSE(site.plans.empty());
  const ScannerConfig& scanner = site.config.robot.scanner;
  for (const AreaPlan& plan : site.plans) {
    const planning::Visibility visibility(
        plan.walls, {scanner.range_min_m, scanner.range_max_m, scanner.grazing_max_deg, 360});
    planning::SpanSet covered(plan.walls.size()), coverable(plan.walls.size());
    for (const planning::Station& station : plan.cover.stations)
      covered.add(planning::spans_of(station.sees));
    coverable.add(covered);
    const auto stations = everywhere(plan.area);
    for (const planning::Candidate& station : stations)
      coverable.add(planning::spans_of(visibility.from(station)));
    const double share =
        static_cast<double>(covered.total_nm()) / static_cast<double>(coverable.total_nm());
    std::printf("%s %s: %zu stations cover %.2f %% of what %zu could\n", GetParam().c_str(),
                plan.area.name.c_str(), plan.cover.stations.size(), 100 * share, stations.size());
    EXPECT_GE(share, goal) << plan.area.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Missions, ShippedPlan,
                         testing::Values("fort", "tower", "courtyard", "church", "museum"),
                         [](const auto& param) { return param.param; });

}  // namespace
}  // namespace mission
