#include <cstdio>
#include <cstdlib>

#include "drivers/nmea_codec.hpp"

namespace drivers {
namespace {

constexpr std::int64_t kMinute = 1'000'000'000;  // In nanominutes.
constexpr std::int64_t kDigit = 100;             // Seven digits of a minute: 0.2 mm.

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[64];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string angle(ExactAngle angle, int degree_digits, char positive, char negative) {
  const std::int64_t size = std::abs(angle.nanominutes);
  const std::int64_t minutes = size / kMinute;
  return formatted("%0*lld%02lld.%07lld,%c", degree_digits, static_cast<long long>(minutes / 60),
                   static_cast<long long>(minutes % 60),
                   static_cast<long long>(size % kMinute / kDigit),
                   angle.nanominutes < 0 ? negative : positive);
}

std::string time(std::int64_t time_of_day_ns) {
  const std::int64_t centi = time_of_day_ns / 10'000'000;
  return formatted("%02d%02d%02d.%02d", static_cast<int>(centi / 360'000),
                   static_cast<int>(centi / 6000 % 60), static_cast<int>(centi / 100 % 60),
                   static_cast<int>(centi % 100));
}

std::string metres(const std::optional<double>& value_m) {
  return value_m ? formatted("%.3f,M", *value_m) : ",M";
}

}  // namespace

std::string nmea_gga(const GnssEpoch& epoch) {
  std::string text = "GPGGA," + time(epoch.time_of_day_ns.value_or(0)) + "," +
                     angle(epoch.latitude.value_or(ExactAngle()), 2, 'N', 'S') + "," +
                     angle(epoch.longitude.value_or(ExactAngle()), 3, 'E', 'W');
  text += formatted(",%d,%02d,", static_cast<int>(epoch.quality),  // In the order of GGA's codes.
                    epoch.satellites_used.value_or(0));
  if (epoch.hdop) text += formatted("%.1f", *epoch.hdop);
  text += "," + metres(epoch.altitude_msl_m) + "," + metres(epoch.geoid_separation_m) + ",";
  if (epoch.correction_age_s) text += formatted("%.1f", *epoch.correction_age_s);
  text += ",";
  if (epoch.correction_station) text += formatted("%04d", *epoch.correction_station);
  return encode_nmea(text);
}

}  // namespace drivers
