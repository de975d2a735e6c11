// What simulated receivers have in common: the world's fix as a point on the earth, and the time.
#pragma once

#include "drivers/gnss_values.hpp"
#include "drivers/site_frame.hpp"
#include "hal/clock.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

// What a person may switch at run time.
struct GnssSky {
  drivers::GnssQuality quality = drivers::GnssQuality::rtk_fixed;  // none: no fix.
  int satellites = 24;
};

struct GnssSourceConfig {
  drivers::GeoAnchor anchor;
  double rate_hz = 5;
  double antenna_height_m = 1.5;  // Above the ground.
  // GPS time at our time 0, as milliseconds of the week, and the day it is.
  std::int64_t itow_ms = 302'400'000;
  drivers::GnssDate date{2026, 6, 3};
  double clock_skew = 0;  // Ours against its: satellites know the time, our crystal does not.
};

struct GnssMoment {
  drivers::GeoPoint at;
  double sigma_m{};  // Claimed, per axis.
  std::uint32_t itow_ms{};
  std::int64_t utc_time_of_day_ns{};
  drivers::GnssDate date;
  bool hidden{};  // No satellite is seen from there.
};

// What the receiver has of the sky at that moment.
inline GnssSky sky_at(const GnssMoment& moment, GnssSky sky) {
  if (moment.hidden) sky = {drivers::GnssQuality::none, 0};
  return sky;
}

// The world's only reader of sample_gnss(); measures at whole multiples of the period of our time.
class GnssSource {
 public:
  GnssSource(const GnssSourceConfig& config, World& world, hal::Clock& clock, UnitFaults& faults);

  hal::Task<void> next_due(double rate_hz);  // Slowed by the fault.
  GnssMoment sample();

 private:
  GnssSourceConfig config_;
  drivers::SiteFrame frame_;
  World& world_;
  hal::Clock& clock_;
  UnitFaults& faults_;
};

}  // namespace sim
