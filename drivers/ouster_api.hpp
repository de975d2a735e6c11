// What an Ouster tells about itself over HTTP, besides its metadata: how it is set, and what it
// complains of.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace drivers {

inline constexpr std::string_view kOusterMetadataPath = "/api/v1/sensor/metadata";
inline constexpr std::string_view kOusterSettingsPath = "/api/v1/sensor/config";
inline constexpr std::string_view kOusterAlertsPath = "/api/v1/sensor/alerts";

// Of /api/v1/sensor/config. What is empty was not said.
struct OusterSettings {
  std::string udp_dest;  // An address, or a name.
  std::optional<std::uint16_t> udp_port_lidar;
  std::string operating_mode;  // "NORMAL" or "STANDBY"
};
// Empty, or what is wrong with the text.
std::string parse_ouster_settings(std::string_view json, OusterSettings& into);

// Of /api/v1/sensor/alerts: those that are active.
struct OusterAlert {
  std::string id, level, category, text;
};
std::string parse_ouster_alerts(std::string_view json, std::vector<OusterAlert>& into);

// "v2.5.2" and the like; nothing where it is no version.
using OusterVersion = std::array<int, 3>;
std::optional<OusterVersion> ouster_version(std::string_view text);
// Older ones have no packets or metadata that are read here.
inline constexpr OusterVersion kOusterVersionLeast{2, 0, 0};

// The other way round, for simulated sensors.
std::string ouster_settings_json(const OusterSettings& settings);
std::string ouster_alerts_json(const std::vector<OusterAlert>& alerts);

}  // namespace drivers
