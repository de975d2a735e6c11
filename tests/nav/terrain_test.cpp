// Kerbs, ramps and pits as a scan shows them, and heights and verdicts against their plain
// definitions.
#include "nav/terrain.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "hal/angles.hpp"
#include "tests/support/random_site.hpp"

namespace terrain_tests {
namespace {

using Eigen::Vector2d;
using nav::Ground;
using support::Dice;
using Points = std::vector<Eigen::Vector3f>;
using Heights = std::function<double(double, double)>;  // Of the ground at x, y.

constexpr nav::TerrainLimits kLimits{.slope_max_rad = 15 * hal::kDeg,
                                     .step_max_m = 0.1,
                                     .footprint_m = 0.5,
                                     .range_max_m = 12,
                                     .overhead_m = 1.6,
                                     .ground_z_m = 0};
const nav::RasterGrid kGrid{.W_min_m = {-10, -10}, .cell_m = 0.25, .nx = 80, .ny = 80};

// A scanner 1.8 m above the origin, with noise along its beams: where each first meets the ground.
Points scan(const Heights& ground, double step_deg = 0.4, std::uint64_t seed = 1) {
  Dice dice(seed);
  Points points;
  for (double azimuth = 0; azimuth < 360; azimuth += step_deg)
    for (double elevation = -60; elevation < -8; elevation += step_deg) {
      const double a = azimuth * hal::kDeg, e = elevation * hal::kDeg;
      const Eigen::Vector3d way(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      double range_m = 1;
      const auto above_m = [&](double at_m) {
        const Eigen::Vector3d p = at_m * way;
        return 1.8 + p.z() - ground(p.x(), p.y());
      };
      while (range_m < 13 && above_m(range_m) > 0) range_m += 0.02;
      if (range_m >= 13) continue;
      double low_m = range_m - 0.02, high_m = range_m;
      for (int i = 0; i < 12; ++i)
        (above_m((low_m + high_m) / 2) > 0 ? low_m : high_m) = (low_m + high_m) / 2;
      const Eigen::Vector3d p = (high_m + dice.uniform(-0.02, 0.02)) * way;
      points.emplace_back(p.x(), p.y(), 1.8 + p.z());
    }
  return points;
}

std::vector<Ground> judged(const Points& points, const nav::TerrainLimits& limits = kLimits) {
  return nav::judge_ground(nav::ground_heights(points, {0, 0}, kGrid, limits), kGrid, limits);
}

// How many cells with their middle in the box are judged so.
int count(const std::vector<Ground>& ground, Ground as, const Vector2d& low, const Vector2d& high) {
  int cells = 0;
  for (int y = 0; y < kGrid.ny; ++y)
    for (int x = 0; x < kGrid.nx; ++x) {
      const Vector2d at = kGrid.center_m(x, y);
      const bool inside = (at.array() > low.array()).all() && (at.array() < high.array()).all();
      cells += inside && ground[kGrid.index(x, y)] == as;
    }
  return cells;
}

int not_drivable(const std::vector<Ground>& ground, const Vector2d& low = {-9, -9},
                 const Vector2d& high = {9, 9}) {
  return count(ground, Ground::step, low, high) + count(ground, Ground::slope, low, high);
}

TEST(Terrain, LevelGroundIsDrivable) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto ground = judged(scan([](double, double) { return 0.0; }, 0.4, seed));
    EXPECT_EQ(not_drivable(ground), 0);
    EXPECT_GT(count(ground, Ground::drivable, {-6, -6}, {6, 6}), 1500);
  }
}

// From a road 3 m away, and from the pavement above it.
TEST(Terrain, AKerbHigherThanTheStepIsOneAndALowerOneIsNot) {
  for (const double sign : {1.0, -1.0}) {
    const auto kerb = [sign](double height_m) {
      return judged(scan([=](double x, double) { return x > 3 ? sign * height_m : 0.0; }));
    };
    EXPECT_EQ(not_drivable(kerb(0.06)), 0) << sign;
    const auto high = kerb(0.15);
    // Along 8 m of kerb, no gap that a robot would fit through.
    for (double y = -4; y < 4; y += 0.5)
      EXPECT_GT(count(high, Ground::step, {2.5, y}, {3.7, y + 0.5}), 0) << sign << " at " << y;
    EXPECT_EQ(not_drivable(high, {-9, -9}, {2.5, 9}), 0) << sign;
    EXPECT_EQ(not_drivable(high, {4, -9}, {9, 9}), 0) << sign;
  }
}

// 4 m long and wide, then level again.
TEST(Terrain, ARampSteeperThanTheLimitIsNotDrivableAndAFlatterOneIs) {
  for (const double sign : {1.0, -0.5}) {
    const auto ramp = [sign](double slope_deg) {
      const double rise = sign * std::tan(slope_deg * hal::kDeg);
      return judged(scan([=](double x, double) { return rise * std::clamp(x - 2, 0.0, 4.0); }));
    };
    EXPECT_EQ(not_drivable(ramp(sign > 0 ? 13 : 24)), 0) << sign;
    const auto steep = ramp(sign > 0 ? 18 : 35);
    int rows = 0;
    for (double y = -2; y < 2; y += 0.25) rows += not_drivable(steep, {2, y}, {6, y + 0.25}) > 3;
    EXPECT_GE(rows, 15) << sign;
    EXPECT_EQ(not_drivable(steep, {-9, -9}, {1, 9}), 0) << sign;
  }
}

// 0.6 m deep: the scanner sees its far side and part of its floor, and nothing behind its near
// edge.
TEST(Terrain, APitIsClosedAlongItsNearEdgeToo) {
  const auto ground = judged(
      scan([](double x, double y) { return x > 2 && x < 5 && std::abs(y) < 2 ? -0.6 : 0.0; }));
  for (double y = -1.5; y < 1.5; y += 0.5) {
    EXPECT_GT(not_drivable(ground, {1.7, y}, {2.8, y + 0.5}), 0) << "near edge at " << y;
    EXPECT_GT(not_drivable(ground, {4.5, y}, {5.5, y + 0.5}), 0) << "far edge at " << y;
  }
  EXPECT_EQ(not_drivable(ground, {-9, -9}, {1.5, 9}), 0);
  EXPECT_EQ(not_drivable(ground, {6, -9}, {9, 9}), 0);
}

// A board 1.8 m up: nothing stands there.
TEST(Terrain, WhatHangsHighOverTheGroundIsNotOnIt) {
  Points points = scan([](double, double) { return 0.0; });
  for (double x = 2; x < 4; x += 0.02)
    for (double y = -1; y < 1; y += 0.02) points.emplace_back(x, y, 1.75);
  EXPECT_EQ(not_drivable(judged(points)), 0);
}

// Two stray points under the ground are not it; three are.
TEST(Terrain, FewPointsAreNoGround) {
  for (const int strays : {2, 3}) {
    Points points = scan([](double, double) { return 0.0; });
    for (int i = 0; i < strays; ++i) points.emplace_back(2.1F, 0.1F, -0.5F);
    EXPECT_EQ(not_drivable(judged(points)) > 0, strays == 3);
  }
}

// As the header defines them: points of a cell in order, bands from each of them on.
float plain_height_m(std::vector<double> heights_m, double overhead_m) {
  for (double& height_m : heights_m)
    height_m = std::max(0.0, std::floor((height_m - nav::kLowestM) / nav::kBinM));
  std::erase_if(heights_m, [&](double bin) {
    return bin >= std::ceil((overhead_m - nav::kLowestM) / nav::kBinM);
  });
  std::ranges::sort(heights_m);
  for (const double low : heights_m) {
    std::vector<double> band;
    for (const double bin : heights_m)
      if (bin >= low && bin < low + nav::kBandBins) band.push_back(bin);
    if (static_cast<int>(band.size()) < nav::kSupportMin) continue;
    double sum = 0;
    for (const double bin : band) sum += nav::kLowestM + nav::kBinM * (bin + 0.5);
    return static_cast<float>(sum / static_cast<double>(band.size()));
  }
  return std::numeric_limits<float>::quiet_NaN();
}

std::vector<float> plain_heights(const Points& points, const nav::RasterGrid& grid,
                                 const nav::TerrainLimits& limits) {
  std::vector<float> heights_m;
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x) {
      std::vector<double> here_m;
      const Vector2d low = grid.center_m(x, y).array() - grid.cell_m / 2;
      for (const Eigen::Vector3f& p : points) {
        const Vector2d at = p.head<2>().cast<double>();
        const bool inside =
            (at.array() >= low.array()).all() && (at.array() < (low.array() + grid.cell_m)).all();
        if (inside && at.norm() <= limits.range_max_m)
          here_m.push_back(static_cast<double>(p.z()) - limits.ground_z_m);
      }
      heights_m.push_back(plain_height_m(here_m, limits.overhead_m));
    }
  return heights_m;
}

// Every pair of cells in a row or column, and for each cell the plane by least squares.
class Plain {
 public:
  Plain(const std::vector<float>& heights_m, const nav::RasterGrid& grid,
        const nav::TerrainLimits& limits)
      : heights_m_(heights_m), grid_(grid), limits_(limits), step_(grid.size(), false) {
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        for (int n = 1; n <= nav::kGapCells + 1; ++n) {
          compare({x, y}, {x + n, y});
          compare({x, y}, {x, y + n});
        }
  }

  Ground at(int x, int y) const {
    if (step_[grid_.index(x, y)]) return Ground::step;
    if (!known({x, y})) return Ground::unknown;
    return steepness(x, y) > std::tan(limits_.slope_max_rad) ? Ground::slope : Ground::drivable;
  }

  // Of the plane around the cell; 0 where none is sure.
  double steepness(int x, int y) const {
    const double reach_m = std::clamp(limits_.footprint_m, 0.5, 0.7);
    std::vector<Eigen::Vector3d> around;
    for (int v = 0; v < grid_.ny; ++v)
      for (int u = 0; u < grid_.nx; ++u)
        if (const Vector2d off = grid_.center_m(u, v) - grid_.center_m(x, y);
            off.norm() <= reach_m + 1e-9 && known({u, v}) && !step_[grid_.index(u, v)])
          around.emplace_back(off.x(), off.y(), heights_m_[grid_.index(u, v)]);
    if (around.size() < 5) return 0;
    Eigen::MatrixXd a(around.size(), 3);
    Eigen::VectorXd b(around.size());
    for (std::size_t i = 0; i < around.size(); ++i) {
      a.row(static_cast<Eigen::Index>(i)) << around[i].x(), around[i].y(), 1;
      b(static_cast<Eigen::Index>(i)) = around[i].z();
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(a);
    if (solver.rank() < 3) return 0;
    return solver.solve(b).head<2>().norm();
  }

 private:
  using Cell = std::pair<int, int>;

  bool known(const Cell& cell) const {
    return !std::isnan(heights_m_[grid_.index(cell.first, cell.second)]);
  }
  std::vector<Cell> between(const Cell& a, const Cell& b) const {
    std::vector<Cell> cells;
    for (int x = a.first; x <= b.first; ++x)
      for (int y = a.second; y <= b.second; ++y)
        if (Cell(x, y) != a && Cell(x, y) != b) cells.emplace_back(x, y);
    return cells;
  }
  void compare(const Cell& a, const Cell& b) {
    if (!grid_.contains(b.first, b.second) || !known(a) || !known(b)) return;
    const auto gap = between(a, b);
    if (std::ranges::any_of(gap, [&](const Cell& c) { return known(c); })) return;
    const double way_m = grid_.cell_m * static_cast<double>(gap.size() + 1);
    const double rise_m = std::abs(heights_m_[grid_.index(a.first, a.second)] -
                                   heights_m_[grid_.index(b.first, b.second)]);
    if (rise_m <= limits_.step_max_m || rise_m <= way_m * std::tan(limits_.slope_max_rad)) return;
    for (const Cell& c : gap) step_[grid_.index(c.first, c.second)] = true;
    step_[grid_.index(a.first, a.second)] = step_[grid_.index(b.first, b.second)] = true;
  }

  const std::vector<float>& heights_m_;
  const nav::RasterGrid& grid_;
  const nav::TerrainLimits& limits_;
  std::vector<bool> step_;
};

// Slopes, blocks and holes, with few points in each cell.
Points random_ground(Dice& dice) {
  const double rise_x = dice.uniform(-0.3, 0.3), rise_y = dice.uniform(-0.3, 0.3);
  const double edge_m = dice.uniform(-1, 1), edge_height_m = dice.uniform(-0.3, 0.3);
  Points points;
  for (int i = 0; i < 1500; ++i) {
    const double x = dice.uniform(-2, 2), y = dice.uniform(-2, 2);
    double z = rise_x * x + rise_y * y + (x > edge_m ? edge_height_m : 0);
    if (dice.below(60) == 0) z += dice.uniform(-5, 2);
    if (std::abs(x * y) < 0.1) continue;  // Unseen.
    points.emplace_back(x, y, z + dice.uniform(-0.02, 0.02));
  }
  return points;
}

TEST(Terrain, HeightsAndVerdictsAreThoseOfTheirDefinitions) {
  const nav::RasterGrid grid{.W_min_m = {-2.1, -1.9}, .cell_m = 0.25, .nx = 17, .ny = 15};
  std::map<Ground, int> all;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Dice dice(seed);
    const Points points = random_ground(dice);
    nav::TerrainLimits limits = kLimits;
    limits.range_max_m = dice.uniform(1, 4);
    limits.footprint_m = dice.uniform(0.2, 1);
    limits.ground_z_m = dice.uniform(-0.5, 0.5);
    const auto heights_m = nav::ground_heights(points, {0, 0}, grid, limits);
    const auto plain_m = plain_heights(points, grid, limits);
    for (std::size_t i = 0; i < grid.size(); ++i)
      EXPECT_TRUE(std::isnan(heights_m[i]) ? std::isnan(plain_m[i])
                                           : std::abs(heights_m[i] - plain_m[i]) < 1e-6F)
          << "seed " << seed << ": " << heights_m[i] << " and " << plain_m[i];
    const auto ground = nav::judge_ground(heights_m, grid, limits);
    const Plain plain(heights_m, grid, limits);
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const Ground is = ground[grid.index(x, y)];
        ++all[is];
        EXPECT_EQ(static_cast<int>(is), static_cast<int>(plain.at(x, y)))
            << "seed " << seed << " at " << x << ", " << y << ": " << plain.steepness(x, y);
      }
  }
  for (const Ground is : {Ground::unknown, Ground::drivable, Ground::step, Ground::slope})
    EXPECT_GT(all[is], 500) << static_cast<int>(is);
}

}  // namespace
}  // namespace terrain_tests
