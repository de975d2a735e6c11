#include "mission/roads.hpp"

#include "nav/polygons.hpp"

namespace mission {

Roads::Roads(nav::FreeArea area, double robot_radius_m)
    : area_(std::move(area)),
      robot_radius_m_(robot_radius_m),
      roadmap_(nav::Roadmap::build(area_, robot_radius_m)) {}

void Roads::close(const std::vector<Eigen::Vector2d>& centers_m, double side_m) {
  if (centers_m.empty()) return;
  std::vector<nav::Ring> squares;
  for (const Eigen::Vector2d& center_m : centers_m) {
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(side_m / 2);
    const nav::PointMm low = nav::to_mm(center_m - half), high = nav::to_mm(center_m + half);
    squares.push_back({low, {high.x, low.y}, high, {low.x, high.y}});
  }
  const nav::Polygons obstacles = nav::normalise(squares);
  area_.drivable = nav::subtract(area_.drivable, obstacles);
  area_.standable = nav::offset(area_.drivable, -nav::to_mm({robot_radius_m_, 0}).x);
  roadmap_ = nav::Roadmap::build(area_, robot_radius_m_);
}

}  // namespace mission
