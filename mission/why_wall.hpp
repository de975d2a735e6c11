// Why a place on a wall is not imaged from somewhere: the person's question about Phase I. Pure.
#pragma once

#include <optional>
#include <string>

#include "mission/plan.hpp"
#include "planning/why_wall.hpp"

namespace mission {

struct WallAnswer {
  std::string area;            // In which the station stands.
  planning::Wall wall;         // Nearest to the place asked for.
  Eigen::Vector2d at_m{0, 0};  // That place, moved on to the wall.
  double off_m{};              // So far.
  planning::WhyWall why;
  std::optional<planning::Wall> blocker;  // why.occluder

  std::string in_words() const;
};

// A wall that does not count is answered for all the same. Throws std::invalid_argument, in words
// for the user, when the station stands in no free area or no wall is within kWallReachM of the
// place.
inline constexpr double kWallReachM = 1.0;
WallAnswer why_wall(const MissionConfig& config, const nav::SiteMap& map,
                    const std::vector<AreaTask>& tasks, const Eigen::Vector2d& wall_m,
                    const hal::Pose2& station);

}  // namespace mission
