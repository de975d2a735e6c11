#include "mission/view_times.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mission {

bool ViewTimes::by_hand(const NextView& view) const {
  return tasks_.tasks[static_cast<std::size_t>(view.cell.task)].mode == AreaMode::manual;
}

double ViewTimes::least_s(const NextView& view) const {
  const double scan_s = config_.robot.scanner.scan_s;
  const double way_s =
      by_hand(view) ? config_.robot.sim.placement_s
                    : (view.pose.position_m - robot_m_).norm() / config_.robot.body.speed_max_mps;
  return std::max(1.0, way_s + scan_s);
}

double ViewTimes::takes_s(const NextView& view) const {
  if (by_hand(view)) return least_s(view);
  if (roads_ == nullptr || view.cell.task != tasks_.start_area)
    return std::numeric_limits<double>::infinity();
  const auto route = roads_->route(robot_m_, view.pose.position_m);
  if (!route) return std::numeric_limits<double>::infinity();
  const double way_s = route->length_m / config_.robot.body.speed_max_mps;
  return std::max(least_s(view), way_s + config_.robot.scanner.scan_s);
}

std::optional<ChosenView> choose(const std::vector<NextView>& views, const ViewTimes& times,
                                 bool per_minute) {
  if (views.empty()) return std::nullopt;
  std::vector<planning::ViewOffer> offers;
  const std::size_t count = per_minute ? views.size() : 1;
  for (std::size_t i = 0; i < count; ++i)
    offers.push_back({views[i].voxels, times.least_s(views[i])});
  planning::ViewRates rates(std::move(offers),
                            [&](std::size_t i) { return times.takes_s(views[i]); });
  if (const auto best = rates.next())
    return ChosenView{best->offer, best->takes_s / 60, best->voxels_per_min};
  if (per_minute) return std::nullopt;
  return ChosenView{0, std::nullopt, std::nullopt};
}

}  // namespace mission
