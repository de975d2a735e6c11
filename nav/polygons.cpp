#include "nav/polygons.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "nav/rings.hpp"

namespace nav {
namespace {

constexpr double kArcToleranceMm = 10;

bool in_a(int a, int) {
  return a > 0;
}
bool in_either(int a, int b) {
  return a > 0 || b > 0;
}
bool in_both(int a, int b) {
  return a > 0 && b > 0;
}
bool in_a_only(int a, int b) {
  return a > 0 && b <= 0;
}
bool wound(int a, int) {
  return a != 0;
}
bool unwound(int a, int) {
  return a < 0;
}
bool wound_oddly(int a, int) {
  return a % 2 != 0;
}

void check_range(const Ring& ring) {
  for (const PointMm p : ring) {
    if (std::abs(p.x) <= kCoordinateMax && std::abs(p.y) <= kCoordinateMax) continue;
    throw std::out_of_range("polygon vertex (" + std::to_string(p.x) + ", " + std::to_string(p.y) +
                            ") mm lies beyond " + std::to_string(kCoordinateMax) + " mm");
  }
}

// Oriented by their role, so that a positive winding number means inside.
void append_rings(const Polygons& polygons, std::vector<Ring>& rings) {
  const auto append = [&](Ring ring, bool hole) {
    check_range(ring);
    if ((twice_area_mm2(ring) < 0) != hole) std::reverse(ring.begin(), ring.end());
    rings.push_back(std::move(ring));
  };
  for (const Polygon& polygon : polygons) {
    append(polygon.outer, false);
    for (const Ring& hole : polygon.holes) append(hole, true);
  }
}

std::vector<Ring> oriented_rings(const Polygons& polygons) {
  std::vector<Ring> rings;
  append_rings(polygons, rings);
  return rings;
}

Polygons overlay(const Polygons& a, const Polygons& b, Inside inside) {
  return overlay(oriented_rings(a), oriented_rings(b), inside);
}

// The vector of the given length square to a -> b, on its right.
Eigen::Vector2d right_of(PointMm a, PointMm b, double length_mm) {
  const Eigen::Vector2d d(static_cast<double>(b.x - a.x), static_cast<double>(b.y - a.y));
  return Eigen::Vector2d(d.y(), -d.x()) * (length_mm / d.norm());
}

PointMm shifted(PointMm p, const Eigen::Vector2d& by_mm) {
  return {p.x + std::llround(by_mm.x()), p.y + std::llround(by_mm.y())};
}

// Tangents of the circle round v, counter-clockwise from v + from_mm to v + to_mm (< 180 deg).
void append_arc(PointMm v, const Eigen::Vector2d& from_mm, const Eigen::Vector2d& to_mm,
                Ring& curve) {
  const double radius_mm = from_mm.norm();
  const double turn =
      std::atan2(from_mm.x() * to_mm.y() - from_mm.y() * to_mm.x(), from_mm.dot(to_mm));
  const double step_max = 2 * std::acos(radius_mm / (radius_mm + kArcToleranceMm));
  const int steps = std::max(1, static_cast<int>(std::ceil(turn / step_max)));
  const double step = turn / steps;
  curve.push_back(shifted(v, from_mm));
  for (int i = 0; i < steps; ++i) {
    const Eigen::Rotation2Dd rotation((i + 0.5) * step);
    curve.push_back(shifted(v, rotation * from_mm / std::cos(step / 2)));
  }
  curve.push_back(shifted(v, to_mm));
}

// The sum of the ring, a rectangle of the given width on the right of each edge and a sector at
// each vertex that turns left, as one curve: what they have in common cancels. It winds round a
// point as often as these cover it, so it winds positively round exactly the grown shape.
Ring grown_curve(const Ring& ring, double distance_mm) {
  Ring curve;
  const std::size_t n = ring.size();
  for (std::size_t i = 0; i < n; ++i) {
    const PointMm before = ring[(i + n - 1) % n];
    const PointMm v = ring[i];
    const PointMm after = ring[(i + 1) % n];
    const Eigen::Vector2d from_mm = right_of(before, v, distance_mm);
    const Eigen::Vector2d to_mm = right_of(v, after, distance_mm);
    if (side(before, v, after) > 0) {
      append_arc(v, from_mm, to_mm, curve);
    } else {
      curve.push_back(shifted(v, from_mm));
      curve.push_back(v);
      curve.push_back(shifted(v, to_mm));
    }
  }
  return curve;
}

Ring rectangle_along(PointMm a, PointMm b, double half_width_mm) {
  const Eigen::Vector2d right = right_of(a, b, half_width_mm);
  const Eigen::Vector2d ahead(-right.y(), right.x());
  return {shifted(a, right - ahead), shifted(b, right + ahead), shifted(b, ahead - right),
          shifted(a, -right - ahead)};
}

template <class Visit>
void for_each_edge(const Polygons& polygons, Visit visit) {
  const auto walk = [&](const Ring& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) visit(ring[i], ring[(i + 1) % ring.size()]);
  };
  for (const Polygon& polygon : polygons) {
    walk(polygon.outer);
    for (const Ring& hole : polygon.holes) walk(hole);
  }
}

Ring ring_through(const Ring& ring, const std::vector<PointMm>& points) {
  constexpr double kReachM = 0.001;
  Ring through;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const SegmentMm edge{ring[i], ring[(i + 1) % ring.size()]};
    std::vector<PointMm> here;
    for (const PointMm p : points) {
      const bool between =
          dot(p - edge.a, edge.b - edge.a) > 0 && dot(p - edge.b, edge.a - edge.b) > 0;
      if (between && distance_m(edge, p) <= kReachM) here.push_back(p);
    }
    std::sort(here.begin(), here.end(), [&](PointMm p, PointMm q) {
      return dot(p - edge.a, edge.b - edge.a) < dot(q - edge.a, edge.b - edge.a);
    });
    through.push_back(edge.a);
    through.insert(through.end(), here.begin(), here.end());
  }
  return through;
}

}  // namespace

Polygons unite(const Polygons& a, const Polygons& b) {
  return overlay(a, b, in_either);
}

Polygons unite(const std::vector<Polygons>& all) {
  std::vector<Ring> rings;
  for (const Polygons& polygons : all) append_rings(polygons, rings);
  return overlay(rings, {}, in_a);
}

Polygons intersect(const Polygons& a, const Polygons& b) {
  return overlay(a, b, in_both);
}

Polygons subtract(const Polygons& a, const Polygons& b) {
  return overlay(a, b, in_a_only);
}

Polygons offset(const Polygons& polygons, std::int64_t distance_mm) {
  std::vector<Ring> rings;
  for (Ring ring : oriented_rings(unite(polygons, {}))) {
    // To shrink is to grow the outside: reversed rings wind round it once less than 0 times.
    if (distance_mm < 0) std::reverse(ring.begin(), ring.end());
    rings.push_back(grown_curve(ring, std::abs(static_cast<double>(distance_mm))));
  }
  return overlay(rings, {}, distance_mm < 0 ? unwound : in_a);
}

Polygons thicken(const std::vector<Ring>& lines, std::int64_t half_width_mm) {
  std::vector<Ring> rectangles;
  for (const Ring& line : lines) {
    check_range(line);
    for (std::size_t i = 1; i < line.size(); ++i) {
      if (line[i - 1] == line[i]) continue;
      rectangles.push_back(
          rectangle_along(line[i - 1], line[i], static_cast<double>(half_width_mm)));
    }
  }
  return overlay(rectangles, {}, in_a);
}

Polygons fill(const Ring& ring, FillRule rule) {
  check_range(ring);
  return overlay({ring}, {}, rule == FillRule::non_zero ? wound : wound_oddly);
}

Polygons normalise(const std::vector<Ring>& rings) {
  std::vector<Ring> filled;
  for (const Ring& ring : rings) append_rings(fill(ring, FillRule::non_zero), filled);
  return overlay(filled, {}, wound_oddly);
}

Polygons with_vertices(const Polygons& polygons, const std::vector<PointMm>& points) {
  std::vector<Ring> rings;
  for (const Polygon& polygon : polygons) {
    rings.push_back(ring_through(polygon.outer, points));
    for (const Ring& hole : polygon.holes) rings.push_back(ring_through(hole, points));
  }
  return overlay(rings, {}, in_a, Straight::keep);
}

double area_m2(const Polygons& polygons) {
  double twice_mm2 = 0;
  for (const Polygon& polygon : polygons) {
    twice_mm2 += std::abs(static_cast<double>(twice_area_mm2(polygon.outer)));
    for (const Ring& hole : polygon.holes) {
      twice_mm2 -= std::abs(static_cast<double>(twice_area_mm2(hole)));
    }
  }
  return twice_mm2 * 0.5e-6;
}

double perimeter_m(const Polygons& polygons) {
  double sum_m = 0;
  for_each_edge(polygons, [&](PointMm a, PointMm b) { sum_m += length_m(a, b); });
  return sum_m;
}

bool contains(const Polygons& polygons, PointMm point) {
  return std::any_of(polygons.begin(), polygons.end(), [&](const Polygon& polygon) {
    if (locate(polygon.outer, point) < 0) return false;
    return std::none_of(polygon.holes.begin(), polygon.holes.end(),
                        [&](const Ring& hole) { return locate(hole, point) > 0; });
  });
}

double distance_m(const SegmentMm& segment, PointMm point) {
  const Eigen::Vector2d along = to_m(segment.b) - to_m(segment.a);
  const Eigen::Vector2d to_point = to_m(point) - to_m(segment.a);
  const double square = along.squaredNorm();
  const double share = square > 0 ? std::clamp(to_point.dot(along) / square, 0.0, 1.0) : 0.0;
  return (to_point - share * along).norm();
}

double border_distance_m(const Polygons& polygons, PointMm point) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for_each_edge(polygons, [&](PointMm a, PointMm b) {
    nearest_m = std::min(nearest_m, distance_m({a, b}, point));
  });
  return nearest_m;
}

std::vector<SegmentMm> edges(const Polygons& polygons) {
  std::vector<SegmentMm> all;
  for_each_edge(polygons, [&](PointMm a, PointMm b) { all.push_back({a, b}); });
  return all;
}

}  // namespace nav
