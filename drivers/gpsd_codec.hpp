// gpsd's JSON lines. What a line does not say is unknown, not zero.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/gnss_values.hpp"
#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers {

inline constexpr std::size_t kGpsdLineMax = 64 * 1024;
// What a client sends first.
inline constexpr std::string_view kGpsdWatch = "?WATCH={\"enable\":true,\"json\":true};\r\n";

// For Resync: lines that are a JSON object.
Look look_gpsd(ByteView front);

struct GpsdTpv {
  std::string device, time;  // ISO 8601
  int mode{};                // 0 unknown, 1 no fix, 2 plane, 3 with height.
  std::optional<int> status;
  std::optional<double> latitude_deg, longitude_deg, altitude_ellipsoid_m, altitude_msl_m;
  std::optional<double> geoid_separation_m, track_deg, speed_mps, climb_mps;
  // 95 % as gpsd states them: time, longitude, latitude, vertical, horizontal, spherical, speed.
  std::optional<double> ept_s, epx_m, epy_m, epv_m, eph_m, sep_m, eps_mps, epc_mps, epd_deg;
  std::optional<double> correction_age_s;
  std::optional<int> correction_station, leap_seconds;
};
struct GpsdSky {
  struct Satellite {
    int prn{};
    std::optional<int> system, number;
    std::optional<double> elevation_deg, azimuth_deg, signal_dbhz;
    bool used{};
  };
  std::string device, time;
  std::optional<double> xdop, ydop, vdop, tdop, hdop, gdop, pdop;
  std::optional<int> seen, used;
  std::vector<Satellite> satellites;
};
struct GpsdGst {
  std::string device, time;
  std::optional<double> rms, major_m, minor_m, orientation_deg;
  std::optional<double> latitude_sigma_m, longitude_sigma_m, altitude_sigma_m;
};
struct GpsdAtt {
  std::string device, time;
  std::optional<double> heading_deg, pitch_deg, roll_deg, yaw_deg;
};
struct GpsdVersion {
  std::string release;
  std::optional<int> protocol_major, protocol_minor;
};
struct GpsdError {
  std::string message;
};
struct GpsdDevice {
  std::string path, driver;  // What gpsd takes it for: "u-blox", "NMEA0183"; empty: not yet known.
  bool active{};
};
struct GpsdDevices {
  std::vector<GpsdDevice> devices;
};
// WATCH, RTCM3 and whatever comes with a class of its own.
struct GpsdOther {
  std::string name;
};
using GpsdMessage = std::variant<GpsdOther, GpsdTpv, GpsdSky, GpsdGst, GpsdAtt, GpsdVersion,
                                 GpsdError, GpsdDevices>;

// Nothing where the line has no class.
std::optional<GpsdMessage> parse_gpsd(ByteView line);

GnssEpoch epoch_of(const GpsdTpv& tpv);

std::unique_ptr<OfflineDecoder> gpsd_offline();

}  // namespace drivers
