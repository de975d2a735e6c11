// A small reader of the OBJ files we ship, with questions a test may ask. Shares no code with the
// program that made them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace tools_test {

struct Group {
  std::string name;
  std::vector<std::array<std::size_t, 3>> triangles;

  bool closed() const { return name.rfind("ground", 0) != 0; }
};

struct Obj {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Group> groups;  // One per "g" line.
};

// Knows "v x y z", "f a b c" and "g name"; throws on anything else but comments.
inline Obj read_obj(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  Obj obj;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "#") continue;
    if (key == "g") {
      words >> obj.groups.emplace_back().name;
    } else if (key == "v") {
      Eigen::Vector3d& p = obj.vertices.emplace_back();
      words >> p.x() >> p.y() >> p.z();
    } else if (key == "f" && !obj.groups.empty()) {
      auto& t = obj.groups.back().triangles.emplace_back();
      words >> t[0] >> t[1] >> t[2];
      for (std::size_t& i : t) --i;
      if (std::any_of(t.begin(), t.end(), [&](std::size_t i) { return i >= obj.vertices.size(); }))
        words.setstate(std::ios::failbit);
    } else {
      words.setstate(std::ios::failbit);
    }
    if (!words) throw std::runtime_error(file.string() + ": bad line: " + line);
  }
  return obj;
}

// Edges that do not have exactly one triangle on either side.
inline int bad_edges(const Group& group) {
  std::map<std::pair<std::size_t, std::size_t>, int> directed;
  for (const auto& t : group.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
  int bad = 0;
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    if (count != 1 || back == directed.end() || back->second != 1) ++bad;
  }
  return bad;
}

inline double volume_m3(const Obj& obj, const Group& group) {
  double sum = 0;
  for (const auto& t : group.triangles)
    sum += obj.vertices[t[0]].dot(obj.vertices[t[1]].cross(obj.vertices[t[2]])) / 6;
  return sum;
}

// What a vertical ray meets above a point.
struct Above {
  int winding = 0;  // Solids around the point: faces left behind minus faces entered.
  double first_z = INFINITY;
};

// Buckets of triangles by x and y, for many vertical rays.
class Columns {
 public:
  explicit Columns(const Obj& obj) : obj_(&obj) {
    for (const Group& group : obj.groups)
      for (const auto& t : group.triangles) add(t);
  }

  Above above(const Eigen::Vector3d& from) const {
    Above result;
    const auto bucket = buckets_.find(key(from.x(), from.y()));
    if (bucket == buckets_.end()) return result;
    for (const auto& t : bucket->second) meet(from, t, result);
    return result;
  }

 private:
  static constexpr double kCellM = 2.0;
  using Triangle = std::array<std::size_t, 3>;
  using Key = std::pair<long, long>;

  static Key key(double x, double y) {
    return {std::lround(std::floor(x / kCellM)), std::lround(std::floor(y / kCellM))};
  }

  const Eigen::Vector3d& at(std::size_t i) const { return obj_->vertices[i]; }

  void add(const Triangle& t) {
    const Eigen::Vector3d low = at(t[0]).cwiseMin(at(t[1])).cwiseMin(at(t[2]));
    const Eigen::Vector3d high = at(t[0]).cwiseMax(at(t[1])).cwiseMax(at(t[2]));
    const Key a = key(low.x(), low.y()), b = key(high.x(), high.y());
    for (long x = a.first; x <= b.first; ++x)
      for (long y = a.second; y <= b.second; ++y) buckets_[{x, y}].push_back(t);
  }

  void meet(const Eigen::Vector3d& from, const Triangle& t, Above& result) const {
    const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      return a.x() * b.y() - a.y() * b.x();
    };
    const Eigen::Vector2d p = from.head<2>(), a = at(t[0]).head<2>(), b = at(t[1]).head<2>(),
                          c = at(t[2]).head<2>();
    const double area = cross(b - a, c - a);
    const double u = cross(b - p, c - p), v = cross(c - p, a - p), w = cross(a - p, b - p);
    const bool inside = (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
    if (!inside) return;  // Vertical faces have no area from above, and are never met.
    const double z = (u * at(t[0]).z() + v * at(t[1]).z() + w * at(t[2]).z()) / area;
    if (z <= from.z()) return;
    result.winding += area > 0 ? 1 : -1;
    result.first_z = std::min(result.first_z, z);
  }

  const Obj* obj_;
  std::map<Key, std::vector<Triangle>> buckets_;
};

}  // namespace tools_test
