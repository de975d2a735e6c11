// Phase I (Algorithm 1 of the paper): which stations cover the walls. Values in, values out.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "nav/free_space.hpp"
#include "nav/geometry.hpp"
#include "nav/site_map.hpp"
#include "planning/overlap_graph.hpp"
#include "planning/set_cover.hpp"
#include "planning/visibility.hpp"

namespace planning {

// Every edge of the map's obstacles, for the stations of one area: all of them occlude; targets are
// the parts that count for coverage (nav::on_target) and border the area, the drivable ground on
// their free side. Edges are cut on the 1 mm grid where such a part begins or ends, which may bend
// them by less than 1 mm. In the order of nav::edges.
//
// A wall that borders two areas only where one ends and the other begins is cut there; so each
// stretch is a target of the area it belongs to and of no other, even where other areas see it.
// (Parts of a region that a robot of no size could drive between share their drivable ground, and
// so their targets.) Ground drawn beside the wall rather than up to it borders the wall if the gap
// is at most nav::kTargetReachM and parallel within 3 deg.
std::vector<Wall> walls_of(const nav::SiteMap& map, const nav::FreeArea& area);

struct Station {
  Candidate at;
  std::vector<WallPiece> sees;  // Target pieces only; in order of wall and place.
  double sees_m{};
  double adds_m{};      // Not seen by the stations before it.
  double overlaps_m{};  // Seen by those already.
};

struct UncoveredPiece {
  WallPiece piece;
  // One of the first five: no candidate sees it. Of all candidates, this stopped the one that came
  // furthest in the order of the constraints; `occluded` means that none has it in sight.
  // overlap, gain, goal: candidates see it, but none was chosen. gain: at least one overlaps
  // enough.
  Excluded reason{};
};

// greedy: Algorithm 1 of the paper. refined: then a swap search for fewer stations (refine.hpp).
enum class CoverMethod { greedy, refined };

struct CoverConfig {
  CoverMethod method = CoverMethod::refined;
  int candidates = 1000;
  double coverage_goal = 0.98;  // Share of the coverable target length.
  double gain_min = 0.02;       // Stop when the next view adds less than this share of the target
  // and less than this: 2 % is the paper's for a courtyard, but half a street on a campus.
  double gain_enough_m = std::numeric_limits<double>::infinity();
  double overlap_min = 0.2;  // Share of what a station sees that must be seen already.
  // These stations, in this order, and no others. They count as candidates too, after those drawn,
  // so that what is coverable stays what some place to stand can see.
  std::optional<std::vector<Candidate>> given = std::nullopt;
};

struct CoverPlan {
  std::vector<Candidate> candidates;
  // In an order in which each overlaps those before it as the rules ask; greedy: as chosen.
  std::vector<Station> stations;
  std::vector<UncoveredPiece> uncovered;  // In order of wall and place; 1 mm or longer.
  double target_m{};                      // All target wall of this area.
  double coverable_m{};                   // What the candidates together can see.
  double covered_m{};
  std::string end;        // Why it stopped, in a sentence.
  int stations_greedy{};  // How many the paper's greedy cover takes.
  // coverage_goal (with given stations, what they cover), or what the greedy cover covers if that
  // is less.
  double goal_m{};
  int stations_at_least{};  // Proven: no fewer of these candidates cover goal_m (cover_bound.hpp).
  std::string bound;        // "30 stations; provably at least 26."
  OverlapGraph overlap;     // Of the stations.
};

// `count` random viewpoints, uniform in the area's standable part, on the grid; with random
// headings in [-180, 180) deg if the field of view is below 360 deg. Fewer, or none, only if hardly
// any grid point lies within. Same seed, same candidates.
std::vector<Candidate> draw_candidates(const nav::FreeArea& area, int count, double fov_deg,
                                       std::uint64_t seed);

// Algorithm 1: draws candidates, works out what each can image, and picks stations one by one,
// always the one that adds the most (ties: the lowest index), among those of whose view a share of
// overlap_min is covered already (the first station excepted). Stops at the coverage goal, when the
// next view adds less than gain_min and gain_enough_m, when only candidates without enough overlap
// would add anything, or when all that can be covered is. Refined by default: see CoverMethod.
// Independent of `threads`. Lengths are sums of whole nanometres, so that they do not depend on the
// order of summation; view ends that differ by rounding only are one place (join_ends).
CoverPlan plan_cover(const nav::FreeArea& area, const std::vector<Wall>& walls,
                     const SensorLimits& limits, const CoverConfig& config, std::uint64_t seed,
                     int threads);

// The problem that plan.stations_at_least is about: the walls as atoms, the candidates as sets,
// goal_m as the goal.
SetCover cover_problem(const CoverPlan& plan, const std::vector<Wall>& walls,
                       const SensorLimits& limits, int threads);

}  // namespace planning
