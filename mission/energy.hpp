// What the battery has given, what the next stop and the way home will take, and how well that was
// foretold. Pure: times in, watt hours out.
#pragma once

#include <string>
#include <vector>

#include "mission/config.hpp"

namespace mission {

// Times that somebody spent or will spend, by what draws the power.
struct EnergyTimes {
  double drive_s{}, scan_s{}, idle_s{};

  double total_s() const { return drive_s + scan_s + idle_s; }
  EnergyTimes& operator+=(const EnergyTimes& other);
};
double energy_wh(const BatteryConfig& battery, const EnergyTimes& times);

// What a mission has left at a decision.
struct EnergyForecast {
  double left_wh{};    // Of the capacity.
  double needed_wh{};  // For the stop in question, the way home from it, and the reserve.
  int scans_left{};    // To the end of the tour, that stop's included; as many as the battery has.
  double minutes_left{};  // To the end of those, the way home left out.
};

// At the end of a tour: how far off the minutes foretold at each of its stops were.
struct ForecastError {
  int forecasts{};
  double mean_abs_min{}, max_abs_min{};
  double mean_share{};  // Of the minutes that it then took.
};

class EnergyBook {
 public:
  EnergyBook(const BatteryConfig& battery, double scan_s)
      : battery_(battery), plan_scan_s_(scan_s) {}

  void drove(double span_s) { spent_.drive_s += span_s; }
  void scanned(double span_s);
  void stood(double span_s) { spent_.idle_s += span_s; }

  // Goes on from what an earlier part of the run has spent.
  void take_up(const EnergyTimes& spent, int scans) { spent_ = spent, scans_ = scans; }
  int scans() const { return scans_; }

  const EnergyTimes& spent() const { return spent_; }
  double used_wh() const { return energy_wh(battery_, spent_); }
  double left_wh() const { return battery_.capacity_wh - used_wh(); }
  double reserve_wh() const { return battery_.reserve_share * battery_.capacity_wh; }
  // What a scan takes: as those so far did; before the first, as the robot file says.
  double scan_s() const { return scans_ > 0 ? spent_.scan_s / scans_ : plan_scan_s_; }

  // For a drive there, a scan, a drive home, and the reserve.
  double needed_wh(double there_s, double home_s) const;
  bool affords(double there_s, double home_s) const {
    return needed_wh(there_s, home_s) <= left_wh();
  }

  // legs_s: the drives to the stop in question and to each after it.
  EnergyForecast forecast(const std::vector<double>& legs_s, double home_s) const;

  // Keeps what was foretold at now_s, to be compared when the tour is over.
  void foretold(double now_s, const EnergyForecast& forecast);
  ForecastError error_at(double end_s) const;

 private:
  struct Foretold {
    double at_s{}, minutes{};
  };
  const BatteryConfig battery_;
  const double plan_scan_s_;
  EnergyTimes spent_;
  int scans_ = 0;
  std::vector<Foretold> foretold_;
};

// "the battery has 120 Wh left; this stop, the way home and the reserve take 130 Wh"
std::string battery_reason(const EnergyForecast& forecast);

}  // namespace mission
