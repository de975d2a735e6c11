// What NMEA, UBX and gpsd say, in common: exact angles, times, and an epoch's fix.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>

namespace drivers {

// An angle of the earth in 1e-9 minutes of arc: what NMEA (minutes) and UBX (1e-7 and 1e-9 degrees)
// send is a whole number of them.
struct ExactAngle {
  std::int64_t nanominutes{};

  static constexpr ExactAngle from_1e7deg(std::int64_t value) { return {value * 6000}; }
  static constexpr ExactAngle from_1e9deg(std::int64_t value) { return {value * 60}; }
  constexpr double deg() const { return static_cast<double>(nanominutes) / 6e10; }
  auto operator<=>(const ExactAngle&) const = default;
};

struct GnssDate {
  int year{}, month{}, day{};
  auto operator<=>(const GnssDate&) const = default;
};

enum class GnssQuality {
  none,
  single,
  differential,
  pps,
  rtk_fixed,
  rtk_float,
  dead_reckoning,
  manual,
  simulated
};

// What a receiver said about one instant. What is absent is unknown, not zero.
struct GnssEpoch {
  std::optional<GnssDate> date;                // UTC
  std::optional<std::int64_t> time_of_day_ns;  // UTC
  std::optional<std::uint32_t> itow_ms;        // Of the GPS week, where the receiver says it.
  int mode = 1;                                // 1 no fix, 2 plane, 3 with height.
  GnssQuality quality{};
  std::optional<ExactAngle> latitude, longitude;  // North and east positive.
  std::optional<double> altitude_msl_m, altitude_ellipsoid_m, geoid_separation_m;
  std::optional<double> speed_mps, track_deg;  // Over ground; true north, clockwise.
  std::optional<double> climb_mps;             // Up positive.
  std::optional<double> heading_deg;           // Of the body, from two antennas.
  std::optional<double> sigma_north_m, sigma_east_m, sigma_up_m;  // 1 sigma.
  std::optional<double> horizontal_accuracy_m, vertical_accuracy_m, speed_accuracy_mps;
  std::optional<double> hdop, vdop, pdop;
  std::optional<int> satellites_used;
  std::optional<double> correction_age_s;
  std::optional<int> correction_station;

  bool usable() const { return mode >= 2 && quality != GnssQuality::none && latitude && longitude; }
};

// Says where one epoch ends and the next begins, from the times and kinds of what comes: an epoch
// ends with the kind that ended the last one, or at the latest when the time changes.
class EpochEnd {
 public:
  struct Say {
    bool begins{};  // This is of a new epoch; what was not ended before is over.
    bool ends{};    // This is the last of its epoch.
  };
  // No time: it belongs to the epoch at hand, unless `repeats` (a kind that comes once an epoch).
  Say see(std::optional<std::int64_t> time, int kind, bool repeats = false);

 private:
  std::optional<std::int64_t> time_;
  std::optional<int> last_, ender_;
};

}  // namespace drivers
