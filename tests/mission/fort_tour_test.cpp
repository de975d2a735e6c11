// The fort's tour on its roads against the shortest tour on the visibility graph: the ways between
// corners of the ground on which the robot can stand, which no way with the same clearance beats.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <queue>

#include "mission/check.hpp"
#include "mission/main_run.hpp"
#include "mission/plan.hpp"
#include "mission/site_io.hpp"
#include "nav/polygons.hpp"
#include "nav/segment_distance.hpp"
#include "planning/tour.hpp"
#include "tests/support/temp_folder.hpp"

namespace fort_tour_tests {
namespace {

using Eigen::Vector2d;

class VisibilityGraph {
 public:
  // The ground is exact to a millimetre or two: what only touches its border counts as inside.
  explicit VisibilityGraph(const nav::Polygons& ground) {
    const auto add = [&](const nav::Ring& ring) {
      const std::size_t n = ring.size();
      for (std::size_t i = 0; i < n; ++i) {
        const nav::PointMm a = ring[(i + n - 1) % n], b = ring[i], c = ring[(i + 1) % n];
        edges_.push_back({nav::to_m(b), nav::to_m(c)});
        if (nav::side(a, b, c) < 0) nodes_.push_back(nav::to_m(b));  // A way may bend there.
      }
    };
    for (const nav::Polygon& polygon : ground) {
      add(polygon.outer);
      for (const nav::Ring& hole : polygon.holes) add(hole);
    }
    corners_ = nodes_.size();
  }

  // From each place to each; infinite where no way leads.
  std::vector<std::vector<double>> lengths_m(const std::vector<Vector2d>& places_m) {
    nodes_.resize(corners_);
    nodes_.insert(nodes_.end(), places_m.begin(), places_m.end());
    links_.assign(nodes_.size(), {});
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (std::size_t j = i + 1; j < nodes_.size(); ++j)
        if (sees(nodes_[i], nodes_[j])) {
          const double length_m = (nodes_[i] - nodes_[j]).norm();
          links_[i].emplace_back(j, length_m);
          links_[j].emplace_back(i, length_m);
        }
    std::vector<std::vector<double>> all;
    for (std::size_t i = corners_; i < nodes_.size(); ++i) {
      const std::vector<double> from = search(i);
      all.emplace_back(from.begin() + static_cast<std::ptrdiff_t>(corners_), from.end());
    }
    return all;
  }

 private:
  struct Edge {
    Vector2d a, b;
  };

  bool sees(const Vector2d& p, const Vector2d& q) const {
    const Vector2d way = q - p;
    const double slack = 0.003 * way.norm();  // Square metres: 3 mm beside the line.
    const Vector2d low = p.cwiseMin(q), high = p.cwiseMax(q);
    for (const Edge& edge : edges_) {
      if (edge.a.x() < low.x() && edge.b.x() < low.x()) continue;
      if (edge.a.x() > high.x() && edge.b.x() > high.x()) continue;
      if (edge.a.y() < low.y() && edge.b.y() < low.y()) continue;
      if (edge.a.y() > high.y() && edge.b.y() > high.y()) continue;
      const double a = nav::cross2(way, edge.a - p), b = nav::cross2(way, edge.b - p);
      if ((a > -slack && b > -slack) || (a < slack && b < slack)) continue;
      const Vector2d along = edge.b - edge.a;
      const double s = nav::cross2(along, p - edge.a), t = nav::cross2(along, q - edge.a);
      const double own_slack = 0.003 * along.norm();
      if (!((s > -own_slack && t > -own_slack) || (s < own_slack && t < own_slack))) return false;
    }
    return true;
  }

  std::vector<double> search(std::size_t from) const {
    std::vector<double> length_m(nodes_.size(), std::numeric_limits<double>::infinity());
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    open.emplace(length_m[from] = 0, from);
    while (!open.empty()) {
      const auto [so_far_m, at] = open.top();
      open.pop();
      if (so_far_m > length_m[at]) continue;
      for (const auto& [to, piece_m] : links_[at])
        if (so_far_m + piece_m < length_m[to]) open.emplace(length_m[to] = so_far_m + piece_m, to);
    }
    return length_m;
  }

  std::vector<Vector2d> nodes_;
  std::size_t corners_{};
  std::vector<Edge> edges_;
  std::vector<std::vector<std::pair<std::size_t, double>>> links_;
};

TEST(VisibilityGraphOracle, KnowsTheWayRoundAHouse) {
  const auto square = [](int low_mm, int high_mm) {
    return nav::normalise(
        {nav::Ring{{low_mm, low_mm}, {high_mm, low_mm}, {high_mm, high_mm}, {low_mm, high_mm}}});
  };
  VisibilityGraph graph(nav::subtract(square(0, 10000), square(4000, 6000)));
  const auto lengths_m = graph.lengths_m({{1, 5}, {9, 5}, {9, 9}});
  EXPECT_NEAR(lengths_m[0][1], 2 * std::hypot(3, 1) + 2, 0.01);
  EXPECT_NEAR(lengths_m[1][2], 4, 0.01);
}

TEST(FortTour, IsWithinTenPercentOfTheShortestOnTheVisibilityGraph) {
  const auto file = std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs/missions/fort.toml";
  const mission::MissionConfig config = mission::load_mission(file).config;
  const nav::RepairedSite site =
      nav::repair_site(mission::load_site(config.site_folder).raw, config.margin_m);
  const auto areas = nav::free_areas(site.map, config.robot.body.radius_m, mission::kFreeAreaMinM2);
  const mission::SiteTasks tasks = mission::assign_areas(config, site.map, areas);
  ASSERT_GE(tasks.start_area, 0);
  const auto index = static_cast<std::size_t>(tasks.start_area);
  const mission::AreaPlan plan = mission::plan_area(config, site.map, tasks.tasks[index],
                                                    tasks.start.position_m, config.seed + index, 2)
                                     .plan;
  std::vector<Vector2d> places_m{tasks.start.position_m};
  for (const int s : plan.tour)
    places_m.push_back(nav::to_m(plan.cover.stations[static_cast<std::size_t>(s)].at.position));
  ASSERT_GE(places_m.size(), 5U);
  VisibilityGraph graph(plan.area.standable);
  const planning::Tour shortest = planning::solve_tour(
      {.cost = graph.lengths_m(places_m), .start = 0, .closed = config.return_home});
  ASSERT_TRUE(shortest.unreachable.empty());
  std::printf(
      "fort: %zu stations, tour %.1f m, shortest on the visibility graph %.1f m%s: %.1f %%\n",
      plan.tour.size(), plan.tour_m, shortest.cost, shortest.proven ? " (proven)" : "",
      100 * (plan.tour_m / shortest.cost - 1));
  EXPECT_GE(plan.tour_m, 0.98 * shortest.cost) << "a tour shorter than the shortest";
  EXPECT_LE(plan.tour_m, 1.10 * shortest.cost);
}

// What the wheels roll in a mission without next best views, home included, against the shortest
// tour through the places where the scans were to be taken.
TEST(FortTour, IsDrivenWithinTenPercentOfTheShortestOnTheVisibilityGraph) {
  const auto configs = std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs";
  const test::TempFolder folder;
  std::ofstream(folder.path() / "fort.toml")
      << "robot = \"" << (configs / "robots/scout_lms511.toml").string() << "\"\nsite = \""
      << (configs / "sites/fort").string()
      << "\"\n[regions]\ninner = \"robot\"\nouter = \"skip\"\nmoat = \"skip\"\n"
         "[phase1]\ncoverage_goal = 0.985\ngain_min = 0.005\n[phase2]\nviews_max = 0\n";
  mission::Prepared ready =
      mission::prepare(folder.path() / "fort.toml",
                       {.site_folder = {}, .robot_file = {}, .has_seed = false, .seed = 0},
                       mission::WorldUse::world);
  ASSERT_TRUE(ready.errors.empty());
  const mission::RunRecord record = mission::run_in_simulation(ready, {.out = folder.path() / "run",
                                                                       .judge_cells = {},
                                                                       .threads = 2,
                                                                       .progress = nullptr,
                                                                       .terminal = false})
                                        .record;
  ASSERT_TRUE(record.completed) << record.end;
  ASSERT_TRUE(record.dropped.empty());
  const Eigen::Vector2d start_m = record.map.start->position_m;
  std::vector<Vector2d> places_m{start_m};
  for (const mission::ScanRecord& scan : record.scans) places_m.push_back(scan.planned.position_m);
  ASSERT_GE(places_m.size(), 5U);
  VisibilityGraph graph(record.plans.at(0).area.standable);
  const planning::Tour shortest =
      planning::solve_tour({.cost = graph.lengths_m(places_m), .start = 0, .closed = true});
  std::printf(
      "fort: driven %.1f m, tour %.1f m, shortest on the visibility graph %.1f m: %.1f %%\n",
      record.driven_total_m, record.plans[0].tour_m, shortest.cost,
      100 * (record.driven_total_m / shortest.cost - 1));
  // The robot may end a leg a few centimetres before its goal.
  EXPECT_GE(record.driven_total_m, 0.98 * shortest.cost);
  EXPECT_LE(record.driven_total_m, 1.10 * shortest.cost);
}

}  // namespace
}  // namespace fort_tour_tests
