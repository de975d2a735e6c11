#include "nav/free_space.hpp"

#include <algorithm>

#include "nav/polygons.hpp"

namespace nav {
namespace {

std::vector<Polygon> largest_first(Polygons polygons) {
  std::stable_sort(polygons.begin(), polygons.end(),
                   [](const Polygon& a, const Polygon& b) { return area_m2({a}) > area_m2({b}); });
  return polygons;
}

// The part of `drivable` that the component was eroded from.
Polygons part_around(const Polygons& drivable, const Polygon& component) {
  for (const Polygon& part : drivable) {
    const bool all = std::all_of(component.outer.begin(), component.outer.end(),
                                 [&](PointMm p) { return contains({part}, p); });
    if (all) return {part};
  }
  return {};
}

}  // namespace

std::vector<FreeArea> free_areas(const SiteMap& map, double robot_radius_m, double area_min_m2) {
  const auto radius_mm = static_cast<std::int64_t>(std::ceil(robot_radius_m * 1000));
  const Polygons forbidden = unite(map.obstacles, map.keep_out);
  std::vector<FreeArea> areas;
  for (const Region& region : map.regions) {
    const Polygons drivable = subtract(intersect(region.area, map.boundary), forbidden);
    int part = 0;
    for (const Polygon& component : largest_first(offset(drivable, -radius_mm))) {
      if (area_m2({component}) < area_min_m2) break;
      ++part;
      const std::string name = part == 1 ? region.name : region.name + "/" + std::to_string(part);
      areas.push_back(
          {name, region.name, region.ground_z_m, part_around(drivable, component), {component}});
    }
  }
  return areas;
}

int area_at(const std::vector<FreeArea>& areas, PointMm point) {
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (contains(areas[i].standable, point)) return static_cast<int>(i);
  }
  return -1;
}

std::vector<std::string> regions_without_area(const SiteMap& map,
                                              const std::vector<FreeArea>& areas) {
  std::vector<std::string> without;
  for (const Region& region : map.regions) {
    const bool has = std::any_of(areas.begin(), areas.end(),
                                 [&](const FreeArea& area) { return area.region == region.name; });
    if (!has) without.push_back(region.name);
  }
  return without;
}

}  // namespace nav
