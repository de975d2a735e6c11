// Pictures of the voxel map: the tally over the ground, and single layers. Pure.
#pragma once

#include <string>
#include <vector>

#include "mission/site_model.hpp"
#include "nav/site_map.hpp"
#include "planning/voxel_map.hpp"

namespace mission {

// A view marked on the heat map, numbered from 1.
struct MarkedView {
  Eigen::Vector2d at_m{0, 0};
  std::string tip;  // Text under the mouse.
};

// What every cell of the ground would see, with the views and the walls, as an SVG file.
struct HeatMap {
  std::string title, subtitle;
  planning::VoxelGrid grid;
  std::vector<CellTally> cells;  // Of several ground layers the highest count shows.
  std::vector<MarkedView> views;
  std::string views_are = "next best view";  // HTML, for the legend.
  std::vector<planning::Voxel> never_seen;   // Drawn as columns; may be empty.
};
std::string heat_map_svg(const nav::SiteMap& map, const HeatMap& heat);

// One layer of the map: unseen, seen-empty, seen-occupied and boundary unseen, as an SVG file. z
// must be inside the box.
std::string slice_svg(const planning::VoxelMap& map, int z, const std::string& title);

}  // namespace mission
