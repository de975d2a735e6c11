#include "planning/why_wall.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "hal/angles.hpp"
#include "nav/segment_distance.hpp"
#include "nav/words.hpp"

namespace planning {
namespace {

using Eigen::Vector2d;

struct Meeting {
  int wall{};
  double share{};  // Of the way from the station to the place.
};

// The first wall that the open segment meets; with its inside, or with an end too.
std::optional<Meeting> first_met(const std::vector<Wall>& walls, int asked, const Vector2d& from_m,
                                 const Vector2d& to_m, bool ends_too) {
  constexpr double kTooNearTheEnds = 1e-9;
  std::optional<Meeting> first;
  const Vector2d way = to_m - from_m;
  for (int i = 0; i < static_cast<int>(walls.size()); ++i) {
    const Wall& wall = walls[static_cast<std::size_t>(i)];
    if (i == asked || wall.a == wall.b) continue;
    const Vector2d a = nav::to_m(wall.a) - from_m, b = nav::to_m(wall.b) - from_m;
    const double of_a = nav::cross2(way, a), of_b = nav::cross2(way, b),
                 turn = nav::cross2(way, b - a);
    if (ends_too ? of_a * of_b > 0 : of_a * of_b >= 0) continue;
    if (turn == 0) continue;
    const double share = nav::cross2(a, b - a) / turn;
    if (share <= kTooNearTheEnds || share >= 1 - kTooNearTheEnds) continue;
    if (!first || share < first->share) first = Meeting{i, share};
  }
  return first;
}

// The outcome at the place.
std::optional<Excluded> outcome_at(const Visibility& visibility, int wall, double at_m,
                                   const Candidate& station) {
  for (const Outcome& outcome : visibility.explain(station))
    if (outcome.piece.wall == wall && at_m <= outcome.piece.to_m) return outcome.excluded;
  return Excluded::occluded;  // Not reached: the outcomes of a target cover it.
}

void check(const std::vector<Wall>& walls, int wall, double at_m) {
  const auto refuse = [](const char* what) { throw std::invalid_argument(what); };
  if (wall < 0 || wall >= static_cast<int>(walls.size())) refuse("why: there is no such wall");
  const Wall& asked = walls[static_cast<std::size_t>(wall)];
  if (!asked.target || asked.a == asked.b) refuse("why: the wall is not a target");
  if (!(at_m >= 0) || !(at_m <= asked.length_m())) refuse("why: the place is not on the wall");
}

std::string occluded_text(const WhyWall& why) {
  if (why.behind) return "hidden: the station is behind this wall";
  if (!why.occluder) return "hidden behind a corner";
  return "hidden by wall " + std::to_string(*why.occluder) + " at (" +
         nav::decimal(why.W_occluder_m.x()) + ", " + nav::decimal(why.W_occluder_m.y()) + ")";
}

}  // namespace

WhyWall why_wall(const Visibility& visibility, int wall, double at_m, const Candidate& station) {
  const std::vector<Wall>& walls = visibility.walls();
  check(walls, wall, at_m);
  const Wall& asked = walls[static_cast<std::size_t>(wall)];
  const Vector2d a = nav::to_m(asked.a), along = (nav::to_m(asked.b) - a).normalized();
  const Vector2d place = a + at_m * along, from = nav::to_m(station.position);
  const Vector2d way = place - from;
  WhyWall why;
  why.limits = visibility.limits();
  why.excluded = outcome_at(visibility, wall, at_m, station);
  why.distance_m = way.norm();
  // The free side is on the right of a -> b.
  why.angle_deg = hal::degrees(std::atan2(std::abs(way.dot(along)), nav::cross2(along, way)));
  why.heading_deg = hal::degrees(
      std::remainder(std::atan2(way.y(), way.x()) - station.heading_rad, 2 * std::numbers::pi));
  if (why.excluded != Excluded::occluded) return why;
  why.behind = nav::side(asked.a, asked.b, station.position) >= 0;
  auto met = first_met(walls, wall, from, place, false);
  if (!met && !why.behind) met = first_met(walls, wall, from, place, true);
  if (met) {
    why.occluder = met->wall;
    why.W_occluder_m = from + met->share * way;
  }
  return why;
}

std::string text(const WhyWall& why) {
  const std::string far = nav::in_m(why.distance_m) + " away";
  const std::string angle = nav::in_deg(why.angle_deg) + " from the wall's normal";
  if (!why.excluded) return "imaged: " + far + ", " + angle;
  switch (*why.excluded) {
    case Excluded::occluded:
      return occluded_text(why);
    case Excluded::range_max:
      return "out of range: " + far + ", the scanner reaches " + nav::in_m(why.limits.range_max_m);
    case Excluded::range_min:
      return "too near: " + far + ", the scanner measures from " +
             nav::in_m(why.limits.range_min_m) + " on";
    case Excluded::grazing:
      return "too flat: the beam meets the wall " + angle + ", the limit is " +
             nav::in_deg(why.limits.grazing_max_deg);
    case Excluded::field_of_view:
      return "outside the field of view: " + nav::in_deg(std::abs(why.heading_deg)) + " to the " +
             (why.heading_deg >= 0 ? "left" : "right") + " of the heading, the limit is " +
             nav::in_deg(why.limits.fov_deg / 2);
    default:
      return std::string(name(*why.excluded));  // Of a cover, not of one station.
  }
}

}  // namespace planning
