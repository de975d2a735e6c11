// What a scanner that does not see all around is to look at, with a density goal and foliage too.
#include <gtest/gtest.h>

#include <algorithm>

#include "mission/site_model.hpp"
#include "mission/view_times.hpp"
#include "planning/best_heading.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/survey_site.hpp"

namespace mission {
namespace {

// A yard of 36 m with three houses and a hedge, scanned from two places.
struct NarrowSurvey {
  support::SurveySite site;
  worlds::Random random{7};
  std::vector<DensityGoal::PastScan> scans;
  SiteModel model;

  explicit NarrowSurvey(double fov_deg)
      : site(36,
             {{{10, 10, 0}, {18, 14, 6}}, {{22, 20, 0}, {26, 30, 5}}, {{8, 24, 0}, {11, 27, 8}}}),
        model(configured(fov_deg), site.map, site.tasks.tasks, 2) {
    scan(3.5, 3.5);
    scan(30.5, 8.5);
  }
  const MissionConfig& configured(double fov_deg) {
    site.config.robot.scanner.fov_deg = fov_deg;
    site.config.phase2.density_min_ppm2 = 30;
    site.config.phase2.foliage = true;
    site.config.phase2.gain_min_voxels = 10;
    return site.config;
  }
  void scan(double x_m, double y_m) {
    const Eigen::Isometry3d T_W_S = site.scanner_at(x_m, y_m);
    hal::ScanCloud cloud = site.scan(T_W_S, random);
    worlds::grow_bush(cloud, T_W_S, {{4, 16, 0}, {20, 17, 3}}, 0.1, random);
    model.add(cloud, {}, T_W_S, 0);
    scans.push_back({cloud.pattern, T_W_S});
  }
};

// Who counts for a cell, from the definitions.
std::vector<planning::Voxel> worth_from(const SiteModel& model, const MissionConfig& config,
                                        const std::vector<planning::BoundaryVoxel>& thin,
                                        const planning::Voxel& p) {
  const planning::VoxelMap& map = model.planner_map();
  std::vector<planning::Voxel> voxels;
  const auto add = [&](const std::vector<planning::BoundaryVoxel>& all,
                       const planning::ViewLimits& limits) {
    for (const planning::BoundaryVoxel& u : all)
      if (oracle::counts_geometrically(u, p, limits, map.grid().voxel_m) &&
          oracle::visible(map, u.v, p))
        voxels.push_back(u.v);
  };
  add(model.worth_seeing(), view_limits(config.robot.scanner));
  add(thin, view_limits(config.robot.scanner, config.phase2.density_min_ppm2));
  return voxels;
}

// Surface voxels that no scan puts enough points on, asked scan by scan.
std::vector<planning::BoundaryVoxel> thin_of(const NarrowSurvey& survey) {
  const planning::VoxelMap& map = survey.model.planner_map();
  std::vector<planning::BoundaryVoxel> thin =
      oracle::exposed(map, planning::VoxelState::seen_occupied);
  for (const auto& [pattern, T_W_S] : survey.scans) {
    const auto density = planning::scan_density(map, thin, pattern, T_W_S,
                                                view_limits(survey.site.config.robot.scanner));
    std::size_t i = 0;
    std::erase_if(thin, [&](const planning::BoundaryVoxel&) { return density[i++] >= 30; });
  }
  return thin;
}

TEST(SiteFacing, CountsWhatTheBestHeadingOfEachCellShows) {
  for (const double fov_deg : {60.0, 190.0, 360.0}) {
    NarrowSurvey survey(fov_deg);
    const std::vector<planning::BoundaryVoxel> thin = thin_of(survey);
    ASSERT_GT(thin.size(), 50U);
    const planning::HorizontalView view(fov_deg);
    const std::vector<CellTally> cells = survey.model.faced_tally();
    std::uint32_t best = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      best = std::max(best, cells[i].voxels);
      if (i % 37 != 0) continue;
      const planning::Voxel& p = cells[i].cell.voxel;
      const auto worth = worth_from(survey.model, survey.site.config, thin, p);
      ASSERT_EQ(cells[i].voxels, view.best(p, worth).seen) << fov_deg << ", cell " << i;
    }
    const std::vector<NextView> views = survey.model.next_views();
    ASSERT_FALSE(views.empty());
    EXPECT_EQ(views.front().voxels, best);
    EXPECT_EQ(survey.model.best_voxels(), best);
    const auto first = std::ranges::find(cells, best, &CellTally::voxels);
    EXPECT_EQ(views.front().cell.voxel, first->cell.voxel) << "ties to the lowest index";
    const auto ahead = survey.model.views_ahead(survey.model.last_tally(), 3);
    ASSERT_EQ(ahead.size(), 3U);
    EXPECT_EQ(ahead.front().cell.voxel, views.front().cell.voxel);
    EXPECT_EQ(ahead.front().heading_rad, views.front().pose.heading_rad);
    EXPECT_EQ(ahead.front().sees_voxels, best);
  }
}

// A map and what the run kept beside it are enough to go on where it ended.
TEST(SiteFacing, IsTheSameInAModelThatIsTakenUpAgain) {
  NarrowSurvey survey(100);
  const std::vector<NextView> first = survey.model.next_views();
  ASSERT_FALSE(first.empty());
  survey.model.exclude(first.front().cell.voxel);
  EXPECT_GT(survey.model.foliage().size(), 5U);
  SiteModel again(survey.site.config, survey.site.map, survey.site.tasks.tasks, 1,
                  survey.model.map());
  again.exclude(first.front().cell.voxel);
  again.restore(survey.model.foliage(), survey.scans, survey.model.thin_set_aside());
  EXPECT_EQ(again.planner_map(), survey.model.planner_map());
  EXPECT_EQ(again.foliage(), survey.model.foliage());
  EXPECT_EQ(again.density().reached_voxels, survey.model.density().reached_voxels);
  const std::vector<NextView> next = survey.model.next_views(), same = again.next_views();
  ASSERT_EQ(next.size(), same.size());
  for (std::size_t i = 0; i < next.size(); ++i) {
    EXPECT_EQ(next[i].cell.voxel, same[i].cell.voxel);
    EXPECT_EQ(next[i].pose.heading_rad, same[i].pose.heading_rad);
    EXPECT_EQ(next[i].voxels, same[i].voxels);
  }
}

// "gain_per_minute" looks into headings as far as it must, and finds what facing every view would.
TEST(SiteFacing, LeavesNoViewOutWhoseRateMightBeTheBest) {
  NarrowSurvey survey(75);
  survey.site.config.robot.scanner.scan_s = 5;
  survey.site.config.robot.body.speed_max_mps = 0.2;
  const nav::Roadmap roads = nav::Roadmap::build(survey.site.tasks.tasks[0].area, 0.5);
  int beyond = 0;
  for (const Eigen::Vector2d& robot_m : {Eigen::Vector2d(3, 3), {30, 30}, {20, 17}, {4, 30}}) {
    const ViewTimes times(survey.site.config, survey.site.tasks, &roads, robot_m);
    std::vector<NextView> views = survey.model.next_views(), all = views;
    ASSERT_GT(std::ranges::count(views, false, &NextView::faced), 20);
    for (NextView& view : all)
      if (!view.faced) survey.model.face(view);
    std::size_t best = all.size();
    double best_rate = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double rate = 60.0 * all[i].voxels / times.takes_s(all[i]);
      if (all[i].voxels >= 10 && rate > best_rate) best = i, best_rate = rate;
    }
    ASSERT_LT(best, all.size());
    beyond += !views[best].faced;
    const auto chosen = choose(
        views, times, true, [&](NextView& view) { survey.model.face(view); }, 10);
    ASSERT_TRUE(chosen);
    EXPECT_EQ(chosen->voxels_per_min, best_rate);
    EXPECT_EQ(chosen->view, best);
    EXPECT_EQ(views[best].pose.heading_rad, all[best].pose.heading_rad);
    EXPECT_TRUE(std::ranges::any_of(views, [](const NextView& view) { return !view.faced; }))
        << "facing all is what it is to spare";
  }
  EXPECT_GT(beyond, 0) << "views that the choice by gain had no need to face";
}

struct Left {
  double minutes{};
  std::size_t boundary_unseen{};
};

// Houses at both ends of a yard, each hiding a little less than the last one at the other end: by
// gain the robot crosses the yard for every view.
struct TwoEnds {
  support::SurveySite site;
  worlds::Random random{5};
  nav::Roadmap roads;
  SiteModel model;
  Eigen::Vector2d robot_m{40, 40};
  int views = 0;
  double minutes = 0;
  std::vector<Left> left;

  TwoEnds()
      : site(80, houses()),
        roads(nav::Roadmap::build(site.tasks.tasks[0].area, 0.5)),
        model(configured(), site.map, site.tasks.tasks, 2) {
    scan();
  }
  static std::vector<worlds::Box> houses() {
    std::vector<worlds::Box> boxes;
    double half_m = 6;
    for (const double y_m : {10.0, 40.0, 70.0})
      for (const double x_m : {9.0, 71.0}) {
        boxes.push_back({{x_m - 3, y_m - half_m, 0}, {x_m + 3, y_m + half_m, 5}});
        half_m -= 0.5;
      }
    return boxes;
  }
  const MissionConfig& configured() {
    site.config.robot.scanner.range_max_m = 60;
    site.config.robot.scanner.scan_s = 30;
    site.config.robot.body.speed_max_mps = 0.5;
    site.config.phase2.gain_min_voxels = 40;
    return site.config;
  }
  void scan() {
    const Eigen::Isometry3d T_W_S = site.scanner_at(robot_m.x(), robot_m.y());
    model.add(site.scan(T_W_S, random), {}, T_W_S, 0);
  }
  void refine(bool per_minute) {
    while (true) {
      std::vector<NextView> next = model.next_views();
      const ViewTimes times(site.config, site.tasks, &roads, robot_m);
      const auto chosen = choose(next, times, per_minute);
      if (!chosen) return;
      const NextView view = next[chosen->view];
      minutes += chosen->takes_min.value();
      ++views;
      robot_m = view.pose.position_m;
      model.exclude(view.cell.voxel);
      model.expect(view);
      scan();
      model.settle();
      left.push_back({minutes, model.counts().boundary_unseen});
    }
  }
};

TEST(ChooseByRate, TakesFewerMinutesThanByGainWhereWorkLiesAtBothEnds) {
  TwoEnds by_gain, by_rate;
  by_gain.refine(false);
  by_rate.refine(true);
  EXPECT_GE(by_gain.views, 4);
  // The first time that it leaves no more unseen than the other does in the end.
  const std::size_t goal = by_gain.left.back().boundary_unseen;
  const auto as_much = std::ranges::find_if(
      by_rate.left, [&](const Left& after) { return after.boundary_unseen <= goal; });
  ASSERT_NE(as_much, by_rate.left.end());
  EXPECT_LT(as_much->minutes, 0.8 * by_gain.left.back().minutes)
      << by_gain.views << " views by gain, " << as_much - by_rate.left.begin() + 1 << " by rate";
}

}  // namespace
}  // namespace mission
