#include "tools/vantage_localize_logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/text.hpp"
#include "drivers/ubx_codec.hpp"
#include "drivers/vn100_codec.hpp"
#include "mission/files.hpp"
#include "nav/registration/cloud_fields.hpp"
#include "tools/vantage_command.hpp"

namespace vantage::logs {
namespace {

constexpr double kNoAccuracy_m = 3;  // What a receiver that claims nothing may be off by.

std::string bytes_of(const std::filesystem::path& file) {
  auto bytes = mission::read_file(file);
  if (!bytes) throw Refusal(bytes.error().text());
  return std::move(*bytes);
}

[[noreturn]] void refuse(const std::filesystem::path& file, int line, int column,
                         const std::string& what) {
  throw Refusal({{file.string(), line, column, what}});
}

// A CSV with a header of column names.
class Csv {
 public:
  Csv(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {
    std::string_view line;
    while (lines_.next(line))
      if (!line.empty() && !line.starts_with('#')) break;
    const auto names = nav::fields::words(line, " \t,;");
    for (std::size_t i = 0; i < names.size(); ++i) columns_[std::string(names[i])] = i;
  }

  bool has(const std::string& name) const { return columns_.contains(name); }
  void need(const std::vector<std::string>& names) const {
    for (const auto& name : names)
      if (!has(name))
        refuse(file_, lines_.number(), 0,
               fmt::format("the header has no column {}: see vantage localize --help", name));
  }
  // False at the end.
  bool next() {
    std::string_view line;
    do {
      if (!lines_.next(line)) return false;
      row_ = nav::fields::words(line, " \t,;");
    } while (row_.empty() || line.starts_with('#'));
    return true;
  }
  double value(const std::string& name) const {
    const std::size_t at = columns_.at(name);
    const auto number = at < row_.size() ? nav::fields::number<double>(row_[at]) : std::nullopt;
    if (!number || !std::isfinite(*number))
      refuse(file_, lines_.number(), static_cast<int>(at) + 1,
             fmt::format("{}: {} is not a number", name,
                         at < row_.size() ? nav::fields::shown(row_[at]) : "nothing"));
    return *number;
  }
  Eigen::Vector3d vector(const std::string& prefix, const std::string& unit) const {
    return {value(prefix + "_x_" + unit), value(prefix + "_y_" + unit),
            value(prefix + "_z_" + unit)};
  }

 private:
  std::filesystem::path file_;
  nav::fields::Lines lines_;
  std::map<std::string, std::size_t> columns_;
  std::vector<std::string_view> row_;
};

bool binary(std::string_view bytes) {
  return bytes.substr(0, 65536).find_first_of(std::string_view("\0\xb5\xfa", 3)) !=
         std::string_view::npos;
}

// Sentences, perhaps after comments of whoever recorded them.
bool receiver(std::string_view bytes) {
  return binary(bytes) || bytes.starts_with('$') ||
         bytes.substr(0, 65536).find("\n$") != std::string_view::npos;
}

// Seconds since 1970 of an epoch that knows its day, else since midnight.
double time_of(const drivers::GnssEpoch& epoch) {
  double time_s = static_cast<double>(*epoch.time_of_day_ns) / 1e9;
  if (!epoch.date) return time_s;
  const std::chrono::sys_days day = std::chrono::year(epoch.date->year) /
                                    static_cast<unsigned>(epoch.date->month) /
                                    static_cast<unsigned>(epoch.date->day);
  return time_s + static_cast<double>(day.time_since_epoch().count()) * 86400;
}

class Fixes {
 public:
  Fixes(Geo& geo, double offset_s) : geo_(geo), offset_s_(offset_s) {}

  void add(double time_s, double latitude_deg, double longitude_deg, double height_m,
           const Eigen::Vector2d& sigma_m) {
    if (!geo_.anchor) geo_.anchor = {latitude_deg, longitude_deg, height_m, 0};
    const Eigen::Vector3d W =
        drivers::SiteFrame(*geo_.anchor).to_site({latitude_deg, longitude_deg, height_m});
    add(time_s, W.head<2>(), sigma_m);
  }
  void add(double time_s, const Eigen::Vector2d& position_m, const Eigen::Vector2d& sigma_m) {
    all_.push_back(
        {time_s + offset_s_, nav::GnssPosition{{}, position_m, sigma_m.cwiseAbs2().asDiagonal()}});
  }
  void add_velocity(double time_s, const Eigen::Vector2d& velocity_mps, double sigma_mps) {
    all_.push_back({time_s + offset_s_, nav::GnssVelocity{{}, velocity_mps, sigma_mps}});
  }
  void add(const drivers::GnssEpoch& epoch) {
    if (!epoch.usable() || !epoch.time_of_day_ns) return;
    const double claimed_m = epoch.horizontal_accuracy_m
                                 ? *epoch.horizontal_accuracy_m / std::sqrt(2)
                             : epoch.hdop ? *epoch.hdop * kNoAccuracy_m
                                          : kNoAccuracy_m;
    const Eigen::Vector2d sigma_m(epoch.sigma_east_m.value_or(claimed_m),
                                  epoch.sigma_north_m.value_or(claimed_m));
    add(time_of(epoch), epoch.latitude->deg(), epoch.longitude->deg(),
        epoch.altitude_ellipsoid_m.value_or(epoch.altitude_msl_m.value_or(0)), sigma_m);
    if (!epoch.speed_mps || !epoch.track_deg || !epoch.speed_accuracy_mps) return;
    const double track = *epoch.track_deg * std::numbers::pi / 180;
    add_velocity(time_of(epoch),
                 *epoch.speed_mps * Eigen::Vector2d(std::sin(track), std::cos(track)),
                 *epoch.speed_accuracy_mps);
  }
  std::vector<Timed> take() { return std::move(all_); }

 private:
  Geo& geo_;
  double offset_s_;
  std::vector<Timed> all_;
};

// UBX and NMEA as a receiver sends them; where it sends UBX positions these alone are used.
void read_receiver(std::string_view bytes, Fixes& fixes) {
  drivers::Resync resync(drivers::kGnssFrameMax);
  resync.feed(drivers::as_bytes(bytes));
  drivers::UbxEpochs ubx;
  drivers::NmeaEpochs nmea;
  std::vector<drivers::GnssEpoch> from_ubx, from_nmea;
  const auto put = [](std::vector<drivers::GnssEpoch>& all, const auto& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  while (const auto frame = resync.next(drivers::look_gnss)) {
    const auto kind = drivers::gnss_kind(*frame);
    if (kind == drivers::GnssKind::ubx) put(from_ubx, ubx.add(drivers::parse_ubx(*frame)));
    if (kind != drivers::GnssKind::nmea) continue;
    if (const auto sentence = drivers::parse_nmea(*frame)) put(from_nmea, nmea.add(*sentence));
  }
  if (const auto last = ubx.flush()) from_ubx.push_back(*last);
  if (const auto last = nmea.flush()) from_nmea.push_back(*last);
  for (const auto& epoch : from_ubx.empty() ? from_nmea : from_ubx) fixes.add(epoch);
}

std::vector<Timed> read_vn100(const std::filesystem::path& file, std::string_view bytes,
                              double offset_s) {
  drivers::Resync resync(drivers::kVn100FrameMax);
  resync.feed(drivers::as_bytes(bytes));
  std::vector<Timed> all;
  while (const auto frame = resync.next(drivers::look_vn100)) {
    if (frame->front() != 0xFA) continue;  // Lines have no time of the device.
    const auto sample = drivers::decode_vn100_binary(*frame);
    if (!sample.startup_ns || !sample.rate_radps) continue;
    nav::InertialSample inertial{{}, drivers::vn100_flu(*sample.rate_radps), {}};
    if (sample.accel_mps2) inertial.specific_force_mps2 = drivers::vn100_flu(*sample.accel_mps2);
    all.push_back({static_cast<double>(*sample.startup_ns) * 1e-9 + offset_s, inertial});
  }
  if (all.empty())
    refuse(
        file, 0, 0,
        "no VN-100 packet with TimeStartup and rates in it: record group 1 with bits 0 and 5 or 8");
  return all;
}

}  // namespace

std::vector<Timed> read_odometry(const std::filesystem::path& file, double track_m) {
  const std::string bytes = bytes_of(file);
  Csv csv(file, bytes);
  csv.need({"time_s"});
  const bool speeds = csv.has("forward_mps");
  csv.need(speeds ? std::vector<std::string>{"turn_radps"}
                  : std::vector<std::string>{"left_m", "right_m"});
  std::vector<Timed> all;
  while (csv.next()) {
    const double time_s = csv.value("time_s");
    hal::WheelTravel travel;
    if (speeds) {
      const double span_s = all.empty() ? 0 : time_s - all.back().time_s;
      const double way_m = csv.value("forward_mps") * span_s;
      const double half_m = csv.value("turn_radps") * span_s * track_m / 2;
      travel.left_m = way_m - half_m;
      travel.right_m = way_m + half_m;
    } else {
      travel.left_m = csv.value("left_m");
      travel.right_m = csv.value("right_m");
    }
    all.push_back({time_s, travel});
  }
  if (all.empty()) refuse(file, 0, 0, "no rows of odometry in it");
  return all;
}

std::vector<Timed> read_imu(const std::filesystem::path& file, double offset_s) {
  const std::string bytes = bytes_of(file);
  if (binary(bytes)) return read_vn100(file, bytes, offset_s);
  Csv csv(file, bytes);
  csv.need({"time_s"});
  const bool one_axis = csv.has("yaw_rate_radps");
  if (!one_axis) csv.need({"rate_x_radps", "rate_y_radps", "rate_z_radps"});
  const bool force = !one_axis && csv.has("accel_x_mps2");
  if (force) csv.need({"accel_y_mps2", "accel_z_mps2"});
  std::vector<Timed> all;
  while (csv.next()) {
    nav::InertialSample sample;
    if (one_axis)
      sample.rate_radps.z() = csv.value("yaw_rate_radps");
    else
      sample.rate_radps = csv.vector("rate", "radps");
    if (force) sample.specific_force_mps2 = csv.vector("accel", "mps2");
    all.push_back({csv.value("time_s") + offset_s, sample});
  }
  return all;
}

std::vector<Timed> read_gnss(const std::filesystem::path& file, double offset_s, Geo& geo) {
  const std::string bytes = bytes_of(file);
  Fixes fixes(geo, offset_s);
  if (receiver(bytes)) {
    read_receiver(bytes, fixes);
    auto all = fixes.take();
    if (all.empty())
      refuse(file, 0, 0,
             "no UBX or NMEA position with a time in it: record NAV-PVT, or GGA and RMC");
    return all;
  }
  Csv csv(file, bytes);
  csv.need({"time_s", "sigma_m"});
  const bool degrees = csv.has("latitude_deg");
  csv.need(degrees ? std::vector<std::string>{"longitude_deg"}
                   : std::vector<std::string>{"x_m", "y_m"});
  const bool velocity = csv.has("velocity_x_mps");
  if (velocity) csv.need({"velocity_y_mps", "velocity_sigma_mps"});
  while (csv.next()) {
    const double time_s = csv.value("time_s"), sigma = csv.value("sigma_m");
    const Eigen::Vector2d sigma_m(sigma, sigma);
    if (degrees)
      fixes.add(time_s, csv.value("latitude_deg"), csv.value("longitude_deg"),
                geo.anchor ? geo.anchor->height_m : 0, sigma_m);
    else
      fixes.add(time_s, {csv.value("x_m"), csv.value("y_m")}, sigma_m);
    if (velocity)
      fixes.add_velocity(time_s, {csv.value("velocity_x_mps"), csv.value("velocity_y_mps")},
                         csv.value("velocity_sigma_mps"));
  }
  return fixes.take();
}

std::vector<nav::LocalizerEvent> stamped(std::vector<std::vector<Timed>> logs, Clock& clock) {
  std::vector<Timed> all;
  for (auto& log : logs) all.insert(all.end(), log.begin(), log.end());
  std::stable_sort(all.begin(), all.end(), [](const Timed& a, const Timed& b) {
    return a.time_s != b.time_s ? a.time_s < b.time_s : a.event.index() < b.event.index();
  });
  if (!all.empty()) clock.zero_s = all.front().time_s;
  std::vector<nav::LocalizerEvent> events;
  for (Timed& one : all) {
    std::visit([&](auto& event) { event.stamp = clock.at(one.time_s); }, one.event);
    events.push_back(one.event);
  }
  return events;
}

}  // namespace vantage::logs
