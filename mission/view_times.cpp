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

ViewTrip shortest_trip(const std::vector<ViewPlace>& places, int start_area,
                       const nav::Roadmap* roads, const Eigen::Vector2d& robot_m) {
  std::vector<Eigen::Vector2d> points_m{robot_m};
  for (const ViewPlace& place : places) points_m.push_back(place.at_m);
  const std::size_t nodes = points_m.size();
  std::vector<std::vector<double>> cost(
      nodes, std::vector<double>(nodes, std::numeric_limits<double>::infinity()));
  if (roads != nullptr) {
    const Eigen::MatrixXd lengths_m = roads->lengths_m(points_m);
    const auto on_roads = [&](std::size_t node) {
      return node == 0 || places[node - 1].task == start_area;
    };
    for (std::size_t from = 0; from < nodes; ++from)
      for (std::size_t to = 0; to < nodes; ++to)
        if (on_roads(from) && on_roads(to))
          cost[from][to] =
              lengths_m(static_cast<Eigen::Index>(from), static_cast<Eigen::Index>(to));
  }
  ViewTrip trip;
  trip.order = planning::visiting_order(cost);
  trip.by_road = trip.order.size();
  std::size_t at = 0;
  for (const std::size_t place : trip.order) {
    trip.road_m += cost[at][place + 1];
    at = place + 1;
  }
  for (std::size_t place = 0; place < places.size(); ++place)
    if (std::ranges::find(trip.order, place) == trip.order.end()) trip.order.push_back(place);
  return trip;
}

std::optional<ChosenView> choose(std::vector<NextView>& views, const ViewTimes& times,
                                 bool per_minute, const FaceView& face,
                                 std::uint32_t gain_min_voxels) {
  if (views.empty() || (!per_minute && !views.front().faced)) return std::nullopt;
  std::vector<planning::ViewOffer> offers;
  const std::size_t count = per_minute ? views.size() : 1;
  for (std::size_t i = 0; i < count; ++i)
    offers.push_back({views[i].voxels, times.least_s(views[i])});
  const auto gains = [&](std::size_t i) {
    if (!views[i].faced) face(views[i]);
    return views[i].voxels < gain_min_voxels ? 0 : views[i].voxels;
  };
  planning::ViewRates rates(
      std::move(offers), [&](std::size_t i) { return times.takes_s(views[i]); }, gains);
  if (const auto best = rates.next())
    return ChosenView{best->offer, best->takes_s / 60, best->voxels_per_min};
  if (per_minute) return std::nullopt;
  return ChosenView{0, std::nullopt, std::nullopt};
}

}  // namespace mission
