// Recorded odometry, inertial samples and satellite fixes as the localizer's events.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/site_frame.hpp"
#include "nav/localizer_inputs.hpp"

namespace vantage::logs {

// All times in seconds, of one clock; those before `zero_s` of it are negative stamps.
struct Clock {
  double zero_s{};
  hal::Time at(double time_s) const { return hal::Time{} + hal::from_seconds(time_s - zero_s); }
};

// A log's rows before they get stamps: times as the file has them.
struct Timed {
  double time_s{};
  nav::LocalizerEvent event;  // Its stamp is set by stamped().
};

// Where fixes in degrees become W. Without an origin the first fix is it.
struct Geo {
  std::optional<drivers::GeoAnchor> anchor;
};

// Each throws vantage::Refusal naming file, line, column and what to do.
std::vector<Timed> read_odometry(const std::filesystem::path& file, double track_m);
std::vector<Timed> read_imu(const std::filesystem::path& file, double offset_s);
std::vector<Timed> read_gnss(const std::filesystem::path& file, double offset_s, Geo& geo);

// All logs in the order of their stamps.
std::vector<nav::LocalizerEvent> stamped(std::vector<std::vector<Timed>> logs, Clock& clock);

}  // namespace vantage::logs
