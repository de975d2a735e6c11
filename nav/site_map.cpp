#include "nav/site_map.hpp"

#include <algorithm>
#include <numbers>

#include "nav/outline_repair.hpp"
#include "nav/polygons.hpp"
#include "nav/targets.hpp"
#include "nav/words.hpp"

namespace nav {
namespace {

// A feature after repair.
struct Shape {
  const RawFeature* raw{};
  Polygons area;
  std::vector<Ring> lines;  // Of a target.
};

struct Bounds {
  PointMm min{kCoordinateMax, kCoordinateMax};
  PointMm max{-kCoordinateMax, -kCoordinateMax};
};

Bounds bounds_of(const Polygons& polygons) {
  Bounds bounds;
  for (const Polygon& polygon : polygons) {
    for (const PointMm p : polygon.outer) {
      bounds.min = {std::min(bounds.min.x, p.x), std::min(bounds.min.y, p.y)};
      bounds.max = {std::max(bounds.max.x, p.x), std::max(bounds.max.y, p.y)};
    }
  }
  return bounds;
}

bool meet(const Bounds& a, const Bounds& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y;
}

std::string_view word(Role role) {
  switch (role) {
    case Role::boundary:
      return "boundary";
    case Role::obstacle:
      return "obstacle";
    case Role::keep_out:
      return "keep_out";
    case Role::target:
      return "target";
    case Role::region:
      return "region";
    case Role::start:
      return "start";
  }
  return "?";
}

class SiteRepair {
 public:
  SiteRepair(const RawSite& raw, double margin_m) : raw_(raw), margin_m_(margin_m) {}

  RepairedSite run() {
    out_.map.name = raw_.name;
    for (const RawFeature& feature : raw_.features) shapes_.push_back(shape(feature));
    say_reversals();
    if (out_.errors.empty()) assemble();
    return std::move(out_);
  }

 private:
  void assemble() {
    out_.map.obstacles = united(Role::obstacle);
    out_.map.keep_out = united(Role::keep_out);
    make_boundary();
    if (!out_.errors.empty()) return;
    make_regions();
    make_targets();
    make_start();
  }

  void repaired(const RawFeature& feature, const std::string& what) {
    out_.repairs.push_back({feature.where, what});
  }

  void wrong(const RawFeature& feature, const std::string& what) {
    out_.errors.push_back(feature.where.empty() ? what : feature.where + ": " + what);
  }

  Shape shape(const RawFeature& feature) {
    Shape shape{&feature, {}, {}};
    RepairedOutline outline = repair_outline(feature.polygons_m);
    for (const std::string& what : outline.repairs) repaired(feature, what);
    for (const std::string& what : outline.reversals) reversals_.push_back({feature.where, what});
    for (const std::string& what : outline.errors) wrong(feature, what);
    shape.area = std::move(outline.area);
    int dropped = 0;
    for (const auto& line_m : feature.lines_m) {
      RepairedLine line = repair_line(line_m);
      if (!line.error.empty()) wrong(feature, line.error);
      if (line.line.empty() && line.error.empty()) ++dropped;
      if (!line.line.empty()) shape.lines.push_back(std::move(line.line));
    }
    if (dropped > 0)
      repaired(feature, counted(dropped, "line", "lines") + " without length; dropped");
    take_lines(shape);
    return shape;
  }

  // Whole maps run the other way round: say that once.
  void say_reversals() {
    constexpr std::size_t kOneByOneMax = 5;
    if (reversals_.size() > kOneByOneMax) {
      const std::string count = std::to_string(reversals_.size());
      reversals_ = {{raw_.name, count +
                                    " rings run the wrong way round (outlines are "
                                    "counter-clockwise, holes clockwise), first in " +
                                    reversals_.front().where + "; reversed"}};
    }
    out_.repairs.insert(out_.repairs.end(), reversals_.begin(), reversals_.end());
  }

  // Lines are targets; along obstacles they are thin walls; elsewhere they enclose nothing.
  void take_lines(Shape& shape) {
    const Role role = shape.raw->role;
    if (role == Role::target || shape.lines.empty()) return;
    if (role == Role::obstacle) {
      repaired(*shape.raw, "drawn as a line; taken as a wall " +
                               in_m(2e-3 * static_cast<double>(kLineWallHalfMm)) + " thick");
      shape.area = unite(shape.area, thicken(shape.lines, kLineWallHalfMm));
    } else {
      wrong(*shape.raw, "a " + std::string(word(role)) + " is drawn as a line; draw a polygon");
    }
    shape.lines.clear();
  }

  std::vector<const Shape*> with_role(Role role) const {
    std::vector<const Shape*> found;
    for (const Shape& shape : shapes_) {
      if (shape.raw->role == role) found.push_back(&shape);
    }
    return found;
  }

  Polygons united(Role role) {
    std::vector<Polygons> areas;
    const std::vector<const Shape*> shapes = with_role(role);
    std::vector<Bounds> bounds;
    for (const Shape* shape : shapes) bounds.push_back(bounds_of(shape->area));
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      areas.push_back(shapes[i]->area);
      if (shapes[i]->area.empty()) repaired(*shapes[i]->raw, "has no area; dropped");
      for (std::size_t j = 0; j < i; ++j) {
        if (meet(bounds[i], bounds[j])) note_overlap(*shapes[i], *shapes[j]);
      }
    }
    return unite(areas);
  }

  // Says what two features of one role have in common.
  void note_overlap(const Shape& later, const Shape& earlier) {
    const double common_m2 = area_m2(intersect(later.area, earlier.area));
    const double rest_m2 = std::max(area_m2(later.area), area_m2(earlier.area)) - common_m2;
    const std::string& other = earlier.raw->where;
    if (common_m2 > 0 && rest_m2 <= std::min(kAreaToleranceM2, common_m2 / 2)) {
      repaired(*later.raw, "is the same as " + other + "; dropped");
    } else if (common_m2 > kAreaToleranceM2) {
      repaired(*later.raw, "overlaps " + other + " by " + in_m2(common_m2) + "; united");
    } else {
      const double shared_m = (perimeter_m(later.area) + perimeter_m(earlier.area) -
                               perimeter_m(unite(later.area, earlier.area))) /
                              2;
      if (shared_m >= 0.01) {
        repaired(*later.raw, "touches " + other + " along " + in_m(shared_m) + "; united");
      }
    }
  }

  void make_boundary() {
    const std::vector<const Shape*> drawn = with_role(Role::boundary);
    const bool walled = std::any_of(drawn.begin(), drawn.end(),
                                    [](const Shape* shape) { return shape->raw->wall; });
    if (out_.map.obstacles.empty() && !walled) {
      out_.errors.push_back(
          "the map has neither an obstacle nor a boundary with \"wall\": true: there is nothing to "
          "model; draw the buildings as polygons");
      return;
    }
    if (drawn.empty()) {
      assume_boundary();
      return;
    }
    out_.map.boundary = united(Role::boundary);
    if (out_.map.boundary.empty()) {
      out_.errors.push_back("the boundary encloses no area; redraw it or leave it out");
      return;
    }
    for (const Shape* shape : drawn) add_boundary_wall(*shape);
  }

  void assume_boundary() {
    const auto margin_mm = std::llround(std::clamp(margin_m_, 0.0, 1e5) * 1000);
    auto [min, max] = bounds_of(out_.map.obstacles);
    min = min - PointMm{margin_mm, margin_mm};
    max = max + PointMm{margin_mm, margin_mm};
    const std::string error = range_error(to_m(min)) + range_error(to_m(max));
    if (!error.empty()) {
      out_.errors.push_back("the assumed boundary is too large: " + error);
      return;
    }
    out_.map.boundary = {{{min, {max.x, min.y}, max, {min.x, max.y}}, {}}};
    out_.repairs.push_back({raw_.name, "draws no boundary; assumed the box " + in_words(min) +
                                           " to " + in_words(max) + ", " +
                                           in_m(static_cast<double>(margin_mm) / 1000) +
                                           " around the obstacles"});
  }

  void add_boundary_wall(const Shape& shape) {
    if (!shape.raw->wall || shape.area.empty()) return;
    const Polygons wall = subtract(offset(shape.area, kBoundaryWallMm), out_.map.boundary);
    out_.map.obstacles = unite(out_.map.obstacles, wall);
  }

  double site_ground_z_m() {
    std::optional<double> ground_z_m;
    for (const Shape* shape : with_role(Role::boundary)) {
      const std::optional<double>& own = shape->raw->ground_z_m;
      if (own && ground_z_m && *own != *ground_z_m) {
        wrong(*shape->raw, "ground_z_m " + decimal(*own) + " differs from the " +
                               decimal(*ground_z_m) +
                               " of another boundary; give heights to regions");
      }
      if (own) ground_z_m = own;
    }
    return ground_z_m.value_or(raw_.ground_z_m.value_or(0));
  }

  void make_regions() {
    out_.map.ground_z_m = site_ground_z_m();
    Polygons taken;
    for (const Shape* shape : with_role(Role::region)) {
      Polygons area = inside_boundary(*shape);
      const double taken_m2 = area_m2(intersect(area, taken));
      if (taken_m2 > kAreaToleranceM2) note_region_overlap(*shape, taken_m2);
      if (taken_m2 > 0) area = subtract(area, taken);
      if (area.empty()) {
        wrong(*shape->raw, "region has no ground of its own inside the boundary; redraw it");
        continue;
      }
      taken = unite(taken, area);
      add_region(*shape->raw, std::move(area));
    }
    if (with_role(Role::region).empty()) {
      out_.map.regions.push_back({"site", out_.map.boundary, out_.map.ground_z_m});
    }
  }

  Polygons inside_boundary(const Shape& shape) {
    Polygons area = intersect(shape.area, out_.map.boundary);
    const double outside_m2 = area_m2(shape.area) - area_m2(area);
    if (!area.empty() && outside_m2 > kAreaToleranceM2) {
      repaired(*shape.raw,
               "region reaches " + in_m2(outside_m2) + " outside the boundary; cut off");
    }
    return area;
  }

  void note_region_overlap(const Shape& shape, double taken_m2) {
    for (const Region& earlier : out_.map.regions) {
      const double common_m2 = area_m2(intersect(shape.area, earlier.area));
      if (common_m2 <= kAreaToleranceM2) continue;
      repaired(*shape.raw, "region overlaps region '" + earlier.name + "', drawn before it, by " +
                               in_m2(std::min(common_m2, taken_m2)) + "; the earlier keeps it");
    }
  }

  void add_region(const RawFeature& feature, Polygons area) {
    std::string name = feature.name;
    if (name.empty()) {
      name = "region " + std::to_string(out_.map.regions.size());
      repaired(feature, "region has no name; called '" + name + "'");
    }
    if (name.find('/') != std::string::npos) {
      wrong(feature,
            "region name '" + name + "' contains '/', which marks parts of a region; rename it");
    }
    const double ground_z_m = feature.ground_z_m.value_or(out_.map.ground_z_m);
    const auto same = std::find_if(out_.map.regions.begin(), out_.map.regions.end(),
                                   [&](const Region& region) { return region.name == name; });
    if (same == out_.map.regions.end()) {
      out_.map.regions.push_back({name, std::move(area), ground_z_m});
    } else if (same->ground_z_m != ground_z_m) {
      wrong(feature, "region '" + name + "' is drawn twice, with ground_z_m " +
                         decimal(ground_z_m) + " and " + decimal(same->ground_z_m) +
                         "; rename one");
    } else {
      repaired(feature, "region '" + name + "' is drawn twice; united");
      same->area = unite(same->area, area);
    }
  }

  void make_targets();
  void note_missed_target(const Shape& shape, double wall_m);
  void make_start();

  const RawSite& raw_;
  const double margin_m_;
  RepairedSite out_;
  std::vector<Shape> shapes_;
  std::vector<Repair> reversals_;
};

std::vector<SegmentMm> segments(const std::vector<Ring>& lines) {
  std::vector<SegmentMm> all;
  for (const Ring& line : lines) {
    for (std::size_t i = 1; i < line.size(); ++i) all.push_back({line[i - 1], line[i]});
  }
  return all;
}

// A target drawn as a polygon means its border.
std::vector<SegmentMm> target_lines(const Shape& shape) {
  std::vector<SegmentMm> lines = segments(shape.lines);
  const std::vector<SegmentMm> border = edges(shape.area);
  lines.insert(lines.end(), border.begin(), border.end());
  return lines;
}

void SiteRepair::make_targets() {
  SiteMap& map = out_.map;
  const std::vector<const Shape*> shapes = with_role(Role::target);
  for (const Shape* shape : shapes) {
    const std::vector<SegmentMm> lines = target_lines(*shape);
    map.targets.insert(map.targets.end(), lines.begin(), lines.end());
  }
  if (shapes.empty()) {
    map.obstacles = with_vertices(map.obstacles, cuts_at_boundary(map.obstacles, map.boundary));
    return;
  }
  map.obstacles = with_vertices(map.obstacles, cuts_at_targets(map.obstacles, map.targets));
  double all_m = 0;
  for (const Shape* shape : shapes) {
    const double wall_m = length_along_m(map.obstacles, target_lines(*shape));
    all_m += wall_m;
    note_missed_target(*shape, wall_m);
  }
  if (all_m > 0) return;
  out_.errors.push_back(
      "no target line runs along a wall (within " + in_m(kTargetReachM) +
      " of an obstacle's edge): nothing would count; move the lines onto the walls, "
      "or leave them out to count every wall");
}

void SiteRepair::note_missed_target(const Shape& shape, double wall_m) {
  double line_m = 0;
  for (const SegmentMm& line : target_lines(shape)) line_m += length_m(line.a, line.b);
  const double missed_m = line_m - wall_m;
  if (missed_m <= 4 * kTargetReachM) return;
  repaired(*shape.raw, in_m(missed_m) + " of its " + in_m(line_m) +
                           " run along no wall (an obstacle's edge within " + in_m(kTargetReachM) +
                           "); ignored there");
}

void SiteRepair::make_start() {
  const std::vector<const Shape*> shapes = with_role(Role::start);
  if (shapes.empty()) return;
  const RawFeature& feature = *shapes.front()->raw;
  for (std::size_t i = 1; i < shapes.size(); ++i) {
    wrong(*shapes[i]->raw, "is a second start, after " + feature.where + "; keep one");
  }
  if (!feature.point_m) {
    wrong(feature, "a start is drawn without a point; draw one Point");
    return;
  }
  const std::string error = range_error(*feature.point_m);
  if (!error.empty()) {
    wrong(feature, error);
    return;
  }
  const PointMm at = to_mm(*feature.point_m);
  const char* place = !contains(out_.map.boundary, at)   ? "outside the boundary"
                      : contains(out_.map.obstacles, at) ? "in an obstacle"
                      : contains(out_.map.keep_out, at)  ? "in a keep-out"
                                                         : nullptr;
  if (place) wrong(feature, "the start " + in_words(at) + " lies " + place + "; move it");
  out_.map.start =
      hal::Pose2{*feature.point_m, feature.heading_deg.value_or(0) * std::numbers::pi / 180};
}

}  // namespace

RepairedSite repair_site(const RawSite& raw, double margin_m) {
  return SiteRepair(raw, margin_m).run();
}

}  // namespace nav
