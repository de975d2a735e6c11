// Maps as people draw them, by the thousand: repaired, they mean what was drawn, and what is then
// seen is what asking point by point says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "planning/cover.hpp"
#include "tests/planning/visibility_oracle.hpp"
#include "tests/support/random_site.hpp"

namespace planning {
namespace {

using Eigen::Vector2d;
using support::Dice;
using RingM = std::vector<Vector2d>;

constexpr double kSideM = 40;
constexpr double kRadiusM = 0.3;

// On a grid of half metres, so that corners, edges and spikes often meet.
Vector2d drawn_point(Dice& dice) {
  return {dice.below(2 * static_cast<int>(kSideM) + 1) / 2.0,
          dice.below(2 * static_cast<int>(kSideM) + 1) / 2.0};
}

RingM drawn_box(Dice& dice) {
  const Vector2d p = drawn_point(dice);
  const double w = 1 + dice.below(16) / 2.0, h = 1 + dice.below(16) / 2.0;
  return {p, p + Vector2d(w, 0), p + Vector2d(w, h), p + Vector2d(0, h)};
}

RingM drawn_star(Dice& dice) {
  RingM ring;
  for (const nav::PointMm p :
       support::star_mm(dice, drawn_point(dice), dice.uniform(1, 6), 3 + dice.below(6)))
    ring.push_back(nav::to_m(p));
  return ring;
}

RingM drawn_ring(Dice& dice) {
  return dice.below(2) == 0 ? drawn_box(dice) : drawn_star(dice);
}

// Slips of the pen that leave the meaning as it is.
void make_dirty(Dice& dice, RingM& ring) {
  const auto place = [&] { return ring.begin() + dice.below(static_cast<int>(ring.size())); };
  if (dice.below(3) == 0) {  // A vertex repeated.
    const auto at = place();
    ring.insert(at, *at);
  }
  if (dice.below(3) == 0) {  // A spike of no width.
    const auto at = place();
    const Vector2d from = *at;
    ring.insert(at, {from, drawn_point(dice)});
  }
  if (dice.below(3) == 0) {  // A vertex within an edge.
    const Vector2d middle = (ring.front() + ring.back()) / 2;
    ring.push_back(middle);
  }
  if (dice.below(2) == 0) std::reverse(ring.begin(), ring.end());
  if (dice.below(2) == 0) ring.push_back(ring.front());
}

struct Drawing {
  nav::RawSite raw;
  std::vector<std::vector<RingM>> obstacles;  // RingM by ring as meant: outline, then holes.
};

// A hole in a box that touches its border in a corner, an edge or not at all.
RingM hole_in(Dice& dice, const RingM& box) {
  const Vector2d low = box[0], size = box[2] - box[0];
  const double x = dice.below(3) * size.x() / 4, y = dice.below(3) * size.y() / 4;
  const Vector2d p = low + Vector2d(x, y);
  if (dice.below(2) == 0)
    return {p, p + Vector2d(size.x() / 2, 0), p + size / 2, p + Vector2d(0, size.y() / 2)};
  return {p + Vector2d(size.x() / 4, 0), p + Vector2d(size.x() / 2, size.y() / 2),
          p + Vector2d(0, size.y() / 4)};
}

Drawing draw(Dice& dice) {
  Drawing drawing;
  drawing.raw.name = "dirty";
  nav::RawFeature fence{nav::Role::boundary, "fence", "fence", {}, {}, {}, {}, {}, {}};
  fence.polygons_m = {{{{-3, -3}, {kSideM + 9, -3}, {kSideM + 9, kSideM + 9}, {-3, kSideM + 9}}}};
  fence.wall = dice.below(2) == 0;
  drawing.raw.features.push_back(fence);
  const int count = 2 + dice.below(7);
  for (int i = 0; i < count; ++i) {
    std::vector<RingM> rings{drawn_ring(dice)};
    if (dice.below(3) == 0) {
      rings[0] = drawn_box(dice);
      rings.push_back(hole_in(dice, rings[0]));
    }
    if (i > 0 && dice.below(6) == 0) rings = drawing.obstacles.back();  // Drawn twice.
    drawing.obstacles.push_back(rings);
    const std::string name = "obstacle " + std::to_string(i);
    nav::RawFeature feature{nav::Role::obstacle, name, name, {}, {}, {}, {}, {}, {}};
    for (RingM& ring : rings) make_dirty(dice, ring);
    feature.polygons_m = {rings};
    drawing.raw.features.push_back(feature);
  }
  return drawing;
}

double border_distance_m(const std::vector<RingM>& rings, const Vector2d& p) {
  double least_m = 1e9;
  for (const RingM& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      least_m =
          std::min(least_m, nav::distance(nav::Segment2{ring[i], ring[(i + 1) % ring.size()]}, p));
  return least_m;
}

// Even-odd over the rings as meant: inside the outline, outside its holes.
bool inside(const std::vector<RingM>& rings, const Vector2d& p) {
  bool in = false;
  for (const RingM& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      if (a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) > p.x()) in = !in;
    }
  return in;
}

// Points farther from what was drawn than repair may move it lie inside iff they lay inside.
int expect_same_ground(Dice& dice, const Drawing& drawing, const nav::Polygons& obstacles) {
  int asked = 0;
  for (int i = 0; i < 25; ++i) {
    const Vector2d p(dice.uniform(-2, kSideM + 8), dice.uniform(-2, kSideM + 8));
    bool in = false, near = false;
    for (const auto& rings : drawing.obstacles) {
      in = in || inside(rings, p);
      near = near || border_distance_m(rings, p) < 0.01;
    }
    if (near) continue;
    EXPECT_EQ(nav::contains(obstacles, nav::to_mm(p)), in) << p.transpose();
    ++asked;
  }
  return asked;
}

SensorLimits all_limits(Dice& dice) {
  return {.range_min_m = dice.uniform(0, 3),
          .range_max_m = dice.uniform(8, 60),
          .grazing_max_deg = dice.uniform(30, 90),
          .fov_deg = dice.below(2) == 0 ? 360 : dice.uniform(20, 360)};
}

// Places on the target walls, asked one by one. Those within a hair of where the answer changes,
// which floating point cannot tell, are left out.
int expect_same_sight(Dice& dice, const std::vector<Wall>& walls, const Candidate& from) {
  constexpr double kHairM = 1e-5;
  const SensorLimits limits = all_limits(dice);
  const auto seen = Visibility(walls, limits).from(from);
  int asked = 0;
  auto piece = seen.begin();
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const int wall = static_cast<int>(w);
    std::vector<WallPiece> pieces;
    for (; piece != seen.end() && piece->wall == wall; ++piece) pieces.push_back(*piece);
    if (!walls[w].target || dice.below(3) != 0) continue;
    const double length_m = walls[w].length_m();
    const double at_m = dice.uniform(0, length_m);
    const auto in = [&](double margin_m) {
      return std::any_of(pieces.begin(), pieces.end(), [&](const WallPiece& p) {
        return p.from_m - margin_m < at_m && at_m < p.to_m + margin_m;
      });
    };
    const Vector2d a = nav::to_m(walls[w].a), b = nav::to_m(walls[w].b);
    const auto asked_at = [&](double place_m) {
      return !oracle::excluded_by(from, wall, a + place_m / length_m * (b - a), walls, limits);
    };
    // Pieces below kPieceMinM are dropped: not seen there is right too.
    const bool steady = asked_at(at_m - kPieceMinM) == asked_at(at_m) &&
                        asked_at(at_m + kPieceMinM) == asked_at(at_m) && in(kHairM) == in(-kHairM);
    if (!steady) continue;
    EXPECT_EQ(in(0), asked_at(at_m)) << "wall " << w << " at " << at_m;
    ++asked;
  }
  EXPECT_EQ(piece, seen.end());
  return asked;
}

TEST(DirtyMapsByTheThousand, AreRepairedToWhatWasDrawnAndSeenPointByPoint) {
  int usable = 0, repaired = 0, points = 0, places = 0;
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const Drawing drawing = draw(dice);
    const nav::RepairedSite site = nav::repair_site(drawing.raw, 10);
    ASSERT_TRUE(site.errors.empty()) << site.errors.front();
    repaired += !site.repairs.empty();
    const auto areas = nav::free_areas(site.map, kRadiusM, 1);
    if (areas.empty()) continue;
    points += expect_same_ground(dice, drawing, site.map.obstacles);
    const std::vector<Wall> walls = walls_of(site.map, areas.front());
    for (const Candidate& from : draw_candidates(areas.front(), 4, 90, seed))
      places += expect_same_sight(dice, walls, from);
    ++usable;
    if (HasFailure()) break;
  }
  EXPECT_GE(usable, 1000);
  EXPECT_GT(repaired, 1000);
  EXPECT_GT(points, 20000);
  EXPECT_GT(places, 20000);
}

}  // namespace
}  // namespace planning
