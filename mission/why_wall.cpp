#include "mission/why_wall.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "mission/report_facts.hpp"
#include "nav/polygons.hpp"

namespace mission {
namespace {

using Eigen::Vector2d;
using planning::Wall;

const nav::FreeArea& area_of(const MissionConfig& config, const std::vector<AreaTask>& tasks,
                             const Vector2d& station_m) {
  for (const AreaTask& task : tasks)
    if (nav::contains(task.area.standable, nav::to_mm(station_m))) return task.area;
  throw std::invalid_argument(
      fmt::format("the station ({}, {}) m is not in the free space of a robot of radius {} m; move "
                  "it away from obstacles and keep-outs",
                  station_m.x(), station_m.y(), config.robot.body.radius_m));
}

// The place on the wall that is nearest to the point, in metres from its end a.
double nearest_along_m(const Wall& wall, const Vector2d& point_m) {
  const Vector2d a = nav::to_m(wall.a), b = nav::to_m(wall.b);
  const double length_m = (b - a).norm();
  return length_m > 0 ? std::clamp((point_m - a).dot(b - a) / length_m, 0.0, length_m) : 0;
}

struct Place {
  std::size_t wall{};
  double along_m{};
  double off_m = std::numeric_limits<double>::infinity();
};

Place nearest(const std::vector<Wall>& walls, const Vector2d& point_m) {
  Place best;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const double along_m = nearest_along_m(walls[i], point_m);
    const double off_m = (wall_point_m(walls[i], along_m) - point_m).norm();
    if (off_m < best.off_m) best = {i, along_m, off_m};
  }
  if (best.off_m > kWallReachM)
    throw std::invalid_argument(fmt::format(
        "no wall within {} m of ({}, {}) m{}", kWallReachM, point_m.x(), point_m.y(),
        walls.empty() ? "; the map has none"
                      : fmt::format("; the nearest, {:.2f} m away, is at ({:.2f}, {:.2f})",
                                    best.off_m, wall_point_m(walls[best.wall], best.along_m).x(),
                                    wall_point_m(walls[best.wall], best.along_m).y())));
  return best;
}

}  // namespace

WallAnswer why_wall(const MissionConfig& config, const nav::SiteMap& map,
                    const std::vector<AreaTask>& tasks, const Vector2d& wall_m,
                    const hal::Pose2& station) {
  const nav::FreeArea& area = area_of(config, tasks, station.position_m);
  std::vector<Wall> walls = planning::walls_of(map, area);
  const Place place = nearest(walls, wall_m);
  WallAnswer answer;
  answer.area = area.name;
  answer.wall = walls[place.wall];
  answer.at_m = wall_point_m(answer.wall, place.along_m);
  answer.off_m = place.off_m;
  walls[place.wall].target = true;  // So that it is explained in any case.
  answer.why = planning::why_wall(planning::Visibility(walls, sensor_limits(config.robot.scanner)),
                                  static_cast<int>(place.wall), place.along_m,
                                  {nav::to_mm(station.position_m), station.heading_rad});
  if (answer.why.occluder) answer.blocker = walls[static_cast<std::size_t>(*answer.why.occluder)];
  return answer;
}

std::string WallAnswer::in_words() const {
  std::string out = fmt::format("({:.2f}, {:.2f}) is {}covered from there", at_m.x(), at_m.y(),
                                why.excluded ? "not " : "");
  out += fmt::format(" (range {:.2f} m, {:.1f} deg from the wall's normal): {}", why.distance_m,
                     why.angle_deg, planning::text(why));
  if (blocker)
    out += fmt::format("; that wall runs from ({:.2f}, {:.2f}) to ({:.2f}, {:.2f})",
                       nav::to_m(blocker->a).x(), nav::to_m(blocker->a).y(),
                       nav::to_m(blocker->b).x(), nav::to_m(blocker->b).y());
  if (!wall.target) out += "; the wall asked for does not count for coverage";
  return out;
}

}  // namespace mission
