// Made-up sites on which visibility is timed, and the viewpoints among them.
#pragma once

#include <cmath>
#include <vector>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"
#include "tests/support/random_site.hpp"

namespace bench {

struct VisibilitySite {
  nav::FreeArea area;
  std::vector<planning::Wall> walls;
  std::vector<planning::Candidate> candidates;
};

// Buildings of about six edges each, as dense everywhere as a campus (one in pitch_m by pitch_m).
inline VisibilitySite visibility_site(int obstacles, double pitch_m = 30) {
  support::Dice dice(1);
  const support::SiteSize size{.side_m = pitch_m * std::sqrt(obstacles),
                               .obstacles = obstacles,
                               .obstacle_radius_m = 0.4 * pitch_m,
                               .corners_max = 9};
  VisibilitySite s{support::random_area(dice, size, 0.5), {}, {}};
  for (const nav::SegmentMm& e : nav::edges(s.area.drivable)) s.walls.push_back({e.b, e.a});
  s.candidates = planning::draw_candidates(s.area, 200, 360, 1);
  return s;
}

}  // namespace bench
