// Shapes and building parts from which the sites are put together. Metres; angles in degrees,
// counter-clockwise from x.
#pragma once

#include <string>
#include <vector>

#include "tools/make_sites_model.hpp"

namespace sites {

Path rectangle(double x0, double y0, double x1, double y1);
// A regular polygon; the first corner lies at phase_deg.
Path regular(Eigen::Vector2d center, double radius, int corners, double phase_deg = 0);
// pieces + 1 points from from_deg to to_deg, both included.
Path arc(Eigen::Vector2d center, double radius, double from_deg, double to_deg, int pieces);
Path joined(const std::vector<Path>& paths);
Path reversed(Path path);
// Every edge of a counter-clockwise ring moved outward by distance (inward when negative), corners
// mitred: as many corners as before.
Path moved_edges(const Path& ring, double distance);
// Turned about the origin, then shifted.
Path placed(const Path& path, double turn_deg, Eigen::Vector2d shift = {0, 0});
Path3 at_height(const Path& path, double z);

// The frame of something turned about the vertical axis and set down on the ground.
Eigen::Isometry3d turned(double turn_deg, Eigen::Vector3d shift = {0, 0, 0});
// A frame whose x axis runs from a to b, whose y axis is up, and whose z axis points to the right
// of a -> b. Shapes in it are elevations: (distance along the wall, height).
Eigen::Isometry3d elevation_frame(Eigen::Vector2d a, Eigen::Vector2d b);

// A row of equal openings in a wall panel, centred on the panel.
struct Openings {
  int count{};
  double spacing{};
  double width{};
  double sill_z{};
  double head_z{};
};
std::vector<Path> window_holes(double panel_length, const Openings& openings);

// Adds solids of one named part, in a frame of its own.
class Part {
 public:
  Part(Model& model, std::string name, Eigen::Isometry3d T_W_part = Eigen::Isometry3d::Identity())
      : model_(&model), name_(std::move(name)), T_W_part_(T_W_part) {}

  void prism(const Shape& plan, double z0, double z1) const;
  void box(double x0, double y0, double x1, double y1, double z0, double z1) const;
  // From the plan at z0 to another with equally many corners at z1; further steps may follow.
  struct Level {
    Shape plan;
    double z{};
  };
  void taper(const std::vector<Level>& levels) const;
  // An upright slab: the elevation (s along a -> b, z), thickness to the right of a -> b.
  void panel(const Shape& elevation, Eigen::Vector2d a, Eigen::Vector2d b, double thickness) const;
  // Roofs over x0..x1, y0..y1: two slopes with the ridge along x or y, or four slopes.
  void gable_x(double x0, double y0, double x1, double y1, double eaves_z, double ridge_z) const;
  void gable_y(double x0, double y0, double x1, double y1, double eaves_z, double ridge_z) const;
  void hip(double x0, double y0, double x1, double y1, double eaves_z, double ridge_z) const;
  void column(Eigen::Vector2d center, double radius, int corners, double z0, double z1) const;
  void cone(Eigen::Vector2d center, double radius, int corners, double z0, double apex_z) const;
  void dome(Eigen::Vector2d center, double radius, int corners, double z0, double height) const;
  void sections(const std::vector<Section>& part_sections) const;

 private:
  Model* model_;
  std::string name_;
  Eigen::Isometry3d T_W_part_;
};

}  // namespace sites
