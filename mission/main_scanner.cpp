#include "mission/main_scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "drivers/link_address.hpp"
#include "hal/angles.hpp"
#include "mission/files.hpp"
#include "mission/look.hpp"
#include "mission/main_corrections.hpp"
#include "mission/main_robot.hpp"

namespace mission {
namespace {

constexpr double degrees(double radians) {
  return radians * 180 / std::numbers::pi;
}

bool is_lms5xx(const ScannerConfig& scanner) {
  return scanner.device == "sick-lms5xx";
}

// Device angles of an LMS: 90 degrees is straight ahead.
struct Arc {
  double first_deg, last_deg;
};
constexpr Arc kLms1xx{-45, 225}, kLms5xx{-5, 185};

drivers::MirrorField mirror_of(const drivers::LmsSettings& settings) {
  const double step_deg = settings.resolution_1e4deg / 1e4;
  const double turn_s = 100.0 / settings.frequency_centihz;
  return {.angle_first_rad = hal::radians(settings.start_1e4deg / 1e4 - 90),
          .angle_step_rad = hal::radians(step_deg),
          .beams = static_cast<std::uint32_t>(
              std::lround((settings.stop_1e4deg - settings.start_1e4deg) / 1e4 / step_deg) + 1),
          .beam_period_s = turn_s * step_deg / 360,
          .interval_s = turn_s};
}

drivers::MirrorField mirror_of(const drivers::ScipParameters& says) {
  const double step_rad = 2 * std::numbers::pi / says.steps_per_turn;
  const double turn_s = 60.0 / says.speed_rpm;
  return {.angle_first_rad = (says.step_first - says.step_front) * step_rad,
          .angle_step_rad = step_rad,
          .beams = static_cast<std::uint32_t>(says.step_last - says.step_first + 1),
          .beam_period_s = turn_s / says.steps_per_turn,
          .interval_s = turn_s};
}

// The beams of a scanner that turns by itself, as the maker fixed them.
struct FixedField {
  std::string name;
  double elevation_min_deg{}, elevation_max_deg{}, elevation_step_deg{}, azimuth_step_deg{};
};
constexpr double kStepShare = 0.02;          // By so much a step may be rounded in the robot file,
constexpr double kElevationSlack_deg = 0.1;  // and by so much a limit.

// Collects what is wrong, with the place where it was written.
class Problems {
 public:
  explicit Problems(const MissionConfig& config) : config_(config) {}

  void add(const std::string& key, std::string message) {
    const auto written = config_.written.find("robot." + key);
    const ConfigPlace place = written == config_.written.end()
                                  ? ConfigPlace{config_.robot_file.generic_string(), 0, 0}
                                  : written->second;
    errors_.push_back({place.file, place.line, place.column, std::move(message)});
  }
  bool written(const std::string& key) const { return config_.written.contains("robot." + key); }
  bool none() const { return errors_.empty(); }
  std::vector<ConfigError> take() { return std::move(errors_); }

 private:
  const MissionConfig& config_;
  std::vector<ConfigError> errors_;
};

void check_sweep(const RobotConfig& robot, const drivers::MirrorField& mirror, Problems& problems) {
  const drivers::SweepPlan plan =
      drivers::plan_sweep(field_of(robot.scanner), mirror, mount_of(robot.scanner).T_P_L());
  if (!plan.problem.empty()) return problems.add("scanner.tilt_deg", plan.problem);
  const double run_up_rad =
      robot.pan.stop_and_go ? 0 : drivers::run_up_rad(plan, kPanAcceleration_radps2);
  const double turned_deg =
      degrees(std::max(std::abs(plan.pan_first_rad), std::abs(plan.pan_last_rad)) + run_up_rad);
  if (turned_deg <= robot.pan.angle_max_deg) return;
  problems.add(
      "pan.angle_max_deg",
      fmt::format(
          "this field of view needs the pan unit to turn {:.1f} deg to both sides, {:.1f} of them "
          "to run up to {:.1f} deg/s, and it turns {:.1f}: narrow [scanner] fov_deg, turn more "
          "slowly by a smaller azimuth_step_deg, set [pan] stop_and_go, or use a slip-ring model "
          "and say so in angle_max_deg",
          turned_deg, degrees(run_up_rad), degrees(plan.rate_radps), robot.pan.angle_max_deg));
}

void check_lms(const RobotConfig& robot, Problems& problems) {
  const drivers::LmsSettings settings = lms_settings(robot.scanner);
  if (const std::string problem = drivers::lms_settings_problem(settings); !problem.empty())
    problems.add("scanner.elevation_step_deg", problem);
  else
    check_sweep(robot, mirror_of(settings), problems);
}

void check_step(const std::string& key, double asked_deg, double has_deg, const std::string& who,
                Problems& problems) {
  if (std::abs(asked_deg / has_deg - 1) <= kStepShare) return;
  problems.add("scanner." + key,
               fmt::format("{} measures every {:.4g} deg, not every {:.4g}: set {} = {:.4g}", who,
                           has_deg, asked_deg, key, has_deg));
}

void check_hokuyo(const RobotConfig& robot, Problems& problems) {
  const drivers::ScipParameters says = hokuyo_parameters(robot.scanner.model);
  check_step("elevation_step_deg", robot.scanner.elevation_step_deg, 360.0 / says.steps_per_turn,
             "a " + says.model, problems);
  check_sweep(robot, mirror_of(says), problems);
}

void check_fixed(const ScannerConfig& scanner, const FixedField& has, Problems& problems) {
  check_step("azimuth_step_deg", scanner.azimuth_step_deg, has.azimuth_step_deg, has.name,
             problems);
  check_step("elevation_step_deg", scanner.elevation_step_deg, has.elevation_step_deg, has.name,
             problems);
  if (scanner.fov_deg < 360)
    problems.add("scanner.fov_deg", has.name + " looks all round: set fov_deg = 360");
  if (scanner.elevation_min_deg < has.elevation_min_deg - kElevationSlack_deg)
    problems.add("scanner.elevation_min_deg",
                 fmt::format("{} looks no lower than {:.1f} deg: set elevation_min_deg = {:.1f}",
                             has.name, has.elevation_min_deg, has.elevation_min_deg));
  if (scanner.elevation_max_deg > has.elevation_max_deg + kElevationSlack_deg)
    problems.add("scanner.elevation_max_deg",
                 fmt::format("{} looks no higher than {:.1f} deg: set elevation_max_deg = {:.1f}",
                             has.name, has.elevation_max_deg, has.elevation_max_deg));
  for (const char* key :
       {"tilt_deg", "roll_deg", "yaw_deg", "offset_x_m", "offset_y_m", "offset_z_m"})
    if (problems.written(std::string("scanner.") + key))
      problems.add(std::string("scanner.") + key,
                   has.name + " stands upright on the robot, without a pan unit: leave out " + key);
}

void check_ouster(const ScannerConfig& scanner, Problems& problems) {
  const OusterFile file = ouster_file(scanner);
  if (!file.problem.empty())
    return problems.add("scanner.metadata",
                        fmt::format("metadata file '{}': {}; save what the sensor serves at "
                                    "http://SENSOR/api/v1/sensor/metadata",
                                    scanner.metadata.generic_string(), file.problem));
  const drivers::OusterMetadata& m = file.metadata;
  const double lowest_deg = m.beam_altitude_deg.back(), highest_deg = m.beam_altitude_deg.front();
  check_fixed(
      scanner,
      {m.model.empty() ? "an Ouster" : "an " + m.model, lowest_deg, highest_deg,
       (highest_deg - lowest_deg) / static_cast<double>(std::max<std::size_t>(m.rows, 2) - 1),
       360.0 / static_cast<double>(m.columns_per_frame)},
      problems);
}

// What turns by itself looks all round ten times a second; a profile scanner on a pan unit stands
// upright, and shows one direction at a time.
void check_look(const RobotConfig& robot, Problems& problems) {
  if (needs_pan(robot.scanner))
    return problems.add(
        "obstacles.device",
        "a scanner on a pan unit cannot look ahead on the way, only a vlp16 or an "
        "ouster can: give [obstacles] a hokuyo of its own, or set device = \"none\"");
  for (const char* key : {"link", "model", "height_m", "offset_x_m"})
    if (problems.written(std::string("obstacles.") + key))
      problems.add(
          std::string("obstacles.") + key,
          std::string("the [scanner] itself looks ahead, from where it is: leave out ") + key);
  if (robot.scanner.device != "ouster") return;
  const OusterFile file = ouster_file(robot.scanner);
  const auto [first, last] = file.metadata.column_window;
  if (file.problem.empty() && last - first + 1 != file.metadata.columns_per_frame)
    problems.add("obstacles.device",
                 fmt::format("the sensor measures only columns {} to {} of {}: set its azimuth "
                             "window to all round, and save its metadata anew",
                             first, last, file.metadata.columns_per_frame));
}

}  // namespace

bool needs_pan(const ScannerConfig& scanner) {
  return scanner.device != "vlp16" && scanner.device != "ouster";
}

// Higher than this passes over the robot 2 m ahead, and farther away over what could come near it.
double look_max_rad() {
  return std::atan2(0.1, 2.0);
}

drivers::SweepMount mount_of(const ScannerConfig& scanner) {
  return {.tilt_rad = hal::radians(scanner.tilt_deg),
          .roll_rad = hal::radians(scanner.roll_deg),
          .yaw_rad = hal::radians(scanner.yaw_deg),
          .P_offset_m = {scanner.offset_x_m, scanner.offset_y_m, scanner.offset_z_m}};
}

drivers::SweepField field_of(const ScannerConfig& scanner) {
  return {.fov_rad = hal::radians(scanner.fov_deg),
          .elevation_min_rad = hal::radians(scanner.elevation_min_deg),
          .elevation_max_rad = hal::radians(scanner.elevation_max_deg),
          .azimuth_step_rad = hal::radians(scanner.azimuth_step_deg)};
}

// The whole arc where half a turn of the pan axis then shows all; else no more than is wanted.
drivers::LmsSettings lms_settings(const ScannerConfig& scanner) {
  const Arc arc = is_lms5xx(scanner) ? kLms5xx : kLms1xx;
  const auto device_deg = [&](double elevation_deg) {
    return 90 + elevation_deg - scanner.tilt_deg;
  };
  drivers::LmsSettings settings;
  settings.lms5xx = is_lms5xx(scanner);
  settings.resolution_1e4deg =
      static_cast<std::int32_t>(std::lround(1e4 * scanner.elevation_step_deg));
  Arc wanted{device_deg(scanner.elevation_min_deg), device_deg(scanner.elevation_max_deg)};
  if (device_deg(180 - scanner.elevation_min_deg) <= arc.last_deg) wanted = arc;
  const auto whole_steps = [&](double angle_deg) {
    return std::lround(1e4 * (angle_deg - arc.first_deg) / settings.resolution_1e4deg);
  };
  const auto start = std::lround(1e4 * arc.first_deg);
  settings.start_1e4deg = static_cast<std::int32_t>(
      start + whole_steps(std::max(wanted.first_deg, arc.first_deg)) * settings.resolution_1e4deg);
  settings.stop_1e4deg = static_cast<std::int32_t>(
      start + whole_steps(std::min(wanted.last_deg, arc.last_deg)) * settings.resolution_1e4deg);
  for (const std::int32_t frequency : {5000, 3500, 2500}) {  // The fastest that it has.
    settings.frequency_centihz = frequency;
    if (drivers::lms_settings_problem(settings).empty()) break;
  }
  return settings;
}

drivers::ScipParameters hokuyo_parameters(const std::string& model) {
  static const std::vector<drivers::ScipParameters> kKnown{
      {"UST-20LX", 20, 60000, 1440, 0, 1080, 540, 2400},
      {"UST-10LX", 20, 30000, 1440, 0, 1080, 540, 2400},
      {"UTM-30LX", 23, 60000, 1440, 0, 1080, 540, 2400},
      {"URG-04LX", 20, 5600, 1024, 44, 725, 384, 600}};
  for (const auto& known : kKnown)
    if (!model.empty() && known.model.starts_with(model)) return known;
  return kKnown.front();
}

OusterFile ouster_file(const ScannerConfig& scanner) {
  OusterFile file;
  if (scanner.metadata.empty()) {
    file.problem = "none is named";
    return file;
  }
  const auto text = read_file(scanner.metadata);
  if (!text)
    file.problem = "it cannot be read";
  else
    file.problem = drivers::parse_ouster_metadata(*text, file.metadata);
  if (text) file.text = *text;
  return file;
}

std::uint16_t packets_port(const ScannerConfig& scanner) {
  const auto parsed = drivers::parse_link_address(scanner.link);
  const auto* link = std::get_if<drivers::LinkAddress>(&parsed);
  const auto* udp = link != nullptr ? std::get_if<drivers::UdpAddress>(link) : nullptr;
  return udp != nullptr ? udp->port : 0;
}

bool asks_ouster(const ScannerConfig& scanner) {
  return scanner.device == "ouster" && !scanner.api_link.empty();
}

std::vector<ConfigError> robot_problems(const MissionConfig& config) {
  const RobotConfig& robot = config.robot;
  Problems problems(config);
  if (robot.scanner.device == "vlp16")
    check_fixed(robot.scanner, {"a VLP-16", -15, 15, 2, 0.2}, problems);
  else if (robot.scanner.device == "ouster")
    check_ouster(robot.scanner, problems);
  else if (robot.scanner.device == "hokuyo")
    check_hokuyo(robot, problems);
  else
    check_lms(robot, problems);
  if (looks_with_scanner(robot)) check_look(robot, problems);
  if (const CorrectionsProblem problem = corrections_problem(robot); !problem.text.empty())
    problems.add(problem.key, problem.text);
  return problems.take();
}

}  // namespace mission
