// Made-up sites for property tests and benchmarks: a walled yard full of buildings.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "nav/free_space.hpp"
#include "nav/polygons.hpp"

namespace support {

// The same numbers with every standard library, unlike std:: distributions.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  int below(int count) { return static_cast<int>(uniform(0, count)); }
  double gauss(double sigma) {  // Box and Muller.
    const double r = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    return sigma * r * std::cos(2 * M_PI * uniform(0, 1));
  }

 private:
  std::mt19937_64 engine_;
};

inline nav::Ring rectangle_mm(double x_m, double y_m, double width_m, double height_m) {
  return {nav::to_mm({x_m, y_m}), nav::to_mm({x_m + width_m, y_m}),
          nav::to_mm({x_m + width_m, y_m + height_m}), nav::to_mm({x_m, y_m + height_m})};
}

// A star-shaped outline with `corners` corners about a centre.
inline nav::Ring star_mm(Dice& dice, const Eigen::Vector2d& center_m, double radius_m,
                         int corners) {
  nav::Ring ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * M_PI * (i + dice.uniform(0, 0.7)) / corners;
    const double r = radius_m * dice.uniform(0.35, 1.0);
    ring.push_back(nav::to_mm(center_m + r * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  }
  return ring;
}

struct SiteSize {
  double side_m = 60;
  int obstacles = 25;
  double obstacle_radius_m = 6;
  int corners_max = 9;
};

// The free space of such a site; standable is eroded by radius_m (all parts of it).
inline nav::FreeArea random_area(Dice& dice, const SiteSize& size, double radius_m) {
  nav::Polygons buildings;
  for (int i = 0; i < size.obstacles; ++i) {
    const double y_m = dice.uniform(0, size.side_m), x_m = dice.uniform(0, size.side_m);
    const Eigen::Vector2d center(x_m, y_m);
    const int corners = 3 + dice.below(size.corners_max - 2);
    const double r = dice.uniform(0.3, 1.0) * size.obstacle_radius_m;
    buildings = nav::unite(buildings, {nav::Polygon{star_mm(dice, center, r, corners), {}}});
  }
  nav::FreeArea area;
  area.name = area.region = "random";
  area.drivable =
      nav::subtract({nav::Polygon{rectangle_mm(0, 0, size.side_m, size.side_m), {}}}, buildings);
  area.standable = nav::offset(area.drivable, -std::llround(radius_m * 1000));
  return area;
}

// A random point of the polygons, or of the side_m square if they are empty.
inline Eigen::Vector2d random_point(Dice& dice, const nav::Polygons& in, double side_m) {
  for (int tries = 0; tries < 10000; ++tries) {
    const double y_m = dice.uniform(0, side_m), x_m = dice.uniform(0, side_m);
    const Eigen::Vector2d p(x_m, y_m);
    if (nav::contains(in, nav::to_mm(p))) return p;
  }
  return {dice.uniform(0, side_m), dice.uniform(0, side_m)};
}

}  // namespace support
