// Made-up yards whose maps are wrong: crates and barriers that no map shows, people who walk about.
#pragma once

#include <algorithm>
#include <vector>

#include "mission/plan.hpp"
#include "nav/polygons.hpp"
#include "nav/roadmap.hpp"
#include "sim/mesh.hpp"
#include "sim/people.hpp"
#include "tests/sim/room.hpp"
#include "tests/support/random_site.hpp"

namespace support {

struct YardSize {
  double side_min_m = 18, side_max_m = 32;
  int stations = 4, views_max = 2;
};

struct House {
  Eigen::Vector2d low_m, high_m;

  nav::Polygons outline() const {
    const Eigen::Vector2d size = high_m - low_m;
    return nav::normalise({rectangle_mm(low_m.x(), low_m.y(), size.x(), size.y())});
  }
  double distance_m(const Eigen::Vector2d& p) const {
    return (p - p.cwiseMax(low_m).cwiseMin(high_m)).norm();
  }
};

// A yard in which some things are mapped and others are not.
struct RandomYard {
  static constexpr double kRadiusM = 0.5;
  static inline const Eigen::Vector2d kStart{3, 3};

  double side_m;
  std::vector<House> mapped, unmapped;
  std::vector<sim::Person> people;
  mission::MissionConfig config;
  nav::SiteMap map;
  mission::SiteTasks tasks;
  sim::Mesh mesh = sim_test::plain(100);

  explicit RandomYard(std::uint64_t seed, const YardSize& size = {}) {
    Dice dice(seed);
    side_m = dice.uniform(size.side_min_m, size.side_max_m);
    add_things(dice, mapped, 1 + dice.below(4), 2, 8);
    add_things(dice, unmapped, dice.below(6), 0.3, 2.5);
    if (dice.below(3) == 0) add_barrier(dice);
    draw_map();
    add_people(dice, dice.below(5));
    configure(dice, seed, size);
    build();
  }

  void add_things(Dice& dice, std::vector<House>& to, int count, double low_m, double high_m) {
    for (int i = 0; i < count; ++i) {
      // Drawn one after the other: a compiler evaluates arguments in the order it likes.
      const double width_m = dice.uniform(low_m, high_m), length_m = dice.uniform(low_m, high_m);
      const Eigen::Vector2d size(length_m, width_m);
      const double y_m = dice.uniform(0, side_m - size.y()),
                   x_m = dice.uniform(0, side_m - size.x());
      const Eigen::Vector2d at(x_m, y_m);
      const House house{at, at + size};
      if (house.distance_m(kStart) > 2) to.push_back(house);
    }
  }

  // Across the yard, or most of it: what lies behind may be out of reach.
  void add_barrier(Dice& dice) {
    const double at_m = dice.uniform(6, side_m - 3), to_m = dice.uniform(0.5, 1.0) * side_m;
    const House along_y{{at_m, 0}, {at_m + 0.2, to_m}}, along_x{{0, at_m}, {to_m, at_m + 0.2}};
    unmapped.push_back(dice.below(2) == 0 ? along_y : along_x);
  }

  void draw_map() {
    map.name = "random";
    map.boundary = nav::normalise({rectangle_mm(0, 0, side_m, side_m)});
    for (const House& house : mapped) map.obstacles = nav::unite(map.obstacles, house.outline());
    nav::FreeArea area;
    area.name = area.region = "yard";
    area.drivable = nav::subtract(map.boundary, map.obstacles);
    area.standable = nav::offset(area.drivable, -nav::to_mm({kRadiusM, 0}).x);
    map.regions = {{"yard", area.drivable, 0}};
    tasks.tasks = {{area, mission::AreaMode::robot}};
    tasks.start = {kStart, 0};
    tasks.start_area = 0;
  }

  // They know what stands where, and go round it.
  void add_people(Dice& dice, int count) {
    nav::FreeArea truth = tasks.tasks[0].area;
    for (const House& house : unmapped)
      truth.drivable = nav::subtract(truth.drivable, house.outline());
    truth.standable = nav::offset(truth.drivable, -300);
    const nav::Roadmap roads = nav::Roadmap::build(truth, 0.3);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d from = random_point(dice, truth.standable, side_m);
      const auto route = roads.route(from, random_point(dice, truth.standable, side_m));
      if (!route || (from - kStart).norm() < 3) continue;
      people.push_back({.way_m = route->points_m,
                        .speed_mps = dice.uniform(0.6, 1.4),
                        .start_s = dice.uniform(0, 60)});
    }
  }

  void configure(Dice& dice, std::uint64_t seed, const YardSize& size) {
    config.name = "random";
    config.seed = seed;
    config.phase2 = {
        .height_m = 6, .height_max_m = 6, .gain_min_voxels = 30, .views_max = size.views_max};
    config.robot.scanner.azimuth_step_deg = config.robot.scanner.elevation_step_deg = 2;
    config.robot.scanner.range_max_m = 30;
    config.robot.scanner.scan_s = 10;
    for (int i = 0; i < size.stations; ++i) {
      const Eigen::Vector2d at = random_point(dice, tasks.tasks[0].area.standable, side_m);
      mission::SavedStation station;
      station.area = "yard";
      station.x_m = at.x();
      station.y_m = at.y();
      config.plan.stations.push_back(station);
    }
  }

  void build() {
    for (const House& house : mapped)
      sim_test::add_box(mesh, {house.low_m.x(), house.low_m.y(), 0},
                        {house.high_m.x(), house.high_m.y(), 4});
    for (const House& house : unmapped)
      sim_test::add_box(mesh, {house.low_m.x(), house.low_m.y(), 0},
                        {house.high_m.x(), house.high_m.y(), 1});
  }
};

}  // namespace support
