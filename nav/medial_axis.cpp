#include "nav/medial_axis.hpp"

#include <algorithm>
#include <boost/polygon/voronoi_builder.hpp>
#include <boost/polygon/voronoi_diagram.hpp>
#include <limits>

#include "nav/polygons.hpp"
#include "nav/segment_distance.hpp"

namespace nav {
namespace {

using Diagram = boost::polygon::voronoi_diagram<double>;
using HalfEdge = Diagram::edge_type;
using Cell = Diagram::cell_type;
using Eigen::Vector2d;

Vector2d position_mm(const Diagram::vertex_type& v) {
  return {v.x(), v.y()};
}
Vector2d position_mm(PointMm p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

bool starts_at_a(const Cell& cell) {
  return cell.source_category() == boost::polygon::SOURCE_CATEGORY_SEGMENT_START_POINT;
}

PointMm point_of(const Cell& cell, const OutlinePiece& piece) {
  return starts_at_a(cell) ? piece.a : piece.b;
}

// A Voronoi edge in a frame where it is easy: the place and the clearance as functions of u, the
// clearance convex in u with its minimum at u_least. Millimetres.
struct Curve {
  double u_first{}, u_last{}, u_least{};
  bool parabola{};
  Vector2d origin, along, across;  // Frame: origin + u * along (+ height * across on a parabola).
  double focus{};                  // Parabola: distance from the focus to the directrix.
  double least{};                  // Straight: clearance at u_least ...
  double slope{};                  // ... growing by slope * |u - u_least| (two walls) ...
  bool hyperbolic{};               // ... or as the hypotenuse (two points).

  double height(double u) const { return (u * u + focus * focus) / (2 * focus); }
  double clearance(double u) const {
    if (parabola) return height(u);
    const double off = u - u_least;
    return hyperbolic ? std::hypot(least, off) : least + slope * std::abs(off);
  }
  Vector2d place(double u) const {
    const Vector2d on_line = origin + u * along;
    return parabola ? Vector2d(on_line + height(u) * across) : on_line;
  }
};

double line_distance(const OutlinePiece& piece, const Vector2d& p) {
  const Vector2d a = position_mm(piece.a);
  const Vector2d ab = position_mm(piece.b) - a;
  return std::abs(cross2(ab, p - a)) / ab.norm();
}

Curve straight(const Vector2d& first, const Vector2d& last) {
  Curve curve;
  curve.origin = first;
  curve.u_last = (last - first).norm();
  curve.along = curve.u_last > 0 ? Vector2d((last - first) / curve.u_last) : Vector2d(1, 0);
  return curve;
}

Curve between_walls(const Vector2d& first, const Vector2d& last, const OutlinePiece& wall) {
  Curve curve = straight(first, last);
  const double at_first = line_distance(wall, first);
  const double at_last = line_distance(wall, last);
  curve.u_least = at_first <= at_last ? 0 : curve.u_last;
  curve.least = std::min(at_first, at_last);
  if (curve.u_last > 0) curve.slope = std::abs(at_last - at_first) / curve.u_last;
  return curve;
}

Curve between_points(const Vector2d& first, const Vector2d& last, const Vector2d& point) {
  Curve curve = straight(first, last);
  curve.hyperbolic = true;
  curve.u_least = curve.along.dot(point - first);
  curve.least = (curve.origin + curve.u_least * curve.along - point).norm();
  return curve;
}

Curve between_point_and_wall(const Vector2d& first, const Vector2d& last, const Vector2d& point,
                             const OutlinePiece& wall) {
  const Vector2d a = position_mm(wall.a);
  const Vector2d along = (position_mm(wall.b) - a).normalized();
  const double height = cross2(along, point - a);
  if (std::abs(height) < 1e-9) return between_points(first, last, point);
  Curve curve;
  curve.parabola = true;
  curve.along = along;
  curve.across = Vector2d(-along.y(), along.x()) * (height < 0 ? -1.0 : 1.0);
  curve.origin = a + along * along.dot(point - a);
  curve.focus = std::abs(height);
  curve.u_first = along.dot(first - curve.origin);
  curve.u_last = along.dot(last - curve.origin);
  return curve;
}

// Says on which side of the outline a point lies, given what it is closest to.
class Sides {
 public:
  Sides(const std::vector<OutlinePiece>& outline, const Polygons& free_space)
      : outline_(outline), free_space_(free_space) {
    rays_.reserve(outline.size() * 2);
    for (const OutlinePiece& piece : outline) {
      rays_.push_back({piece.a, piece.b, true, piece.doubtful});
      rays_.push_back({piece.b, piece.a, false, piece.doubtful});
    }
    std::sort(rays_.begin(), rays_.end(), [](const Ray& l, const Ray& r) {
      return l.from != r.from ? l.from < r.from : l.to < r.to;
    });
  }

  bool free_beside_wall(std::size_t wall, const Vector2d& place) const {
    const OutlinePiece& piece = outline_[wall];
    if (piece.doubtful) return free_by_containment(place);
    const Vector2d a = position_mm(piece.a);
    return cross2(position_mm(piece.b) - a, place - a) > 0;
  }

  // The first ray clockwise of the direction to the place decides: what leaves the corner has the
  // inside counter-clockwise of it, what arrives has the outside there.
  bool free_at_corner(PointMm corner, const Vector2d& place) const {
    const Vector2d towards = place - position_mm(corner);
    const auto from_less = [](const Ray& ray, PointMm p) { return ray.from < p; };
    const Ray* decides = nullptr;
    double least_turn = std::numeric_limits<double>::infinity();
    for (auto ray = std::lower_bound(rays_.begin(), rays_.end(), corner, from_less);
         ray != rays_.end() && ray->from == corner; ++ray) {
      const Vector2d along = position_mm(ray->to) - position_mm(corner);
      double turn = std::atan2(cross2(along, towards), along.dot(towards));
      if (turn < 0) turn += 2 * M_PI;
      if (turn >= least_turn) continue;
      least_turn = turn;
      decides = &*ray;
    }
    if (decides == nullptr || decides->doubtful) return free_by_containment(place);
    return decides->leaves;
  }

 private:
  struct Ray {
    PointMm from, to;
    bool leaves{};
    bool doubtful{};
  };

  bool free_by_containment(const Vector2d& place) const {
    return contains(free_space_, {std::llround(place.x()), std::llround(place.y())});
  }

  const std::vector<OutlinePiece>& outline_;
  const Polygons& free_space_;
  std::vector<Ray> rays_;
};

class Builder {
 public:
  Builder(const Polygons& free_space, const MedialConfig& config)
      : config_(config), outline_(node_outlines(edges(free_space))), sides_(outline_, free_space) {}

  MedialAxis run() {
    boost::polygon::voronoi_builder<std::int32_t> builder;
    for (const OutlinePiece& p : outline_)
      builder.insert_segment(static_cast<std::int32_t>(p.a.x), static_cast<std::int32_t>(p.a.y),
                             static_cast<std::int32_t>(p.b.x), static_cast<std::int32_t>(p.b.y));
    builder.construct(&diagram_);
    node_of_vertex_.assign(diagram_.vertices().size(), -1);
    for (const HalfEdge& edge : diagram_.edges()) {
      if (!edge.is_primary() || !edge.is_finite() || &edge > edge.twin()) continue;
      add(edge);
    }
    axis_.outline = std::move(outline_);
    return std::move(axis_);
  }

 private:
  const OutlinePiece& piece_of(const Cell& cell) const { return outline_[cell.source_index()]; }

  void add(const HalfEdge& edge) {
    const Curve curve = curve_of(edge);
    const double at_first = curve.clearance(curve.u_first);
    const double at_last = curve.clearance(curve.u_last);
    const double least_mm = config_.clearance_min_m * 1000;
    if (std::max(at_first, at_last) < least_mm) return;  // Convex: below all the way.
    if (!is_free(edge, curve.place(at_first >= at_last ? curve.u_first : curve.u_last))) return;
    if (curve.u_least > std::min(curve.u_first, curve.u_last) &&
        curve.u_least < std::max(curve.u_first, curve.u_last)) {
      add_monotone(edge, curve, curve.u_first, curve.u_least);
      add_monotone(edge, curve, curve.u_least, curve.u_last);
    } else {
      add_monotone(edge, curve, curve.u_first, curve.u_last);
    }
  }

  Curve curve_of(const HalfEdge& edge) const {
    const Vector2d first = position_mm(*edge.vertex0());
    const Vector2d last = position_mm(*edge.vertex1());
    const Cell& cell = *edge.cell();
    const Cell& other = *edge.twin()->cell();
    if (cell.contains_segment() && other.contains_segment())
      return between_walls(first, last, piece_of(cell));
    if (cell.contains_point() && other.contains_point())
      return between_points(first, last, position_mm(point_of(cell, piece_of(cell))));
    const Cell& wall = cell.contains_segment() ? cell : other;
    const Cell& corner = cell.contains_segment() ? other : cell;
    return between_point_and_wall(first, last, position_mm(point_of(corner, piece_of(corner))),
                                  piece_of(wall));
  }

  // An edge never crosses the outline: one place on it speaks for all of it.
  bool is_free(const HalfEdge& edge, const Vector2d& place) const {
    const Cell& cell = *edge.cell();
    const Cell& other = *edge.twin()->cell();
    if (cell.contains_segment()) return sides_.free_beside_wall(cell.source_index(), place);
    if (other.contains_segment()) return sides_.free_beside_wall(other.source_index(), place);
    return sides_.free_at_corner(point_of(cell, piece_of(cell)), place);
  }

  // [u0, u1] is a part of the curve on which the clearance only rises or only falls.
  void add_monotone(const HalfEdge& edge, const Curve& curve, double u0, double u1) {
    const double least_mm = config_.clearance_min_m * 1000;
    const bool keep0 = curve.clearance(u0) >= least_mm;
    const bool keep1 = curve.clearance(u1) >= least_mm;
    if (!keep0 && !keep1) return;
    if (!keep0) u0 = cut(curve, u1, u0);
    if (!keep1) u1 = cut(curve, u0, u1);
    const int a = node_at(edge, curve, u0);
    const int b = node_at(edge, curve, u1);
    if (a != b) add_chords(curve, u0, u1, a, b);
  }

  // Where the clearance falls to the least allowed, from the kept side.
  double cut(const Curve& curve, double keep, double drop) const {
    const double least_mm = config_.clearance_min_m * 1000;
    for (int i = 0; i < 60 && std::abs(keep - drop) > 1e-6; ++i) {
      const double middle = (keep + drop) / 2;
      (curve.clearance(middle) >= least_mm ? keep : drop) = middle;
    }
    return keep;
  }

  int node_at(const HalfEdge& edge, const Curve& curve, double u) {
    if (u == curve.u_first) return vertex_node(*edge.vertex0(), curve.clearance(u));
    if (u == curve.u_last) return vertex_node(*edge.vertex1(), curve.clearance(u));
    if (last_inner_.edge == &edge && last_inner_.u == u) return last_inner_.node;
    last_inner_ = {&edge, u, new_node(curve.place(u), curve.clearance(u))};
    return last_inner_.node;
  }

  int vertex_node(const Diagram::vertex_type& vertex, double clearance_mm) {
    int& node = node_of_vertex_[static_cast<std::size_t>(&vertex - diagram_.vertices().data())];
    if (node < 0) node = new_node(position_mm(vertex), clearance_mm);
    return node;
  }

  int new_node(const Vector2d& place_mm, double clearance_mm) {
    axis_.nodes_m.push_back(place_mm / 1000);
    axis_.clearance_m.push_back(clearance_mm / 1000);
    return static_cast<int>(axis_.nodes_m.size()) - 1;
  }

  void add_chords(const Curve& curve, double u0, double u1, int a, int b) {
    const Vector2d p0 = curve.place(u0);
    const Vector2d p1 = curve.place(u1);
    const double chord = (p1 - p0).norm();
    // A parabola bulges from its chord by du^2 / (8 focus) along its axis.
    const double bulge = curve.parabola && chord > 0
                             ? (u1 - u0) * (u1 - u0) / (8 * curve.focus) * std::abs(u1 - u0) / chord
                             : 0;
    const bool fine = chord <= config_.step_max_m * 1000 && bulge <= config_.arc_error_m * 1000;
    const double middle = (u0 + u1) / 2;
    if (fine || middle == u0 || middle == u1) {
      axis_.edges.push_back({a, b});
      return;
    }
    const int between = new_node(curve.place(middle), curve.clearance(middle));
    add_chords(curve, u0, middle, a, between);
    add_chords(curve, middle, u1, between, b);
  }

  struct Inner {
    const HalfEdge* edge = nullptr;
    double u{};
    int node = -1;
  };

  const MedialConfig config_;
  std::vector<OutlinePiece> outline_;
  Sides sides_;
  Diagram diagram_;
  MedialAxis axis_;
  std::vector<int> node_of_vertex_;
  Inner last_inner_;  // The two halves of a curve meet in one node.
};

}  // namespace

MedialAxis medial_axis(const Polygons& free_space, const MedialConfig& config) {
  return Builder(free_space, config).run();
}

}  // namespace nav
