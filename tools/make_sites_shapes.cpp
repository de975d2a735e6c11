#include "tools/make_sites_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sites {
namespace {

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

Eigen::Vector2d direction(double degrees) {
  return {std::cos(radians(degrees)), std::sin(radians(degrees))};
}

Eigen::Isometry3d lifted(double z) {
  return turned(0, {0, 0, z});
}

}  // namespace

Path rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

Path regular(Eigen::Vector2d center, double radius, int corners, double phase_deg) {
  Path path = arc(center, radius, phase_deg, phase_deg + 360, corners);
  path.pop_back();
  return path;
}

Path arc(Eigen::Vector2d center, double radius, double from_deg, double to_deg, int pieces) {
  Path path;
  for (int i = 0; i <= pieces; ++i) {
    path.push_back(center + radius * direction(from_deg + (to_deg - from_deg) * i / pieces));
  }
  return path;
}

Path joined(const std::vector<Path>& paths) {
  Path all;
  for (const Path& path : paths) all.insert(all.end(), path.begin(), path.end());
  return all;
}

Path reversed(Path path) {
  std::reverse(path.begin(), path.end());
  return path;
}

Path moved_edges(const Path& ring, double distance) {
  Path moved;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d in = (ring[i] - ring[(i + ring.size() - 1) % ring.size()]).normalized();
    const Eigen::Vector2d out = (ring[(i + 1) % ring.size()] - ring[i]).normalized();
    const Eigen::Vector2d bisector = Eigen::Vector2d(in.y() + out.y(), -in.x() - out.x());
    // |bisector| = 2 cos(half the turn), and the mitre is distance / cos(half the turn) long.
    moved.push_back(ring[i] + distance * 2 / bisector.squaredNorm() * bisector);
  }
  return moved;
}

Path placed(const Path& path, double turn_deg, Eigen::Vector2d shift) {
  Path result;
  for (const Eigen::Vector2d& p : path) {
    result.push_back(Eigen::Rotation2Dd(radians(turn_deg)) * p + shift);
  }
  return result;
}

Path3 at_height(const Path& path, double z) {
  Path3 result;
  for (const Eigen::Vector2d& p : path) result.emplace_back(p.x(), p.y(), z);
  return result;
}

Eigen::Isometry3d turned(double turn_deg, Eigen::Vector3d shift) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(radians(turn_deg), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = shift;
  return T;
}

Eigen::Isometry3d elevation_frame(Eigen::Vector2d a, Eigen::Vector2d b) {
  const Eigen::Vector2d along = (b - a).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear().col(0) = Eigen::Vector3d(along.x(), along.y(), 0);
  T.linear().col(1) = Eigen::Vector3d::UnitZ();
  T.linear().col(2) = Eigen::Vector3d(along.y(), -along.x(), 0);
  T.translation() = Eigen::Vector3d(a.x(), a.y(), 0);
  return T;
}

std::vector<Path> window_holes(double panel_length, const Openings& openings) {
  std::vector<Path> holes;
  for (int i = 0; i < openings.count; ++i) {
    const double s = panel_length / 2 + (i - (openings.count - 1) / 2.0) * openings.spacing;
    holes.push_back(rectangle(s - openings.width / 2, openings.sill_z, s + openings.width / 2,
                              openings.head_z));
  }
  return holes;
}

void Part::sections(const std::vector<Section>& part_sections) const {
  std::vector<Section> in_w = part_sections;
  for (Section& section : in_w) section.T_W_section = T_W_part_ * section.T_W_section;
  model_->loft(name_, in_w);
}

void Part::taper(const std::vector<Level>& levels) const {
  std::vector<Section> all;
  for (const Level& level : levels) all.push_back({level.plan, lifted(level.z)});
  sections(all);
}

void Part::prism(const Shape& plan, double z0, double z1) const {
  taper({{plan, z0}, {plan, z1}});
}

void Part::box(double x0, double y0, double x1, double y1, double z0, double z1) const {
  prism({rectangle(x0, y0, x1, y1), {}}, z0, z1);
}

void Part::panel(const Shape& elevation, Eigen::Vector2d a, Eigen::Vector2d b,
                 double thickness) const {
  const Eigen::Isometry3d T = elevation_frame(a, b);
  sections({{elevation, T}, {elevation, T * lifted(thickness)}});
}

void Part::gable_x(double x0, double y0, double x1, double y1, double eaves_z,
                   double ridge_z) const {
  const double width = y1 - y0;
  panel({{{0, eaves_z}, {width, eaves_z}, {width / 2, ridge_z}}, {}}, {x0, y0}, {x0, y1}, x1 - x0);
}

void Part::gable_y(double x0, double y0, double x1, double y1, double eaves_z,
                   double ridge_z) const {
  const double width = x1 - x0;
  panel({{{0, eaves_z}, {width, eaves_z}, {width / 2, ridge_z}}, {}}, {x0, y1}, {x1, y1}, y1 - y0);
}

void Part::hip(double x0, double y0, double x1, double y1, double eaves_z, double ridge_z) const {
  const double half = std::min(x1 - x0, y1 - y0) / 2;
  const Path ridge{{x0 + half, y0 + half},
                   {x1 - half, y0 + half},
                   {x1 - half, y1 - half},
                   {x0 + half, y1 - half}};
  taper({{{rectangle(x0, y0, x1, y1), {}}, eaves_z}, {{ridge, {}}, ridge_z}});
}

void Part::column(Eigen::Vector2d center, double radius, int corners, double z0, double z1) const {
  prism({regular(center, radius, corners, 180.0 / corners), {}}, z0, z1);
}

void Part::cone(Eigen::Vector2d center, double radius, int corners, double z0,
                double apex_z) const {
  const double phase = 180.0 / corners;
  taper({{{regular(center, radius, corners, phase), {}}, z0},
         {{regular(center, 0, corners, phase), {}}, apex_z}});
}

void Part::dome(Eigen::Vector2d center, double radius, int corners, double z0,
                double height) const {
  std::vector<Level> levels;
  for (int i = 0; i <= 6; ++i) {
    const Eigen::Vector2d d = direction(15.0 * i);
    const double r = i == 6 ? 0 : radius * d.x();
    levels.push_back({{regular(center, r, corners, 180.0 / corners), {}}, z0 + height * d.y()});
  }
  taper(levels);
}

}  // namespace sites
