// One site: its map as drawn, its model, and what to say about them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/make_sites_shapes.hpp"

namespace sites {

// One feature of the map. Rings are written as they stand here, with their faults.
struct Feature {
  std::string role;
  std::string name;
  std::vector<Path> rings;  // Polygon: outer, then holes.
  Path line;                // Target.
  std::optional<Eigen::Vector2d> point;
  std::optional<double> heading_deg;
  std::optional<double> ground_z_m;
  bool wall = false;
  bool left_open = false;  // The ring does not return to its first vertex.
};

struct Site {
  std::string name;
  std::string title;  // One line.
  std::string about;  // Markdown: dimensions, what is special.
  std::vector<Feature> features{};
  Model model{};

  void obstacle(const std::string& what, const Path& outline) {
    add("obstacle", what).rings = {outline};
  }
  void region(const std::string& what, const Shape& area, double ground_z_m);
  void boundary(const Path& outline, bool wall);
  void target(const std::string& what, const Path& line) { add("target", what).line = line; }
  void start(Eigen::Vector2d point, double heading_deg);
  Feature& add(const std::string& role, const std::string& what);
};

// File name below the output folder -> content.
using Files = std::map<std::string, std::string>;

void write_site(const Site& site, Files& files);
// The list of sites, for README.md of the folder.
std::string sites_readme(const std::vector<Site>& sites);

Site make_fort();
Site make_tower();
Site make_courtyard();
Site make_church();
Site make_museum();

}  // namespace sites
