// The roads of one area as the mission knows them now: the map's, less the obstacles met since.
#pragma once

#include <vector>

#include "nav/free_space.hpp"
#include "nav/roadmap.hpp"

namespace mission {

class Roads {
 public:
  Roads(nav::FreeArea area, double robot_radius_m);

  // Obstacles that the map lacks, as squares around their centres. The roadmap is built anew
  // without them, so that roads lead round them.
  void close(const std::vector<Eigen::Vector2d>& centers_m, double side_m);

  const nav::FreeArea& area() const { return area_; }
  const nav::Roadmap& roadmap() const { return roadmap_; }

 private:
  nav::FreeArea area_;
  double robot_radius_m_;
  nav::Roadmap roadmap_;
};

}  // namespace mission
