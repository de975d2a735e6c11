// How a survey keeps enough of the battery to come home, and what it foretells.
#include <algorithm>

#include "mission/survey.hpp"

namespace mission {
namespace {

namespace json = boost::json;

// To where no road leads: straight, and as slowly as that may turn out.
constexpr double kUnknownWayFactor = 3;

}  // namespace

// From pose to pose as the roads are now.
double Survey::way_s(const hal::Pose2& from, const hal::Pose2& to) const {
  const nav::Roadmap& roads = roads_[static_cast<std::size_t>(tasks_.start_area)].roadmap();
  const BodyConfig& body = config_.robot.body;
  if (const auto route = roads.route(from.position_m, to.position_m))
    return drive_time_s(body, *route, from, to);
  return kUnknownWayFactor * (to.position_m - from.position_m).norm() / body.speed_max_mps;
}

// The drives to that station of the robot's tour and to each after it, the later ones as planned.
std::vector<double> Survey::legs_ahead_s(const Stop& stop) {
  std::vector<double> legs_s{way_s(pilot_.pose(), stop.pose)};
  if (!stop.station) return legs_s;
  const AreaPlan& plan = record_.plans[static_cast<std::size_t>(stop.task)];
  const auto pose = [&](std::size_t at) {
    return pose_of(plan.cover.stations[static_cast<std::size_t>(plan.tour[at])].at);
  };
  if (tour_legs_s_.empty())
    for (std::size_t at = 1; at < plan.tour.size(); ++at)
      tour_legs_s_.push_back(way_s(pose(at - 1), pose(at)));
  for (std::size_t at = tours_next_; at < plan.tour.size(); ++at)
    legs_s.push_back(tour_legs_s_[at - 1]);
  return legs_s;
}

// Whether the robot can still go there, scan and come home with the reserve.
bool Survey::affords(const Stop& stop) {
  if (stop.task != tasks_.start_area) return true;
  if (stop.station) ++tours_next_;
  const double home_s = config_.return_home ? way_s(stop.pose, tasks_.start) : 0;
  const EnergyForecast forecast = energy_.forecast(legs_ahead_s(stop), home_s);
  decide({{"t_s", now_s()},
          {"decision", "energy"},
          {"to", stop.name},
          {"left_wh", forecast.left_wh},
          {"needed_wh", forecast.needed_wh},
          {"scans_left", forecast.scans_left},
          {"minutes_left", forecast.minutes_left}});
  battery_low_ = forecast.needed_wh > forecast.left_wh;
  if (battery_low_)
    drop(stop, battery_reason(forecast));
  else if (stop.station)
    energy_.foretold(now_s(), forecast);
  return !battery_low_;
}

// What was foretold at the tour's stops beside what it came to.
void Survey::note_forecasts() {
  record_.energy.error = energy_.error_at(now_s());
  const ForecastError& error = record_.energy.error;
  if (error.forecasts == 0) return;
  decide({{"t_s", now_s()},
          {"decision", "forecast_error"},
          {"forecasts", error.forecasts},
          {"mean_abs_min", error.mean_abs_min},
          {"max_abs_min", error.max_abs_min},
          {"mean_share", error.mean_share}});
}

// What is neither driving nor scanning is standing: planning, waiting for devices.
void Survey::note_energy() {
  energy_.stood(std::max(0.0, record_.mission_s - energy_.spent().total_s()));
  record_.energy.spent = energy_.spent();
  record_.energy.used_wh = energy_.used_wh();
  record_.energy.left_wh = energy_.left_wh();
  record_.energy.reserve_wh = energy_.reserve_wh();
}

}  // namespace mission
