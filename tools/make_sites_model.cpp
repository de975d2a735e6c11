#include "tools/make_sites_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <stdexcept>

namespace sites {
namespace {

std::int64_t mm(double metres) {
  return std::llround(metres * 1000);
}

// On the grid, outer counter-clockwise, holes clockwise.
nav::Polygon on_grid(const Shape& shape) {
  const auto ring = [](const Path& path, bool ccw) {
    nav::Ring points;
    for (const Eigen::Vector2d& p : path) points.push_back(nav::to_mm(p));
    // A ring that shrank to a line has no sense of rotation: it stays as given.
    const std::int64_t area = twice_area_mm2(points);
    if (area != 0 && (area > 0) != ccw) std::reverse(points.begin(), points.end());
    return points;
  };
  nav::Polygon polygon{ring(shape.outer, true), {}};
  for (const Path& hole : shape.holes) polygon.holes.push_back(ring(hole, false));
  return polygon;
}

std::vector<nav::Ring> rings_of(const nav::Polygon& polygon) {
  std::vector<nav::Ring> rings{polygon.outer};
  rings.insert(rings.end(), polygon.holes.begin(), polygon.holes.end());
  return rings;
}

// Collects triangles of one solid; equal points become one vertex.
class SolidBuilder {
 public:
  SolidBuilder(std::string part, bool closed) {
    solid_.part = std::move(part), solid_.closed = closed;
  }

  int vertex(const Eigen::Vector3d& W_point_m) {
    const std::array<std::int64_t, 3> key{mm(W_point_m.x()), mm(W_point_m.y()), mm(W_point_m.z())};
    const auto [found, added] = index_.emplace(key, static_cast<int>(solid_.vertices_mm.size()));
    if (added) solid_.vertices_mm.push_back(key);
    return found->second;
  }

  // Triangles that shrank to a line are left out: their neighbours then share that line.
  void triangle(int a, int b, int c) {
    if (a != b && b != c && c != a) solid_.triangles.push_back({a, b, c});
  }

  Solid take() { return std::move(solid_); }

 private:
  Solid solid_;
  std::map<std::array<std::int64_t, 3>, int> index_;
};

using RingVertices = std::vector<std::vector<int>>;

RingVertices place(SolidBuilder& builder, const nav::Polygon& polygon, const Eigen::Isometry3d& T) {
  RingVertices placed;
  for (const nav::Ring& ring : rings_of(polygon)) {
    std::vector<int>& indices = placed.emplace_back();
    for (const nav::PointMm& p : ring) {
      const Eigen::Vector2d m = nav::to_m(p);
      indices.push_back(builder.vertex(T * Eigen::Vector3d(m.x(), m.y(), 0)));
    }
  }
  return placed;
}

void add_cap(SolidBuilder& builder, const nav::Polygon& polygon, const RingVertices& placed,
             bool top) {
  if (twice_area_mm2(polygon.outer) == 0) return;  // The solid ends in a ridge or a point.
  std::vector<int> flat;
  for (const auto& ring : placed) flat.insert(flat.end(), ring.begin(), ring.end());
  for (const Triangle& t : triangulate(polygon)) {
    const auto index = [&](int i) {
      return flat[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])];
    };
    builder.triangle(index(0), index(top ? 1 : 2), index(top ? 2 : 1));
  }
}

void add_sides(SolidBuilder& builder, const RingVertices& low, const RingVertices& high) {
  for (std::size_t r = 0; r < low.size(); ++r) {
    for (std::size_t i = 0; i < low[r].size(); ++i) {
      const std::size_t j = (i + 1) % low[r].size();
      builder.triangle(low[r][i], low[r][j], high[r][j]);
      builder.triangle(low[r][i], high[r][j], high[r][i]);
    }
  }
}

double volume_m3(const Solid& solid) {
  double sum = 0;
  const auto point = [&](int i) -> Eigen::Vector3d {
    const auto& v = solid.vertices_mm[static_cast<std::size_t>(i)];
    return Eigen::Vector3d(static_cast<double>(v[0]), static_cast<double>(v[1]),
                           static_cast<double>(v[2])) /
           1000;
  };
  for (const Triangle& t : solid.triangles) {
    sum += point(t[0]).dot(point(t[1]).cross(point(t[2]))) / 6;
  }
  return sum;
}

bool same_topology(const nav::Polygon& a, const nav::Polygon& b) {
  const auto ra = rings_of(a), rb = rings_of(b);
  return std::equal(ra.begin(), ra.end(), rb.begin(), rb.end(),
                    [](const nav::Ring& x, const nav::Ring& y) { return x.size() == y.size(); });
}

}  // namespace

void Model::loft(const std::string& part, const std::vector<Section>& sections) {
  SolidBuilder builder(part, true);
  std::vector<nav::Polygon> polygons;
  std::vector<RingVertices> placed;
  for (const Section& section : sections) {
    polygons.push_back(on_grid(section.shape));
    if (!same_topology(polygons.front(), polygons.back())) {
      throw std::logic_error(part + ": sections differ in their vertices");
    }
    placed.push_back(place(builder, polygons.back(), section.T_W_section));
  }
  add_cap(builder, polygons.front(), placed.front(), false);
  for (std::size_t i = 1; i < placed.size(); ++i) add_sides(builder, placed[i - 1], placed[i]);
  add_cap(builder, polygons.back(), placed.back(), true);
  solids_.push_back(builder.take());
  if (volume_m3(solids_.back()) <= 0) throw std::logic_error(part + ": the solid is inside out");
}

void Model::surface(const std::string& part, const Shape& shape, double z_m) {
  SolidBuilder builder(part, false);
  const nav::Polygon polygon = on_grid(shape);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = z_m;
  add_cap(builder, polygon, place(builder, polygon, T), true);
  solids_.push_back(builder.take());
}

void Model::band_facing_inside(const std::string& part, const Path3& low, const Path3& high) {
  SolidBuilder builder(part, false);
  for (std::size_t i = 0; i < low.size(); ++i) {
    const std::size_t j = (i + 1) % low.size();
    const int a = builder.vertex(low[i]), b = builder.vertex(low[j]);
    const int c = builder.vertex(high[j]), d = builder.vertex(high[i]);
    builder.triangle(b, a, d);
    builder.triangle(b, d, c);
  }
  solids_.push_back(builder.take());
}

std::string metres_text(std::int64_t millimetres) {
  const std::int64_t size = std::abs(millimetres);
  return fmt::format("{}{}.{:03}", millimetres < 0 ? "-" : "", size / 1000, size % 1000);
}

std::string Model::obj(const std::string& title) const {
  std::string text = "# " + title + "\n# Metres, z up. Made by make_sites.\n";
  std::size_t first = 1;
  for (const Solid& solid : solids_) {
    text += "g " + solid.part + "\n";
    for (const auto& v : solid.vertices_mm) {
      text += fmt::format("v {} {} {}\n", metres_text(v[0]), metres_text(v[1]), metres_text(v[2]));
    }
    for (const Triangle& t : solid.triangles) {
      const auto index = [&](int i) { return first + static_cast<std::size_t>(i); };
      text += fmt::format("f {} {} {}\n", index(t[0]), index(t[1]), index(t[2]));
    }
    first += solid.vertices_mm.size();
  }
  return text;
}

}  // namespace sites
