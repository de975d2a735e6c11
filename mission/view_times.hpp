// What the next view costs in time, and which to take ([phase2] choose). Pure.
#pragma once

#include <optional>
#include <vector>

#include "mission/config.hpp"
#include "mission/plan.hpp"
#include "mission/site_model.hpp"
#include "planning/view_rate.hpp"

namespace mission {

// A view, how long it takes from where the robot stands, and what it brings per minute.
struct ChosenView {
  std::size_t view{};  // Index into the views.
  // Road at full speed, or carrying and setting up; and the scan. Empty: no way there is known.
  std::optional<double> takes_min;
  std::optional<double> voxels_per_min;
};

class ViewTimes {
 public:
  // roads: of the area in which the robot stands (at robot_m), tasks[start_area]; nullptr without
  // one. What is referred to outlives this.
  ViewTimes(const MissionConfig& config, const SiteTasks& tasks, const nav::Roadmap* roads,
            const Eigen::Vector2d& robot_m)
      : config_(config), tasks_(tasks), roads_(roads), robot_m_(robot_m) {}

  // The straight way, at least one second in all.
  double least_s(const NextView& view) const;
  // Along the roads; infinite where none leads.
  double takes_s(const NextView& view) const;

 private:
  bool by_hand(const NextView& view) const;

  const MissionConfig& config_;
  const SiteTasks& tasks_;
  const nav::Roadmap* roads_;
  Eigen::Vector2d robot_m_;
};

// Of views ordered by gain: "gain" takes the first, "gain_per_minute" the one of the highest rate
// (ties: the first), asking for as few roads as possible. Nothing if there is none, or none that
// can be reached for a rate.
std::optional<ChosenView> choose(const std::vector<NextView>& views, const ViewTimes& times,
                                 bool per_minute);

}  // namespace mission
