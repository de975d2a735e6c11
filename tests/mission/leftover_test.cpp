#include "mission/leftover.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "mission/report.hpp"
#include "mission/site_model.hpp"
#include "mission/summary.hpp"
#include "tests/planning/voxel_oracle.hpp"
#include "tests/support/sample_record.hpp"
#include "tests/support/survey_site.hpp"

namespace mission {
namespace {

namespace json = boost::json;

Leftover sample_leftover(std::uint32_t optimistic_voxels) {
  Leftover left;
  left.certificate.pessimistic = planning::BestView{3, 7};
  left.certificate.optimistic = planning::BestView{4, optimistic_voxels};
  left.certificate.threshold_voxels = 100;
  left.optimistic_at_m = Eigen::Vector2d(3.5, -2.5);
  left.never_visible[static_cast<std::size_t>(planning::ViewVerdict::faces_away)] = 30;
  left.never_visible[static_cast<std::size_t>(planning::ViewVerdict::blocked)] = 12;
  return left;
}

TEST(Leftover, SaysWhetherTheStopIsProven) {
  EXPECT_EQ(in_words(sample_leftover(99)),
            "proven: even if everything unseen were air, no view would see more than 99 unseen "
            "voxels of the box");
  Leftover foliage = sample_leftover(99);
  foliage.foliage = true;
  EXPECT_EQ(in_words(foliage), "not proven: what hides voxels now may turn out to be foliage");
  EXPECT_EQ(in_words(sample_leftover(100)),
            "not proven: if everything unseen were air, 100 unseen voxels would be seen from "
            "(3.5, -2.5)");
}

TEST(Leftover, IsInTheSummaryBesideTheFiguresThatItCorrects) {
  RunRecord run = test::sample_record();
  EXPECT_TRUE(json::value(summarise(run, {})).at("leftover").is_null());
  EXPECT_TRUE(json::value(summarise(run, {})).at("density").is_null());
  run.leftover = sample_leftover(100);
  run.density = {50, 1000, 800};
  const json::value summary = summarise(run, {});
  const VoxelCounts& counts = run.scans.back().after;
  const auto number = [&](const char* path) {
    return summary.at_pointer(path).to_number<double>();
  };
  EXPECT_EQ(number("/leftover/never_visible_voxels"), 42);
  EXPECT_EQ(number("/leftover/never_visible_by_reason/faces_away"), 30);
  EXPECT_EQ(number("/leftover/never_visible_by_reason/blocked"), 12);
  EXPECT_EQ(number("/leftover/boundary_unseen_visible_voxels"),
            static_cast<double>(counts.boundary_unseen) - 42);
  const auto occupied = static_cast<double>(counts.seen_occupied);
  const auto boundary = static_cast<double>(counts.boundary_unseen);
  EXPECT_NEAR(number("/leftover/seen_of_frontier"), occupied / (occupied + boundary), 1e-5);
  EXPECT_NEAR(number("/leftover/seen_of_visible_frontier"), occupied / (occupied + boundary - 42),
              1e-5);
  EXPECT_FALSE(summary.at_pointer("/leftover/proven").as_bool());
  EXPECT_EQ(number("/density/reached_of_surface"), 0.8);
  EXPECT_EQ(summary.at_pointer("/voxels/boundary_unseen").to_number<std::uint64_t>(),
            counts.boundary_unseen)
      << "an extra figure, not instead";
}

TEST(Leftover, IsToldInTheReport) {
  RunRecord run = test::sample_record();
  EXPECT_EQ(leftover_text(run), "");
  run.leftover = sample_leftover(12);
  run.density = {50, 1000, 800};
  const std::string html = report_html(run, {});
  for (const char* said : {"No cell can see 42 of the", "mast or a drone",
                           "30 are facing away from every cell, 12 are hidden from every cell.",
                           "proven: even if everything unseen were air",
                           "800 of 1,000 surface voxels have the 50 points per m2"})
    EXPECT_NE(html.find(said), std::string::npos) << said;
}

// Phase II with a model of a site and boxes for a world, until no view is worth it.
struct SmallSurvey {
  support::SurveySite site;
  worlds::Random random{7};
  SiteModel model;

  explicit SmallSurvey(double density_min_ppm2 = 0, int gain_min_voxels = 5)
      : site(36,
             {{{10, 10, 0}, {18, 14, 6}}, {{22, 20, 0}, {26, 30, 5}}, {{8, 24, 0}, {11, 27, 8}}}),
        model((site.config.phase2.density_min_ppm2 = density_min_ppm2,
               site.config.phase2.gain_min_voxels = gain_min_voxels, site.config),
              site.map, site.tasks.tasks, 2) {}

  void scan(double x_m, double y_m) {
    const Eigen::Isometry3d T_W_S = site.scanner_at(x_m, y_m);
    model.add(site.scan(T_W_S, random), {}, T_W_S, 0);
  }
  // The next best view; false: none is worth it.
  bool refine() {
    const std::vector<NextView> views = model.next_views();
    if (views.empty()) return false;
    take(views.front(), [this](double x_m, double y_m) { scan(x_m, y_m); });
    return true;
  }
  template <class Scan>
  void take(const NextView& view, const Scan& scan_at) {
    model.exclude(view.cell.voxel);
    model.expect(view);
    scan_at(view.pose.position_m.x(), view.pose.position_m.y());
    model.settle();
  }
};

TEST(Leftover, NoLaterViewOfARealSurveySeesMoreThanTheCertificateAllows) {
  SmallSurvey survey;
  // Of the same scans, with a threshold that nothing reaches: its certificate has the maximum.
  SmallSurvey most(0, 1'000'000'000);
  const auto scan_with_both = [&](double x_m, double y_m) {
    survey.scan(x_m, y_m);
    most.scan(x_m, y_m);
  };
  scan_with_both(3.5, 3.5);
  std::uint32_t bound = UINT32_MAX;
  int views = 0;
  while (true) {
    const planning::StopCertificate certificate = survey.model.leftover().certificate;
    const std::vector<NextView> next = survey.model.next_views();
    EXPECT_EQ(certificate.pessimistic_max(), survey.model.best_voxels());
    EXPECT_LE(certificate.pessimistic_max(), bound) << "after " << views << " views";
    EXPECT_LE(certificate.optimistic_voxels(), bound) << "scans only ever take from it";
    bound = std::min(bound, most.model.leftover().certificate.optimistic_voxels());
    EXPECT_TRUE(!certificate.proven() || next.empty());
    if (next.empty()) break;
    survey.take(next.front(), scan_with_both);
    ++views;
  }
  EXPECT_GT(views, 3);
}

TEST(Leftover, NeverVisibleIsWhatNoCellSeesByTheLiteralLoop) {
  SmallSurvey survey;
  survey.scan(3.5, 3.5);
  while (survey.refine()) {
  }
  const planning::VoxelMap& map = survey.model.map();
  const planning::ViewLimits limits = view_limits(survey.site.config.robot.scanner);
  std::uint64_t never = 0;
  for (const planning::BoundaryVoxel& u : oracle::boundary_unseen(map)) {
    const Eigen::Vector3d center_m = map.grid().center_m(u.v);
    if (center_m.head<2>().minCoeff() < 0 || center_m.head<2>().maxCoeff() > 36) continue;
    bool seen = false;
    for (const ViewCell& cell : survey.model.cells())
      seen = seen || (map.at(cell.voxel) == planning::VoxelState::seen_empty &&
                      oracle::counts_geometrically(u, cell.voxel, limits, map.grid().voxel_m) &&
                      oracle::visible(map, u.v, cell.voxel));
    never += !seen;
  }
  EXPECT_GT(never, 20U) << "three roofs";
  EXPECT_EQ(survey.model.leftover().never_visible_voxels(), never);
}

TEST(DensityGoal, MakesViewsBringThinSurfacesToTheGoalAndThenEnds) {
  SmallSurvey without, with(30);
  int more = 0;
  for (SmallSurvey* survey : {&without, &with}) {
    survey->scan(3.5, 3.5);
    while (survey->refine()) more += survey == &with ? 1 : -1;
  }
  EXPECT_GT(more, 0);
  EXPECT_EQ(without.model.density().goal_ppm2, 0);
  const DensityFacts facts = with.model.density();
  EXPECT_GT(facts.reached_voxels * 10, facts.surface_voxels * 6);
}

// Every scan so far on every surface voxel, anew each time.
TEST(DensityGoal, IsReachedWhereSomeScanPutsAsMuchAsTheMapStands) {
  SmallSurvey survey;  // For its world only.
  planning::VoxelMap map(survey.model.map().grid());
  const ScannerConfig& scanner = survey.site.config.robot.scanner;
  constexpr double kGoal = 25;
  DensityGoal goal(scanner, kGoal, 2), restored(scanner, kGoal, 1);
  std::vector<DensityGoal::PastScan> scans;
  std::map<planning::Voxel, float> at_its_time;
  int later = 0;
  planning::InsertConfig insert;
  insert.range_max_m = scanner.range_max_m;
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(3.5, 3.5), {20.5, 5.5}, {14.5, 30.5}, {33.5, 33.5}, {33.5, 20.5}}) {
    const Eigen::Isometry3d T_W_S = survey.site.scanner_at(at.x(), at.y());
    const hal::ScanCloud scan = survey.site.scan(T_W_S, survey.random);
    map.insert(scan, T_W_S, insert);
    goal.add(map, scan.pattern, T_W_S);
    scans.push_back({scan.pattern, T_W_S});
    const auto surface = planning::surface_voxels(map);
    std::map<planning::Voxel, float> best;
    for (const auto& [pattern, pose] : scans) {
      const auto density =
          planning::scan_density(map, surface, pattern, pose, view_limits(scanner));
      for (std::size_t i = 0; i < surface.size(); ++i) {
        best[surface[i].v] = std::max(best[surface[i].v], density[i]);
        if (&pose == &scans.back().T_W_S)
          at_its_time[surface[i].v] = std::max(at_its_time[surface[i].v], density[i]);
      }
    }
    std::vector<planning::BoundaryVoxel> thin;
    for (const planning::BoundaryVoxel& u : surface) {
      if (best[u.v] < static_cast<float>(kGoal)) thin.push_back(u);
      later += best[u.v] >= static_cast<float>(kGoal) && at_its_time[u.v] < kGoal;
    }
    ASSERT_EQ(goal.thin(), thin);
    EXPECT_EQ(goal.facts().surface_voxels, surface.size());
    EXPECT_EQ(goal.facts().reached_voxels, surface.size() - thin.size());
  }
  EXPECT_GT(goal.thin().size(), 100U);
  EXPECT_GT(later, 5) << "faces that were laid open after the scan that suffices for them";
  restored.restore(map, scans, {});
  EXPECT_EQ(restored.thin(), goal.thin()) << "map and scans are all there is to it";
}

TEST(DensityGoal, GivesUpOnAVoxelAfterTwoViewsThatShouldHaveBroughtItThere) {
  SmallSurvey survey;
  planning::VoxelMap map({{0, 0, 0}, 1.0, 20, 3, 3});
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z) map.set({x, y, z}, planning::VoxelState::seen_empty);
  map.set({10, 1, 1}, planning::VoxelState::seen_occupied);
  ScannerConfig scanner;
  DensityGoal goal(scanner, 1000, 1);
  const hal::ScanPattern coarse = worlds::sphere(20, 20);  // Much coarser than the config says.
  const Eigen::Isometry3d pose = worlds::upright({4.5, 1.5, 1.5}, 0);
  goal.add(map, coarse, pose);
  for (int tries = 0; tries < 2; ++tries) {
    ASSERT_EQ(goal.thin().size(), 1U) << tries;
    goal.expect(goal.in_sight(map, {4, 1, 1}));
    goal.add(map, coarse, pose);
    EXPECT_EQ(goal.settle(), 0U);
  }
  EXPECT_TRUE(goal.thin().empty());
  EXPECT_EQ(goal.facts().reached_voxels, 0U) << "given up, not reached";
  const std::vector<planning::Voxel> aside{{10, 1, 1}};
  EXPECT_EQ(goal.set_aside(), aside);
  DensityGoal restored(scanner, 1000, 1);
  restored.restore(map, {{coarse, pose}}, aside);
  EXPECT_TRUE(restored.thin().empty());
}

}  // namespace
}  // namespace mission
