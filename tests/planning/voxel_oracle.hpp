// The definitions of the voxel map and of Phase II as literal slow loops. What the planner computes
// fast has to equal this in every voxel and every cell.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <vector>

#include "planning/next_best_view.hpp"
#include "planning/voxel_beams.hpp"
#include "planning/voxel_map.hpp"

namespace oracle {

using planning::BoundaryVoxel;
using planning::Voxel;
using planning::VoxelMap;
using planning::VoxelState;

// ------------------------------------------------------------------ segments

// A point in units in which a voxel is `side` long, at no multiple of side.
struct Point {
  std::int64_t x, y, z;
};

inline std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b != 0 && (a < 0) != (b < 0));
}

// The voxels that the segment meets, by definition: between two consecutive crossings of voxel
// faces it is inside one voxel, the one that holds the point half way. For coordinates up to 2^17.
inline std::vector<Voxel> voxels_by_crossings(Point a, Point b, std::int64_t side) {
  struct Time {
    std::int64_t num, den;  // den > 0
  };
  std::vector<Time> times{{0, 1}, {1, 1}};
  const auto cross = [&](std::int64_t from, std::int64_t to) {
    const std::int64_t low = std::min(from, to), high = std::max(from, to);
    for (std::int64_t face = floor_div(low, side) * side; face < high; face += side)
      if (face > low)
        times.push_back(to > from ? Time{face - from, to - from} : Time{from - face, from - to});
  };
  cross(a.x, b.x);
  cross(a.y, b.y);
  cross(a.z, b.z);
  const auto before = [](Time s, Time t) { return s.num * t.den < t.num * s.den; };
  std::sort(times.begin(), times.end(), before);
  std::vector<Voxel> result;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const Time s = times[i - 1], t = times[i];
    if (!before(s, t)) continue;
    const std::int64_t num = s.num * t.den + t.num * s.den, den = 2 * s.den * t.den;
    const auto at = [&](std::int64_t from, std::int64_t to) {
      return static_cast<int>(floor_div(from * den + (to - from) * num, den * side));
    };
    result.push_back({at(a.x, b.x), at(a.y, b.y), at(a.z, b.z)});
  }
  return result;
}

// The same by stepping from face to face, all axes of a tie at once. visit(Voxel) returns false to
// stop. For segments of up to 1000 voxels.
template <class Visit>
void walk(Point a, Point b, std::int64_t side, const Visit& visit) {
  const std::int64_t d[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
  const std::int64_t from[3] = {a.x, a.y, a.z}, to[3] = {b.x, b.y, b.z};
  const auto weight = [&](int i) { return d[i] == 0 ? std::int64_t{1} : std::abs(d[i]); };
  int voxel[3], sign[3], left[3];
  std::int64_t next[3], step[3];  // Crossing times, times the product of all weights.
  for (int i = 0; i < 3; ++i) {
    voxel[i] = static_cast<int>(floor_div(from[i], side));
    left[i] = static_cast<int>(std::abs(floor_div(to[i], side) - voxel[i]));
    sign[i] = d[i] < 0 ? -1 : 1;
    const std::int64_t face = (voxel[i] + (d[i] > 0)) * side;
    const std::int64_t others = weight((i + 1) % 3) * weight((i + 2) % 3);
    next[i] = left[i] > 0 ? std::abs(face - from[i]) * others : INT64_MAX;
    step[i] = side * others;
  }
  while (visit(Voxel{voxel[0], voxel[1], voxel[2]})) {
    const std::int64_t now = std::min({next[0], next[1], next[2]});
    if (now == INT64_MAX) return;
    for (int i = 0; i < 3; ++i) {
      if (next[i] != now) continue;
      voxel[i] += sign[i];
      next[i] = --left[i] > 0 ? next[i] + step[i] : INT64_MAX;
    }
  }
}

// ------------------------------------------------------------------ insertion

inline float trusted(const hal::ScanCloud& scan, std::int64_t column, std::int64_t row, int window,
                     double range_max_m, bool wraps) {
  const std::int64_t columns = scan.pattern.columns, rows = scan.pattern.rows;
  const auto range = [&](std::int64_t c, std::int64_t r) {
    return scan.ranges_m[static_cast<std::size_t>(c * rows + r)];
  };
  if (range(column, row) != 0) return 0;
  float nearest = static_cast<float>(range_max_m);
  for (std::int64_t c = column - window; c <= column + window; ++c)
    for (std::int64_t r = row - window; r <= row + window; ++r) {
      if (r < 0 || r >= rows || (!wraps && (c < 0 || c >= columns))) continue;
      const float neighbour = range((c + columns * (window + 1)) % columns, r);
      if (neighbour > 0) nearest = std::min(nearest, neighbour);
    }
  return nearest;
}

// Whether two segments come within margin_m of each other, by walking along the first: from each
// point on it as far as the nearest point of the second is away, less the margin.
inline bool within(const planning::WallLine& wall, Eigen::Vector2d from, const Eigen::Vector2d& to,
                   double margin_m) {
  const Eigen::Vector2d along = wall.W_to_m - wall.W_from_m;
  while (true) {
    const double share = (from - wall.W_from_m).dot(along) / std::max(along.squaredNorm(), 1e-300);
    const double off_m = (wall.W_from_m + std::clamp(share, 0.0, 1.0) * along - from).norm();
    if (off_m <= margin_m) return true;
    const double left_m = (to - from).norm(), step_m = off_m - margin_m + 1e-9;
    if (step_m >= left_m) {
      if (left_m == 0) return false;
      from = to;
    } else {
      from += step_m / left_m * (to - from);
    }
  }
}

// A beam that would have met a mapped wall too near to be measured.
inline bool met_too_near(const planning::VoxelGrid& grid, const planning::LatticePoint& start,
                         const planning::LatticePoint& end, const planning::InsertConfig& config) {
  const auto W_at_m = [&](const planning::LatticePoint& p) -> Eigen::Vector2d {
    return grid.W_min_m.head<2>() +
           grid.voxel_m / 2048 *
               Eigen::Vector2d(static_cast<double>(p.x), static_cast<double>(p.y));
  };
  return std::any_of(config.walls.begin(), config.walls.end(), [&](const auto& wall) {
    return within(wall, W_at_m(start), W_at_m(end), config.walls_margin_m);
  });
}

// Calls visit(start, end, has_return) for every beam that says something, in order.
template <class Visit>
void for_beams(const planning::VoxelGrid& grid, const hal::ScanCloud& scan,
               const Eigen::Isometry3d& T_W_S, const planning::InsertConfig& config,
               const Visit& visit) {
  const planning::BeamFan fan(grid, scan, T_W_S);
  const double turn = scan.pattern.columns * std::abs(scan.pattern.azimuth_step_rad);
  const bool wraps = std::abs(turn - 2 * M_PI) < std::abs(scan.pattern.azimuth_step_rad) / 2;
  const std::uint32_t rows = scan.pattern.rows;
  for (std::uint32_t c = 0; c < scan.pattern.columns; ++c)
    for (std::uint32_t r = 0; r < rows; ++r) {
      float range_m = scan.ranges_m[std::size_t{c} * rows + r];
      if (range_m != 0) {
        if (range_m > 0 && range_m >= config.range_min_m && range_m <= config.range_max_m)
          visit(fan.start(c, r), fan.end(c, r, range_m), true);
        continue;
      }
      if (!config.carve_no_return) continue;
      const auto range_min_m = static_cast<float>(config.range_min_m);
      if (met_too_near(grid, fan.start(c, r), fan.end(c, r, range_min_m), config)) continue;
      range_m = trusted(scan, c, r, config.no_return_window, config.range_max_m, wraps);
      if (config.ground_z_m && fan.climb(c, r) < 0) {
        const double ground = (*config.ground_z_m - grid.W_min_m.z()) / grid.voxel_m;
        const double floor_m =
            grid.W_min_m.z() + grid.voxel_m * (std::ceil(ground - 1e-6) + 2.0 / 1024);
        const double height_m = T_W_S.translation().z() - floor_m + fan.start_up_m(c, r);
        range_m = std::min(range_m, static_cast<float>(std::max(0.0, height_m / -fan.climb(c, r))));
      }
      if (range_m > 0) visit(fan.start(c, r), fan.end(c, r, range_m), false);
    }
}

// Calls visit(v) for the voxels of the box on the beam's way, the one of its end among them.
template <class Visit>
void walk_beam(const planning::VoxelGrid& grid, const planning::LatticePoint& start,
               const planning::LatticePoint& end, const Visit& visit) {
  bool inside = false;
  walk({start.x, start.y, start.z}, {end.x, end.y, end.z}, 2048, [&](Voxel v) {
    if (!grid.contains(v)) return !inside;
    inside = true;
    visit(v);
    return true;
  });
}

// VoxelMap::insert as the paper says it; carving by walking every beam.
inline void insert(VoxelMap& map, const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S,
                   const planning::InsertConfig& config) {
  const planning::VoxelGrid& grid = map.grid();
  for_beams(grid, scan, T_W_S, config, [&](const auto&, const auto& end, bool has_return) {
    if (has_return && grid.contains(planning::voxel_of(end)))
      map.set(planning::voxel_of(end), VoxelState::seen_occupied);
  });
  for_beams(grid, scan, T_W_S, config, [&](const auto& start, const auto& end, bool) {
    walk_beam(grid, start, end, [&](Voxel v) {
      if (map.at(v) == VoxelState::unseen) map.set(v, VoxelState::seen_empty);
    });
  });
}

// planning::BeamCounts by its definition, beam after beam, without an end to counting.
struct BeamCounts {
  std::map<Voxel, std::int64_t> hits, passes;

  void add(const planning::VoxelGrid& grid, const hal::ScanCloud& scan,
           const Eigen::Isometry3d& T_W_S, const planning::InsertConfig& config) {
    for_beams(grid, scan, T_W_S, config, [&](const auto& start, const auto& end, bool has_return) {
      const Voxel last = planning::voxel_of(end);
      if (has_return && grid.contains(last)) ++hits[last];
      walk_beam(grid, start, end, [&](Voxel v) {
        if (v != last) ++passes[v];
      });
    });
  }
};

// The same carving by a plain dense walk made to be fast (one byte per voxel, no look at what it
// knows already): what VoxelMap::insert is measured against. The beams' reach is shared.
inline void insert_densely(VoxelMap& map, const hal::ScanCloud& scan,
                           const Eigen::Isometry3d& T_W_S, const planning::InsertConfig& config) {
  const planning::VoxelGrid& grid = map.grid();
  const planning::BeamFan fan(grid, scan, T_W_S);
  const planning::BeamReach reach = planning::beam_reach(scan, grid, T_W_S, fan, config);
  const std::uint32_t rows = scan.pattern.rows;
  std::vector<std::uint8_t> crossed(grid.size());
  const auto index = [&](Voxel v) {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(grid.ny) +
            static_cast<std::size_t>(v.y)) *
               static_cast<std::size_t>(grid.nx) +
           static_cast<std::size_t>(v.x);
  };
  for (std::uint32_t c = 0; c < scan.pattern.columns; ++c)
    for (std::uint32_t r = 0; r < rows; ++r) {
      const std::size_t beam = std::size_t{c} * rows + r;
      if (!(reach.reach_m[beam] > 0)) continue;
      const planning::LatticePoint start = fan.start(c, r);
      const planning::LatticePoint end = fan.end(c, r, reach.reach_m[beam]);
      if (scan.ranges_m[beam] > 0 && grid.contains(planning::voxel_of(end)))
        map.set(planning::voxel_of(end), VoxelState::seen_occupied);
      walk({start.x, start.y, start.z}, {end.x, end.y, end.z}, 2048, [&](Voxel v) {
        if (!grid.contains(v)) return false;
        crossed[index(v)] = 1;
        return true;
      });
    }
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (crossed[index({x, y, z})] != 0 && map.at({x, y, z}) == VoxelState::unseen)
          map.set({x, y, z}, VoxelState::seen_empty);
}

// Voxels of the state with a seen-empty neighbour behind some face.
inline std::vector<BoundaryVoxel> exposed(const VoxelMap& map, VoxelState state) {
  const Voxel beside[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
  std::vector<BoundaryVoxel> result;
  for (int z = 0; z < map.grid().nz; ++z)
    for (int y = 0; y < map.grid().ny; ++y)
      for (int x = 0; x < map.grid().nx; ++x) {
        if (map.at({x, y, z}) != state) continue;
        unsigned faces = 0;
        for (int f = 0; f < 6; ++f)
          if (map.at({x + beside[f].x, y + beside[f].y, z + beside[f].z}) == VoxelState::seen_empty)
            faces |= 1U << f;
        if (faces != 0) result.push_back({{x, y, z}, static_cast<std::uint8_t>(faces)});
      }
  return result;
}

inline std::vector<BoundaryVoxel> boundary_unseen(const VoxelMap& map) {
  return exposed(map, VoxelState::unseen);
}

// ------------------------------------------------------------------ Phase II

inline bool counts_geometrically(const BoundaryVoxel& u, Voxel p,
                                 const planning::ViewLimits& limits, double voxel_m) {
  const planning::ViewRule rule(limits, voxel_m);
  const Voxel d{p.x - u.v.x, p.y - u.v.y, p.z - u.v.z};
  const std::int64_t n2 =
      std::int64_t{d.x} * d.x + std::int64_t{d.y} * d.y + std::int64_t{d.z} * d.z;
  if (n2 < rule.distance2_min() || n2 > rule.distance2_max()) return false;
  const int along[6] = {-d.x, d.x, -d.y, d.y, -d.z, d.z};
  for (int f = 0; f < 6; ++f)
    if ((u.faces >> f & 1) != 0 && along[f] > 0 &&
        static_cast<double>(std::int64_t{along[f]} * along[f]) >=
            rule.cos2_grazing() * static_cast<double>(n2) &&
        rule.dense(std::int64_t{along[f]} * along[f], n2, n2 - std::int64_t{d.z} * d.z))
      return true;
  return false;
}

// Whether every voxel between the two centres is seen-empty.
inline bool visible(const VoxelMap& map, Voxel u, Voxel p) {
  bool clear = true;
  walk({2 * u.x + 1, 2 * u.y + 1, 2 * u.z + 1}, {2 * p.x + 1, 2 * p.y + 1, 2 * p.z + 1}, 2,
       [&](Voxel v) {
         clear = v == u || v == p || map.at(v) == VoxelState::seen_empty;
         return clear;
       });
  return clear;
}

// The same from the sorted crossings.
inline bool visible_by_crossings(const VoxelMap& map, Voxel u, Voxel p) {
  for (const Voxel v : voxels_by_crossings({2 * u.x + 1, 2 * u.y + 1, 2 * u.z + 1},
                                           {2 * p.x + 1, 2 * p.y + 1, 2 * p.z + 1}, 2))
    if (v != u && v != p && map.at(v) != VoxelState::seen_empty) return false;
  return true;
}

// Algorithm 2, lines 9-11: every candidate against every boundary voxel, pruned by range and faces
// before walking.
inline std::vector<std::uint32_t> tally(const VoxelMap& map,
                                        const std::vector<BoundaryVoxel>& boundary,
                                        const std::vector<Voxel>& candidates,
                                        const planning::ViewLimits& limits) {
  std::vector<std::uint32_t> result;
  for (const Voxel p : candidates) {
    std::uint32_t count = 0;
    for (const BoundaryVoxel& u : boundary)
      count += counts_geometrically(u, p, limits, map.grid().voxel_m) && visible(map, u.v, p);
    result.push_back(count);
  }
  return result;
}

}  // namespace oracle
