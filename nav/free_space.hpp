// Where the robot may be: per region, and per connected part of it.
#pragma once

#include <string>
#include <vector>

#include "nav/geometry.hpp"
#include "nav/site_map.hpp"

namespace nav {

// One connected part of the free space in one region.
struct FreeArea {
  std::string name;    // The region's name; with "/2", "/3" ... for further parts.
  std::string region;  // The region it belongs to.
  double ground_z_m{};
  Polygons drivable;   // Region minus obstacles and keep-outs, not inflated.
  Polygons standable;  // Drivable eroded by the robot's radius: where its centre may be.
};

// Splits every region of the map into its connected standable parts, largest first, in the order of
// the regions; parts below area_min_m2 are left out. Parts of one region that a robot of no size
// could drive between share their `drivable`.
std::vector<FreeArea> free_areas(const SiteMap& map, double robot_radius_m, double area_min_m2);

// Index of the area in whose standable part the point lies, or -1.
int area_at(const std::vector<FreeArea>& areas, PointMm point);

// Names of the regions in which the robot can stand nowhere.
std::vector<std::string> regions_without_area(const SiteMap& map,
                                              const std::vector<FreeArea>& areas);

}  // namespace nav
