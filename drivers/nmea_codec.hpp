// NMEA 0183: sentences with a checksum, any talker. Empty fields are unknown, not zero.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/gnss_values.hpp"

namespace drivers {

struct NmeaGga {
  std::optional<std::int64_t> time_of_day_ns;
  std::optional<ExactAngle> latitude, longitude;
  std::optional<int> quality, satellites;
  std::optional<double> hdop, altitude_msl_m, geoid_separation_m, correction_age_s;
  std::optional<int> station;
};
struct NmeaRmc {
  std::optional<std::int64_t> time_of_day_ns;
  bool valid{};
  std::optional<ExactAngle> latitude, longitude;
  std::optional<double> speed_knots, track_deg, magnetic_variation_deg;  // East positive.
  std::optional<GnssDate> date;
  char mode{}, navigation_status{};  // 0: not sent.
};
struct NmeaGll {
  std::optional<ExactAngle> latitude, longitude;
  std::optional<std::int64_t> time_of_day_ns;
  bool valid{};
  char mode{};
};
struct NmeaGst {
  std::optional<std::int64_t> time_of_day_ns;
  std::optional<double> rms, semi_major_m, semi_minor_m, orientation_deg;
  std::optional<double> latitude_sigma_m, longitude_sigma_m, altitude_sigma_m;
};
struct NmeaVtg {
  std::optional<double> track_deg, magnetic_track_deg, speed_knots, speed_kmph;
  char mode{};
};
struct NmeaGsa {
  char selection{};  // 'M' or 'A'
  std::optional<int> fix;
  std::vector<int> satellites;
  std::optional<double> pdop, hdop, vdop;
  std::optional<int> system;
};
struct NmeaGsv {
  struct Satellite {
    int id{};
    std::optional<int> elevation_deg, azimuth_deg, signal_dbhz;
  };
  std::optional<int> sentences, sentence, in_view;
  std::vector<Satellite> satellites;  // Of this sentence.
};
struct NmeaHdt {
  std::optional<double> heading_deg;
};
struct NmeaZda {
  std::optional<std::int64_t> time_of_day_ns;
  std::optional<GnssDate> date;
};
// A kind that is not read: its fields after the address.
struct NmeaOther {
  std::vector<std::string> fields;
};

struct NmeaSentence {
  std::string talker, type;  // "GN", "GGA"; proprietary ones are "P" and the rest.
  std::variant<NmeaOther, NmeaGga, NmeaRmc, NmeaGll, NmeaGst, NmeaVtg, NmeaGsa, NmeaGsv, NmeaHdt,
               NmeaZda>
      value;
};

// A frame that look_gnss() found. Nothing where a field cannot be read or is out of range.
std::optional<NmeaSentence> parse_nmea(ByteView frame);
// "$" + text + "*hh\r\n"
std::string encode_nmea(std::string_view text);
// The whole GGA sentence of an epoch that is usable() and has a time; what it lacks is left empty.
std::string nmea_gga(const GnssEpoch& epoch);

// "4552.65403", 'S' and so on, exactly, to 9 decimals of a minute; what is beyond is cut off.
std::optional<ExactAngle> nmea_angle(std::string_view text, std::string_view side, int degrees_max);
// "132819.60" after midnight; a leap second is the 60th.
std::optional<std::int64_t> nmea_time_ns(std::string_view text);

// Sentences of one instant put together.
class NmeaEpochs {
 public:
  // An epoch that is complete with this sentence or before it. At most two: one that was never
  // ended, and this one.
  std::vector<GnssEpoch> add(const NmeaSentence& sentence);
  // What is there when nothing comes for 0.1 to 0.2 s.
  std::optional<GnssEpoch> flush();

 private:
  GnssEpoch take_epoch();

  EpochEnd end_;
  std::optional<GnssEpoch> epoch_;
  std::array<int, 16> seen_{};  // In this epoch, by kind.
  // The day is said by RMC and ZDA only: it holds until midnight.
  std::optional<GnssDate> date_;
  std::int64_t date_time_ns_{};
};

}  // namespace drivers
