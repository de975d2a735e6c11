#include "mission/energy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mission {
namespace {

constexpr double kHourS = 3600;

}  // namespace

EnergyTimes& EnergyTimes::operator+=(const EnergyTimes& other) {
  drive_s += other.drive_s;
  scan_s += other.scan_s;
  idle_s += other.idle_s;
  return *this;
}

double energy_wh(const BatteryConfig& battery, const EnergyTimes& times) {
  return (times.drive_s * battery.drive_w + times.scan_s * battery.scan_w +
          times.idle_s * battery.idle_w) /
         kHourS;
}

void EnergyBook::scanned(double span_s) {
  spent_.scan_s += span_s;
  ++scans_;
}

double EnergyBook::needed_wh(double there_s, double home_s) const {
  return energy_wh(battery_, {there_s + home_s, scan_s(), 0}) + reserve_wh();
}

EnergyForecast EnergyBook::forecast(const std::vector<double>& legs_s, double home_s) const {
  EnergyForecast forecast;
  forecast.left_wh = left_wh();
  forecast.needed_wh = needed_wh(legs_s.empty() ? 0 : legs_s.front(), home_s);
  EnergyTimes ahead;
  for (const double leg_s : legs_s) {
    EnergyTimes with = ahead;
    with += {leg_s, scan_s(), 0};
    const double home_wh = energy_wh(battery_, {home_s, 0, 0});
    if (energy_wh(battery_, with) + home_wh + reserve_wh() > forecast.left_wh) break;
    ahead = with;
    ++forecast.scans_left;
  }
  forecast.minutes_left = ahead.total_s() / 60;
  return forecast;
}

void EnergyBook::foretold(double now_s, const EnergyForecast& forecast) {
  foretold_.push_back({now_s, forecast.minutes_left});
}

ForecastError EnergyBook::error_at(double end_s) const {
  ForecastError error;
  for (const Foretold& one : foretold_) {
    const double took_min = (end_s - one.at_s) / 60;
    const double off_min = std::abs(one.minutes - took_min);
    ++error.forecasts;
    error.mean_abs_min += off_min;
    error.max_abs_min = std::max(error.max_abs_min, off_min);
    if (took_min > 0) error.mean_share += off_min / took_min;
  }
  if (error.forecasts > 0) {
    error.mean_abs_min /= error.forecasts;
    error.mean_share /= error.forecasts;
  }
  return error;
}

std::string battery_reason(const EnergyForecast& forecast) {
  return fmt::format(
      "the battery has {:.0f} Wh left; this stop, the way home and the reserve take {:.0f} Wh",
      forecast.left_wh, forecast.needed_wh);
}

}  // namespace mission
