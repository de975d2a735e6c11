#include "planning/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace planning {
namespace {

using nav::PointMm;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Interval {
  double from_m, to_m;
};

// The places along a wall that a constraint admits: at most two stretches, in order.
struct Admitted {
  Interval parts[2];
  int count;
};

constexpr Admitted kAll{{{-kInfinite, kInfinite}, {}}, 1};
constexpr Admitted kNone{{}, 0};

Admitted inside(double from_m, double to_m) {
  return {{{from_m, to_m}, {}}, 1};
}
Admitted outside(double from_m, double to_m) {
  return {{{-kInfinite, from_m}, {to_m, kInfinite}}, 2};
}

// How the wall lies to the viewpoint.
struct Bearing {
  double foot_m;      // Of the perpendicular from the viewpoint, along the wall from a.
  double distance_m;  // Of its line.

  Bearing(const Wall& wall, PointMm viewpoint) {
    const PointMm along = wall.b - wall.a;
    const PointMm to_viewpoint = viewpoint - wall.a;
    const double length_mm = std::sqrt(static_cast<double>(nav::dot(along, along)));
    foot_m = static_cast<double>(nav::dot(along, to_viewpoint)) / length_mm / 1000;
    distance_m = std::abs(static_cast<double>(nav::cross(along, to_viewpoint))) / length_mm / 1000;
  }
};

// The three circle cases in one: the wall's line meets the circle in two points or none.
Admitted in_range_max(const Bearing& at, double range_m) {
  if (at.distance_m > range_m) return kNone;
  const double half_m = std::sqrt(range_m * range_m - at.distance_m * at.distance_m);
  return inside(at.foot_m - half_m, at.foot_m + half_m);
}

Admitted beyond_range_min(const Bearing& at, double range_m) {
  if (at.distance_m >= range_m) return kAll;
  const double half_m = std::sqrt(range_m * range_m - at.distance_m * at.distance_m);
  return outside(at.foot_m - half_m, at.foot_m + half_m);
}

Admitted not_grazing(const Bearing& at, double tan_max) {
  const double half_m = at.distance_m * tan_max;
  return inside(at.foot_m - half_m, at.foot_m + half_m);
}

// A border of the field of view: long enough to be exact to 1e-8 rad, short enough for Share.
PointMm direction_at(double angle_rad) {
  constexpr double kLength = 1 << 27;
  return {std::llround(kLength * std::cos(angle_rad)), std::llround(kLength * std::sin(angle_rad))};
}

// Fields of view above 180 deg leave out a wedge that is smaller than that.
Admitted in_field_of_view(const Wall& wall, const Candidate& from, double fov_deg) {
  if (fov_deg >= 360) return kAll;
  const double half_rad = fov_deg / 2 * std::numbers::pi / 180;
  PointMm right = direction_at(from.heading_rad - half_rad);
  PointMm left = direction_at(from.heading_rad + half_rad);
  const bool leaves_out = fov_deg > 180;
  if (leaves_out) std::swap(left, right);
  const PointMm a = wall.a - from.position;
  const PointMm along = wall.b - wall.a;
  ShareRange wedge;
  wedge.restrict(nav::cross(right, a), nav::cross(right, along));
  wedge.restrict(-nav::cross(left, a), -nav::cross(left, along));
  if (wedge.empty()) return leaves_out ? kAll : kNone;
  const double length_m = wall.length_m();
  const double from_m = value(wedge.from) * length_m;
  const double to_m = value(wedge.to) * length_m;
  return leaves_out ? outside(from_m, to_m) : inside(from_m, to_m);
}

using Pieces = std::vector<WallPiece>;

Pieces admitted(const Pieces& pieces, const Admitted& by) {
  Pieces kept;
  for (const WallPiece& piece : pieces) {
    for (int i = 0; i < by.count; ++i) {
      const double from_m = std::max(piece.from_m, by.parts[i].from_m);
      const double to_m = std::min(piece.to_m, by.parts[i].to_m);
      if (from_m < to_m) kept.push_back({piece.wall, from_m, to_m});
    }
  }
  return kept;
}

// The pieces less those in `kept`; both of one wall, in order, kept within pieces.
Pieces rest(const Pieces& pieces, const Pieces& kept) {
  Pieces gone;
  auto next = kept.begin();
  for (const WallPiece& piece : pieces) {
    double from_m = piece.from_m;
    for (; next != kept.end() && next->to_m <= piece.to_m; ++next) {
      if (from_m < next->from_m) gone.push_back({piece.wall, from_m, next->from_m});
      from_m = next->to_m;
    }
    if (from_m < piece.to_m) gone.push_back({piece.wall, from_m, piece.to_m});
  }
  return gone;
}

WallPiece in_m(const SharePiece& piece, const std::vector<Wall>& walls) {
  const double length_m = walls[static_cast<std::size_t>(piece.wall)].length_m();
  return {piece.wall, value(piece.from) * length_m, value(piece.to) * length_m};
}

// The constraints on one wall after line of sight, in their order.
struct Chain {
  static constexpr int kLength = 4;
  Admitted by[kLength];

  Chain(const Wall& wall, const Candidate& from, const SensorLimits& limits, double grazing_tan) {
    const Bearing at(wall, from.position);
    by[0] = in_range_max(at, limits.range_max_m);
    by[1] = beyond_range_min(at, limits.range_min_m);
    by[2] = limits.grazing_max_deg >= 90 ? kAll : not_grazing(at, grazing_tan);
    by[3] = in_field_of_view(wall, from, limits.fov_deg);
  }
};
constexpr Excluded kExcludedBy[Chain::kLength] = {Excluded::range_max, Excluded::range_min,
                                                  Excluded::grazing, Excluded::field_of_view};

// Calls see() with what all constraints from the k-th on admit of the piece, in order.
template <class See>
void clip(const WallPiece& piece, const Chain& chain, int k, const See& see) {
  if (k == Chain::kLength) return see(piece);
  for (int i = 0; i < chain.by[k].count; ++i) {
    const Interval& part = chain.by[k].parts[i];
    const WallPiece kept{piece.wall, std::max(piece.from_m, part.from_m),
                         std::min(piece.to_m, part.to_m)};
    if (kept.from_m < kept.to_m) clip(kept, chain, k + 1, see);
  }
}

void check(const SensorLimits& limits) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument(what); };
  if (!(limits.range_min_m >= 0 && limits.range_min_m < limits.range_max_m))
    refuse("range_min_m must be at least 0 and below range_max_m");
  if (!(limits.grazing_max_deg > 0 && limits.grazing_max_deg <= 90))
    refuse("grazing_max_deg must be above 0 and at most 90");
  if (!(limits.fov_deg > 0 && limits.fov_deg <= 360))
    refuse("fov_deg must be above 0 and at most 360");
}

const SensorLimits& checked(const SensorLimits& limits) {
  check(limits);
  return limits;
}

struct Words {
  std::string_view name, meaning, remedy;
};

const Words& words(Excluded reason) {
  static constexpr Words kWords[] = {
      {"occluded", "Hidden from every place where the scanner could stand.",
       "Open up more ground (regions, keep-outs), or scan from a mast or the air."},
      {"range_max", "Farther than the scanner reaches from every place that sees it.",
       "Raise range_max_m if the scanner allows it, or open up ground nearer to it."},
      {"range_min", "Closer than the scanner measures from every place that sees it.",
       "Lower range_min_m if the scanner allows it, or open up ground farther from it."},
      {"grazing", "Seen only at a flatter angle than the grazing limit.",
       "Open up ground in front of it, try more candidates, or raise grazing_max_deg."},
      {"field_of_view", "No candidate that could see it was facing it.",
       "Try more candidates, or widen fov_deg."},
      {"overlap", "The stations that see it overlap the others too little to be registered.",
       "Lower overlap_min, or try more candidates."},
      {"gain", "A station for it would add less than the smallest gain worth a scan.",
       "Lower gain_min or gain_enough_m to have such pieces covered too."},
      {"goal", "The coverage goal was reached without it.", "Raise coverage_goal."},
      {"given", "None of the stations given by the plan file sees it; others could.",
       "Add a station to the plan file, or leave it out to have one planned."},
  };
  return kWords[static_cast<std::size_t>(reason)];
}

}  // namespace

std::string_view name(Excluded reason) {
  return words(reason).name;
}
std::string_view meaning(Excluded reason) {
  return words(reason).meaning;
}
std::string_view remedy(Excluded reason) {
  return words(reason).remedy;
}

Visibility::Visibility(const std::vector<Wall>& walls, const SensorLimits& limits)
    : walls_(walls),
      limits_(checked(limits)),
      grazing_tan_(std::tan(limits.grazing_max_deg * std::numbers::pi / 180)),
      sight_(walls) {}

std::vector<WallPiece> Visibility::from(const Candidate& viewpoint) const {
  // 1 mm more than needed, so that rounding cannot matter.
  const auto in_sight = sight_.from(viewpoint.position, limits_.range_max_m * 1000 + 1);
  Pieces seen;
  std::optional<Chain> chain;  // Of the wall of the last piece.
  for (std::size_t i = 0; i < in_sight.size(); ++i) {
    const int wall = in_sight[i].wall;
    if (i == 0 || wall != in_sight[i - 1].wall)
      chain.emplace(walls_[static_cast<std::size_t>(wall)], viewpoint, limits_, grazing_tan_);
    clip(in_m(in_sight[i], walls_), *chain, 0, [&](const WallPiece& piece) {
      if (piece.to_m - piece.from_m >= kPieceMinM) seen.push_back(piece);
    });
  }
  return seen;
}

std::vector<WallPiece> Visibility::in_sight(PointMm viewpoint) const {
  Pieces pieces;
  for (const SharePiece& piece : sight_.from(viewpoint, kInfinite)) {
    const WallPiece in_metres = in_m(piece, walls_);
    if (in_metres.from_m < in_metres.to_m) pieces.push_back(in_metres);
  }
  return pieces;
}

std::vector<Outcome> Visibility::explain(const Candidate& viewpoint) const {
  const Pieces in_sight = this->in_sight(viewpoint.position);
  std::vector<Outcome> outcomes;
  auto next = in_sight.begin();
  for (std::size_t i = 0; i < walls_.size(); ++i) {
    if (!walls_[i].target || walls_[i].a == walls_[i].b) continue;
    const int index = static_cast<int>(i);
    const std::size_t first = outcomes.size();
    const auto tell = [&](const Pieces& pieces, std::optional<Excluded> why) {
      for (const WallPiece& piece : pieces) outcomes.push_back({piece, why});
    };
    Pieces pieces;
    for (; next != in_sight.end() && next->wall == index; ++next) pieces.push_back(*next);
    tell(rest({{index, 0, walls_[i].length_m()}}, pieces), Excluded::occluded);
    const Chain chain(walls_[i], viewpoint, limits_, grazing_tan_);
    for (int k = 0; k < Chain::kLength; ++k) {
      Pieces kept = admitted(pieces, chain.by[k]);
      tell(rest(pieces, kept), kExcludedBy[k]);
      pieces = std::move(kept);
    }
    tell(pieces, std::nullopt);
    std::sort(outcomes.begin() + static_cast<std::ptrdiff_t>(first), outcomes.end(),
              [](const Outcome& p, const Outcome& q) { return p.piece.from_m < q.piece.from_m; });
  }
  return outcomes;
}

std::vector<WallPiece> visible_walls(const Candidate& viewpoint, const std::vector<Wall>& walls,
                                     const SensorLimits& limits) {
  return Visibility(walls, limits).from(viewpoint);
}

}  // namespace planning
