// A square yard with houses on it, drawn as a map and made of boxes: for tests that need a
// mission's model of a site without a whole mission.
#pragma once

#include <vector>

#include "mission/plan.hpp"
#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "tests/support/random_site.hpp"
#include "tests/support/voxel_worlds.hpp"

namespace support {

struct SurveySite {
  mission::MissionConfig config;
  nav::SiteMap map;
  mission::SiteTasks tasks;
  worlds::World world;

  // The yard reaches from (0, 0) to (side_m, side_m); the robot starts at (2, 2).
  explicit SurveySite(double side_m, const std::vector<worlds::Box>& houses) {
    world.boxes = houses;
    config.phase2.height_m = 12;
    config.robot.scanner.range_max_m = 40;
    config.robot.scanner.azimuth_step_deg = 1;
    config.robot.scanner.elevation_step_deg = 1;
    map.boundary = nav::normalise({rectangle_mm(0, 0, side_m, side_m)});
    std::vector<nav::Ring> rings;
    for (const worlds::Box& house : houses)
      rings.push_back(rectangle_mm(house.min_m.x(), house.min_m.y(),
                                   house.max_m.x() - house.min_m.x(),
                                   house.max_m.y() - house.min_m.y()));
    map.obstacles = nav::normalise(rings);
    nav::FreeArea area;
    area.name = area.region = "yard";
    area.drivable = nav::subtract(map.boundary, map.obstacles);
    area.standable = nav::offset(area.drivable, -nav::to_mm({config.robot.body.radius_m, 0}).x);
    tasks.tasks = {{area, mission::AreaMode::robot}};
    tasks.start = {{2, 2}, 0};
    tasks.start_area = 0;
  }

  Eigen::Isometry3d scanner_at(double x_m, double y_m) const {
    return worlds::upright({x_m, y_m, config.robot.scanner.height_m}, 0);
  }
  hal::ScanCloud scan(const Eigen::Isometry3d& T_W_S, worlds::Random& random) const {
    return world.scan(worlds::sphere(1, 1), T_W_S, config.robot.scanner.range_max_m, random);
  }
};

}  // namespace support
