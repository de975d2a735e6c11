// What the next view costs in time, and which to take ([phase2] choose). Pure.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "mission/config.hpp"
#include "mission/plan.hpp"
#include "mission/site_model.hpp"
#include "nav/roadmap.hpp"
#include "planning/next_views.hpp"
#include "planning/view_rate.hpp"

namespace mission {

// A view, how long it takes from where the robot stands, and what it brings per minute. The view
// itself is faced.
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

struct ViewPlace {
  int task{};  // Index into the tasks.
  Eigen::Vector2d at_m{0, 0};
};

// In which order to visit places: by the shortest way along the roads, and then those to which no
// road leads (a person carries the scanner there), as they are.
struct ViewTrip {
  std::vector<std::size_t> order;  // Indices into the places.
  std::size_t by_road{};           // So many of them, first.
  double road_m{};                 // From where the robot stands to the last of these.
};

// roads: as for ViewTimes. Proven shortest for up to 14 places by road.
ViewTrip shortest_trip(const std::vector<ViewPlace>& places, int start_area,
                       const nav::Roadmap* roads, const Eigen::Vector2d& robot_m);

// Works out where a view faces and what it then sees.
using FaceView = std::function<void(NextView&)>;

// Of views ordered by gain: "gain" takes the first, "gain_per_minute" the one of the highest rate
// (ties: the first), asking for as few roads and headings as possible. Views that are not faced are
// so once they are looked into, and left out where they then see fewer than gain_min_voxels; "gain"
// takes none of them. Nothing if there is none to take, or none that can be reached for a rate.
std::optional<ChosenView> choose(std::vector<NextView>& views, const ViewTimes& times,
                                 bool per_minute, const FaceView& face = {},
                                 std::uint32_t gain_min_voxels = 0);

}  // namespace mission
