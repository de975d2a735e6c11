// judge: whether a simulated run saw what could be seen, by brute force on the true mesh.
//
//   judge MODEL.obj RUN_FOLDER CELLS.csv [--every N] [--threads T] [--at-least SHARE]
//
// Shares no code with the simulator or the planner, so that a mistake of theirs shows. The terms
// (surface voxel, visible, seen) are those at the top of sim/surface_truth.hpp. CELLS.csv has a
// line x_m,y_m,z_m (W) per possible scanner position, those of the scans taken first. --every
// judges a fixed 1 in N of the surface voxels. Exit 0: the run saw enough and reports it rightly;
// 1: not; 2: unreadable input.
#include <octomap/OcTree.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <atomic>
#include <boost/json.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

namespace json = boost::json;
using Eigen::Vector3d;

constexpr double kNudgeM = 1e-3;
constexpr double kReportToleranceShare = 0.015;

struct Triangle {
  Vector3d a, b, c;  // W, metres.
};

struct Options {
  std::string model, run, cells;
  std::uint64_t every = 1;
  unsigned threads = 2;
  double at_least = 0.95;
};

struct Run {
  Vector3d W_min_m;
  double voxel_m{};
  std::array<std::int64_t, 3> count{};
  Vector3d map_offset_m;  // Point in W = point in map.ot + this.
  double range_min_m{}, range_max_m{};
  double cos_grazing_max{}, sin_elevation_min{}, sin_elevation_max{};
  double reported{};
  std::size_t stations{};  // Only orders the search.
};

struct Sample {
  Vector3d W_point_m, normal;
};

struct SurfaceVoxel {
  double area_m2 = 0;
  std::vector<Sample> samples;
};

using SurfaceVoxels = std::map<std::uint64_t, SurfaceVoxel>;

// ---- Input ----

std::ifstream open(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + ": cannot be opened");
  return in;
}

[[noreturn]] void bad_line(const std::string& path, std::size_t line, const std::string& what) {
  throw std::runtime_error(path + ":" + std::to_string(line) + ": " + what);
}

std::vector<Triangle> read_model(const std::string& path) {
  auto in = open(path);
  std::vector<Vector3d> vertices;
  std::vector<Triangle> triangles;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    std::istringstream words(text);
    std::string word;
    words >> word;
    if (word == "v") {
      Vector3d v;
      if (!(words >> v.x() >> v.y() >> v.z())) bad_line(path, line, "a vertex needs 3 numbers");
      vertices.push_back(v);
    } else if (word == "f") {
      std::vector<Vector3d> corners;
      while (words >> word) {
        std::int64_t i = 0;  // from_chars stops at the slash of i/j and i//k.
        const auto end = word.data() + word.size();
        if (std::from_chars(word.data(), end, i).ec != std::errc()) i = 0;
        if (i < 0) i += static_cast<std::int64_t>(vertices.size()) + 1;
        if (i < 1 || i > std::ssize(vertices)) bad_line(path, line, "no vertex '" + word + "'");
        corners.push_back(vertices[i - 1]);
      }
      if (corners.size() < 3) bad_line(path, line, "a face needs 3 corners");
      for (std::size_t i = 2; i < corners.size(); ++i)
        triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  if (triangles.empty()) throw std::runtime_error(path + ": no faces");
  return triangles;
}

std::vector<Vector3d> read_cells(const std::string& path) {
  auto in = open(path);
  std::vector<Vector3d> cells;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    if (text.empty()) continue;
    std::istringstream words(text);
    Vector3d cell;
    char comma1 = 0, comma2 = 0;
    if (!(words >> cell.x() >> comma1 >> cell.y() >> comma2 >> cell.z()) || comma1 != ',' ||
        comma2 != ',')
      bad_line(path, line, "'" + text + "' is not x_m,y_m,z_m");
    cells.push_back(cell);
  }
  if (cells.empty()) throw std::runtime_error(path + ": no positions");
  return cells;
}

Vector3d vector_of(const json::value& value) {
  const auto& array = value.as_array();
  return {array.at(0).to_number<double>(), array.at(1).to_number<double>(),
          array.at(2).to_number<double>()};
}

Run read_run(const std::string& path) {
  auto in = open(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  try {
    const json::value summary = json::parse(text);
    const auto number = [&](const char* pointer) {
      return summary.at_pointer(pointer).to_number<double>();
    };
    constexpr double rad = std::numbers::pi / 180;
    Run run;
    run.voxel_m = number("/voxel_m");
    run.W_min_m = vector_of(summary.at_pointer("/grid/min_m"));
    run.count = {summary.at_pointer("/grid/nx").to_number<std::int64_t>(),
                 summary.at_pointer("/grid/ny").to_number<std::int64_t>(),
                 summary.at_pointer("/grid/nz").to_number<std::int64_t>()};
    run.map_offset_m = vector_of(summary.at_pointer("/files/map_ot_offset_m"));
    run.range_min_m = number("/sensor/range_min_m");
    run.range_max_m = number("/sensor/range_max_m");
    run.cos_grazing_max = std::cos(number("/sensor/grazing_max_deg") * rad);
    run.sin_elevation_min = std::sin(number("/sensor/elevation_min_deg") * rad);
    run.sin_elevation_max = std::sin(number("/sensor/elevation_max_deg") * rad);
    run.reported = number("/truth/seen_of_visible");
    const auto* scans = summary.as_object().if_contains("scans");
    if (scans && scans->is_array()) run.stations = scans->as_array().size();
    if (!(run.voxel_m > 0)) throw std::runtime_error("voxel_m is not positive");
    return run;
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

std::unique_ptr<octomap::OcTree> read_map(const std::string& path, double voxel_m) {
  std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(path));
  auto* tree = dynamic_cast<octomap::OcTree*>(any.get());
  if (!tree) throw std::runtime_error(path + ": not an octomap::OcTree");
  any.release();
  std::unique_ptr<octomap::OcTree> owned(tree);
  if (std::abs(tree->getResolution() - voxel_m) > 1e-6 * voxel_m)
    throw std::runtime_error(path + ": its resolution is not the summary's voxel_m");
  return owned;
}

// ---- Rays ----

// Boxes around triangles, halved at the median of their longest side.
class Boxes {
 public:
  explicit Boxes(const std::vector<Triangle>& triangles)
      : triangles_(triangles), order_(triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    build(0, order_.size());
  }

  // The triangle that the segment from + t * by, 0 <= t <= 1, meets, or -1. Any, not the first.
  std::int64_t blocker(const Vector3d& from, const Vector3d& by) const {
    const Vector3d inverse = by.unaryExpr([](double d) { return d == 0 ? 1e30 : 1 / d; });
    std::array<std::size_t, 64> stack{0};
    for (int top = 1; top > 0;) {
      const std::size_t at = stack[--top];
      const Node& node = nodes_[at];
      const Vector3d one = (node.low - from).cwiseProduct(inverse);
      const Vector3d other = (node.high - from).cwiseProduct(inverse);
      if (std::max(0.0, one.cwiseMin(other).maxCoeff()) >
          std::min(1.0, one.cwiseMax(other).minCoeff()))
        continue;
      if (node.right != 0) {
        stack[top++] = node.right;
        stack[top++] = at + 1;
        continue;
      }
      for (std::size_t i = node.begin; i < node.end; ++i)
        if (meets(order_[i], from, by)) return static_cast<std::int64_t>(order_[i]);
    }
    return -1;
  }

  // Moeller and Trumbore, both sides.
  bool meets(std::size_t triangle, const Vector3d& from, const Vector3d& by) const {
    const Triangle& t = triangles_[triangle];
    const Vector3d ab = t.b - t.a, ac = t.c - t.a, p = by.cross(ac);
    const double det = ab.dot(p);
    if (std::abs(det) < 1e-14) return false;
    const Vector3d s = from - t.a, q = s.cross(ab);
    const double u = s.dot(p) / det, v = by.dot(q) / det, along = ac.dot(q) / det;
    constexpr double edge = 1e-12;  // No gap between neighbours.
    return u >= -edge && v >= -edge && u + v <= 1 + edge && along >= 0 && along <= 1;
  }

 private:
  struct Node {
    Vector3d low, high;
    std::size_t begin{}, end{}, right{};  // A leaf's right is 0; the left child is the next node.
  };

  void build(std::size_t begin, std::size_t end) {
    const std::size_t at = nodes_.size();
    Node node{Vector3d::Constant(1e300), Vector3d::Constant(-1e300), begin, end, 0};
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = triangles_[order_[i]];
      node.low = node.low.cwiseMin(t.a).cwiseMin(t.b).cwiseMin(t.c);
      node.high = node.high.cwiseMax(t.a).cwiseMax(t.b).cwiseMax(t.c);
    }
    int axis = 0;
    (node.high - node.low).maxCoeff(&axis);
    node.low.array() -= 1e-6;
    node.high.array() += 1e-6;
    nodes_.push_back(node);
    if (end - begin <= 4) return;
    const std::size_t middle = (begin + end) / 2;
    const auto centre = [&](std::size_t i) {
      const Triangle& t = triangles_[i];
      return t.a[axis] + t.b[axis] + t.c[axis];
    };
    const auto first = order_.begin();
    std::nth_element(first + begin, first + middle, first + end,
                     [&](auto one, auto other) { return centre(one) < centre(other); });
    build(begin, middle);
    nodes_[at].right = nodes_.size();
    build(middle, end);
  }

  const std::vector<Triangle>& triangles_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

// ---- Surface ----

std::uint64_t hash(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

bool outside(const Run& run, const Triangle& t) {
  for (int i = 0; i < 3; ++i) {
    const double high_m = run.W_min_m[i] + static_cast<double>(run.count[i]) * run.voxel_m;
    if (std::max({t.a[i], t.b[i], t.c[i]}) < run.W_min_m[i]) return true;
    if (std::min({t.a[i], t.b[i], t.c[i]}) > high_m) return true;
  }
  return false;
}

void add_sample(const Run& run, std::uint64_t every, const Triangle& part, SurfaceVoxels& voxels) {
  const Vector3d across = (part.b - part.a).cross(part.c - part.a);
  const double area_m2 = across.norm() / 2;
  if (!(area_m2 > 0)) return;
  const Vector3d point = (part.a + part.b + part.c) / 3;
  std::array<std::int64_t, 3> at{};
  for (int i = 0; i < 3; ++i) {
    at[i] = static_cast<std::int64_t>(std::floor((point[i] - run.W_min_m[i]) / run.voxel_m));
    if (at[i] < 0 || at[i] >= run.count[i]) return;
  }
  const auto index =
      static_cast<std::uint64_t>(at[0] + run.count[0] * (at[1] + run.count[1] * at[2]));
  if (hash(index) % every != 0) return;
  SurfaceVoxel& voxel = voxels[index];
  voxel.area_m2 += area_m2;
  voxel.samples.push_back({point, across.normalized()});
}

// Halves each triangle across its longest side until that is half a voxel: the middles of the parts
// are then a quarter of a voxel apart, about.
SurfaceVoxels sample_surface(const Run& run, const std::vector<Triangle>& triangles,
                             std::uint64_t every) {
  SurfaceVoxels voxels;
  std::vector<Triangle> parts;
  for (const Triangle& triangle : triangles) {
    parts.push_back(triangle);
    while (!parts.empty()) {
      Triangle t = parts.back();
      parts.pop_back();
      if (outside(run, t)) continue;
      const double ab = (t.b - t.a).norm(), bc = (t.c - t.b).norm(), ca = (t.a - t.c).norm();
      const double longest = std::max({ab, bc, ca});
      if (longest <= run.voxel_m / 2) {
        add_sample(run, every, t, voxels);
        continue;
      }
      if (longest == bc) t = {t.b, t.c, t.a};
      if (longest == ca && longest != bc) t = {t.c, t.a, t.b};
      const Vector3d middle = (t.a + t.b) / 2;
      parts.push_back({t.a, middle, t.c});
      parts.push_back({middle, t.b, t.c});
    }
  }
  const double enough_m2 = run.voxel_m * run.voxel_m / 16 * (1 - 1e-9);
  std::erase_if(voxels, [&](const auto& entry) { return entry.second.area_m2 < enough_m2; });
  return voxels;
}

// ---- Judgement ----

bool within_limits(const Run& run, const Sample& sample, const Vector3d& to_scanner) {
  const double range_m = to_scanner.norm();
  if (range_m < run.range_min_m || range_m > run.range_max_m) return false;
  const double sin_elevation = -to_scanner.z() / range_m;
  return sin_elevation >= run.sin_elevation_min && sin_elevation <= run.sin_elevation_max &&
         std::abs(to_scanner.dot(sample.normal)) >= run.cos_grazing_max * range_m;
}

// The scans' own positions, then the others in reach, nearest first.
std::vector<Vector3d> positions_to_try(const Run& run, const std::vector<Vector3d>& cells,
                                       const Vector3d& near) {
  const auto stations = std::min(run.stations, cells.size());
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t i = stations; i < cells.size(); ++i) {
    const double distance_m = (cells[i] - near).norm();
    if (distance_m <= run.range_max_m + 2 * run.voxel_m) others.emplace_back(distance_m, i);
  }
  std::sort(others.begin(), others.end());
  std::vector<Vector3d> positions(cells.begin(), cells.begin() + std::ptrdiff_t(stations));
  for (const auto& other : others) positions.push_back(cells[other.second]);
  return positions;
}

bool visible(const Run& run, const Boxes& boxes, const std::vector<Vector3d>& cells,
             const SurfaceVoxel& voxel) {
  // What hid a sample from the last position mostly hides it from the next.
  std::vector<std::int64_t> last(voxel.samples.size(), -1);
  for (const Vector3d& scanner : positions_to_try(run, cells, voxel.samples[0].W_point_m)) {
    for (std::size_t i = 0; i < voxel.samples.size(); ++i) {
      const Sample& sample = voxel.samples[i];
      const Vector3d to_scanner = scanner - sample.W_point_m;
      if (!within_limits(run, sample, to_scanner)) continue;
      const Vector3d from = sample.W_point_m + kNudgeM * to_scanner.normalized();
      const Vector3d by = scanner - from;
      if (last[i] >= 0 && boxes.meets(static_cast<std::size_t>(last[i]), from, by)) continue;
      last[i] = boxes.blocker(from, by);
      if (last[i] < 0) return true;
    }
  }
  return false;
}

bool occupied(const Run& run, const octomap::OcTree& map, std::uint64_t index) {
  const auto nx = static_cast<std::uint64_t>(run.count[0]);
  const auto ny = static_cast<std::uint64_t>(run.count[1]);
  const Vector3d at(static_cast<double>(index % nx), static_cast<double>(index / nx % ny),
                    static_cast<double>(index / nx / ny));
  const Vector3d centre =
      run.W_min_m + run.voxel_m * (at + Vector3d::Constant(0.5)) - run.map_offset_m;
  const auto* node = map.search(centre.x(), centre.y(), centre.z());
  return node && map.isNodeOccupied(node);
}

int judge(const Options& options) {
  const Run run = read_run(options.run + "/summary.json");
  const auto map = read_map(options.run + "/map.ot", run.voxel_m);
  const auto triangles = read_model(options.model);
  const auto cells = read_cells(options.cells);
  const Boxes boxes(triangles);
  const SurfaceVoxels voxels = sample_surface(run, triangles, options.every);

  std::vector<SurfaceVoxels::const_iterator> all;
  for (auto it = voxels.begin(); it != voxels.end(); ++it) all.push_back(it);
  std::atomic<std::size_t> next = 0, could = 0, seen = 0;
  std::vector<std::jthread> workers;
  for (unsigned t = 0; t < options.threads; ++t) {
    workers.emplace_back([&] {
      for (std::size_t i = next++; i < all.size(); i = next++) {
        if (!visible(run, boxes, cells, all[i]->second)) continue;
        ++could;
        if (occupied(run, *map, all[i]->first)) ++seen;
      }
    });
  }
  workers.clear();  // Joins.

  if (could == 0) {
    std::printf("judge: none of %zu judged surface voxels is visible\n", all.size());
    return 1;
  }
  const double share = static_cast<double>(seen) / static_cast<double>(could);
  std::string reason;
  if (share < options.at_least) reason += "; too few";
  if (!(std::abs(share - run.reported) <= kReportToleranceShare))
    reason += "; the report is more than 1.5 points off";
  std::printf(
      "judge: %.2f %% of %zu judged visible surface voxels are seen (the report says %.2f %%)%s\n",
      100 * share, could.load(), 100 * run.reported, reason.c_str());
  return reason.empty() ? 0 : 1;
}

template <class Number>
Number number_of(const std::string& name, const std::string& text, Number low, Number high) {
  Number value{};
  const auto end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || !(value >= low && value <= high))
    throw std::runtime_error(name + ": '" + text + "' is not a number in its limits");
  return value;
}

Options read_options(const std::vector<std::string>& words) {
  Options options;
  std::vector<std::string> places;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (!words[i].starts_with("--")) {
      places.push_back(words[i]);
      continue;
    }
    const std::string& name = words[i];
    if (++i == words.size()) throw std::runtime_error(name + ": its value is missing");
    if (name == "--every") {
      options.every = number_of<std::uint64_t>(name, words[i], 1, 1'000'000'000);
    } else if (name == "--threads") {
      options.threads = number_of<unsigned>(name, words[i], 1, 256);
    } else if (name == "--at-least") {
      options.at_least = number_of<double>(name, words[i], 0, 1);
    } else {
      throw std::runtime_error(name + ": no such option");
    }
  }
  if (places.size() != 3)
    throw std::runtime_error(
        "usage: judge MODEL.obj RUN_FOLDER CELLS.csv [--every N] [--threads T] [--at-least SHARE]");
  options.model = places[0];
  options.run = places[1];
  options.cells = places[2];
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return judge(read_options({argv + 1, argv + argc}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "judge: %s\n", error.what());
    return 2;
  }
}
