#include "mission/main_robot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "drivers/flir_ptu.hpp"
#include "drivers/gpsd_client.hpp"
#include "drivers/nmea_gnss.hpp"
#include "drivers/sick_lms.hpp"
#include "drivers/ublox.hpp"
#include "drivers/vn100.hpp"
#include "hal/together.hpp"

namespace mission {
namespace {

constexpr hal::Duration kLook = std::chrono::milliseconds(100);
constexpr double kPanAcceleration_radps2 = 0.5;

constexpr double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

bool is_lms5xx(const ScannerConfig& scanner) {
  return scanner.device == "sick-lms5xx";
}

// Where a link can change its rate, its own file says so; in memory there is none to change.
drivers::AgilexDrive::Model agilex_model(const std::string& device) {
  if (device == "agilex-scout-mini") return drivers::AgilexDrive::Model::scout_mini;
  if (device == "agilex-bunker") return drivers::AgilexDrive::Model::bunker;
  return drivers::AgilexDrive::Model::scout2;
}

drivers::Cia402Drive::Config cia402_config(const RobotConfig& config) {
  const DriveConfig& drive = config.drive;
  drivers::Cia402Drive::Config result;
  result.left = {static_cast<std::uint8_t>(drive.left_node), drive.left_units_per_mps,
                 drive.left_counts_per_m};
  result.right = {static_cast<std::uint8_t>(drive.right_node), drive.right_units_per_mps,
                  drive.right_counts_per_m};
  result.track_m = config.body.track_m;
  // A wheel on the outside of a turn runs faster than the robot.
  result.speed_max_mps =
      config.body.speed_max_mps + radians(config.body.turn_max_degps) * config.body.track_m / 2;
  return result;
}

drivers::SweepField field_of(const ScannerConfig& scanner) {
  return {.fov_rad = radians(scanner.fov_deg),
          .elevation_min_rad = radians(scanner.elevation_min_deg),
          .elevation_max_rad = radians(scanner.elevation_max_deg),
          .azimuth_step_rad = radians(scanner.azimuth_step_deg)};
}

// Device angles of an LMS: 90 degrees is straight ahead.
struct Arc {
  double first_deg, last_deg;
};
constexpr Arc kLms1xx{-45, 225}, kLms5xx{-5, 185};

drivers::MirrorField mirror_of(const drivers::LmsSettings& settings) {
  const double step_deg = settings.resolution_1e4deg / 1e4;
  const double turn_s = 100.0 / settings.frequency_centihz;
  return {.angle_first_rad = radians(settings.start_1e4deg / 1e4 - 90),
          .angle_step_rad = radians(step_deg),
          .beams = static_cast<std::uint32_t>(
              std::lround((settings.stop_1e4deg - settings.start_1e4deg) / 1e4 / step_deg) + 1),
          .beam_period_s = turn_s * step_deg / 360,
          .interval_s = turn_s};
}

}  // namespace

drivers::SweepMount mount_of(const ScannerConfig& scanner) {
  return {.tilt_rad = radians(scanner.tilt_deg)};
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

std::vector<ConfigError> robot_problems(const MissionConfig& config) {
  const ScannerConfig& scanner = config.robot.scanner;
  std::vector<ConfigError> errors;
  const auto add = [&](const std::string& key, const std::string& message) {
    const auto written = config.written.find("robot." + key);
    const ConfigPlace place = written == config.written.end()
                                  ? ConfigPlace{config.robot_file.generic_string(), 0, 0}
                                  : written->second;
    errors.push_back({place.file, place.line, place.column, message});
  };
  const drivers::LmsSettings settings = lms_settings(scanner);
  if (const std::string problem = drivers::lms_settings_problem(settings); !problem.empty()) {
    add("scanner.elevation_step_deg", problem);
    return errors;
  }
  const drivers::SweepPlan plan =
      drivers::plan_sweep(field_of(scanner), mirror_of(settings), mount_of(scanner).T_P_L());
  if (!plan.problem.empty()) add("scanner.tilt_deg", plan.problem);
  const double turned_deg =
      std::max(std::abs(plan.pan_first_rad), std::abs(plan.pan_last_rad)) * 180 / std::numbers::pi;
  if (turned_deg > config.robot.pan.angle_max_deg)
    add("pan.angle_max_deg",
        fmt::format(
            "this field of view needs the pan unit to turn {:.0f} deg to both sides, and it "
            "turns {:.0f}: narrow [scanner] fov_deg, or use a slip-ring model",
            turned_deg, config.robot.pan.angle_max_deg));
  return errors;
}

template <class T>
T& RobotDrivers::own(std::string role, std::string link, std::unique_ptr<T> device) {
  T& reference = *device;
  devices_.push_back({std::move(role), std::move(link), device.get()});
  owned_.push_back(std::move(device));
  return reference;
}

RobotDrivers::RobotDrivers(const RobotConfig& config,
                           const std::optional<drivers::GeoAnchor>& anchor, hal::Clock& clock,
                           const Links& links)
    : clock_(clock) {
  add_drive(config, links);
  add_scanner(config, links);
  imu_ = &own("imu", config.imu.link,
              std::make_unique<drivers::Vn100>(drivers::Vn100Config{}, clock_, *links.imu));
  add_gnss(config, anchor, links);
  add_power(config, links);
}

RobotDrivers::~RobotDrivers() = default;

void RobotDrivers::add_drive(const RobotConfig& config, const Links& links) {
  if (config.drive.device == "cia402") {
    auto& drive =
        own("drive", config.drive.link,
            std::make_unique<drivers::Cia402Drive>(cia402_config(config), clock_, *links.drive));
    drive_ = &drive;
    release_drive_ = [&drive] { return drive.release(); };
    return;
  }
  drivers::AgilexDrive::Config agilex;
  agilex.model = agilex_model(config.drive.device);
  agilex.track_m = config.body.track_m;
  auto& drive = own("drive", config.drive.link,
                    std::make_unique<drivers::AgilexDrive>(agilex, clock_, *links.drive));
  drive_ = &drive;
  release_drive_ = [&drive] { return drive.release(); };
}

void RobotDrivers::add_scanner(const RobotConfig& config, const Links& links) {
  auto& lms = own("scanner", config.scanner.link,
                  std::make_unique<drivers::SickLms>(
                      drivers::SickLmsConfig{.settings = lms_settings(config.scanner)}, clock_,
                      *links.scanner));
  drivers::FlirPtuConfig ptu;
  ptu.counter_clockwise = config.pan.counter_clockwise;
  ptu.angle_max_rad = radians(config.pan.angle_max_deg);
  ptu.angle_min_rad = -ptu.angle_max_rad;
  ptu.acceleration_radps2 = kPanAcceleration_radps2;
  auto& pan =
      own("pan", config.pan.link, std::make_unique<drivers::FlirPtu>(ptu, clock_, *links.pan));
  drivers::SweepScannerConfig sweep;
  sweep.mount = mount_of(config.scanner);
  sweep.field = field_of(config.scanner);
  sweep.stop_and_go = config.pan.stop_and_go;
  sweep.acceleration_radps2 = kPanAcceleration_radps2;
  sweep.clock_jitter_s = [&lms] { return lms.clock_jitter_s(); };
  sweep_ = std::make_unique<drivers::SweepScanner>(sweep, clock_, lms, pan);
}

void RobotDrivers::add_gnss(const RobotConfig& config,
                            const std::optional<drivers::GeoAnchor>& anchor, const Links& links) {
  drivers::GnssOutputConfig output;
  output.anchor = anchor.value_or(drivers::GeoAnchor{});
  if (!anchor) output.distance_max_m = std::numeric_limits<double>::infinity();
  const std::string& device = config.gnss.device;
  if (device == "nmea")
    gnss_ = &own("gnss", config.gnss.link,
                 std::make_unique<drivers::NmeaGnss>(drivers::NmeaGnssConfig{.output = output},
                                                     clock_, *links.gnss));
  else if (device == "gpsd")
    gnss_ =
        &own("gnss", config.gnss.link,
             std::make_unique<drivers::GpsdClient>(
                 drivers::GpsdClientConfig{.output = output, .device = {}}, clock_, *links.gnss));
  else
    gnss_ = &own("gnss", config.gnss.link,
                 std::make_unique<drivers::Ublox>(
                     drivers::UbloxConfig{.settings = {}, .output = output}, clock_, *links.gnss));
}

void RobotDrivers::add_power(const RobotConfig& config, const Links& links) {
  const auto& power = links.power;
  if (!power.battery && !power.board && !power.safety) return;
  drivers::PowerIo::Config settings;
  if (!power.board) settings.estop.reset(), settings.reset_input.reset();
  std::string link;
  for (const std::string* one :
       {&config.power.battery_link, &config.power.board_link, &config.power.safety_link})
    if (!one->empty()) link += (link.empty() ? "" : ", ") + *one;
  own("power", link, std::make_unique<drivers::PowerIo>(settings, clock_, power));
}

hal::Task<void> RobotDrivers::run() {
  std::vector<hal::Task<void>> loops;
  for (const NamedDevice& named : devices_) loops.push_back(named.device->run());
  co_await hal::together(std::move(loops));
}

hal::Task<hal::Result<void>> RobotDrivers::started(hal::Duration patience) {
  const hal::Time late = clock_.now() + patience;
  while (!not_running().empty()) {
    if (clock_.now() >= late)
      co_return boost::system::errc::make_error_code(boost::system::errc::timed_out);
    co_await clock_.sleep_for(kLook);
  }
  co_return hal::Result<void>{};
}

std::string RobotDrivers::not_running() const {
  std::string text;
  for (const NamedDevice& named : devices_) {
    if (named.device->state() == drivers::DeviceState::running) continue;
    text += fmt::format("{}{} ({} at {})", text.empty() ? "" : "; ", named.role,
                        named.device->model(), named.link);
    for (const drivers::Trouble& trouble : named.device->troubles())
      text += fmt::format(": {}{}{}; {}", trouble.fault->name, trouble.detail.empty() ? "" : ", ",
                          trouble.detail, trouble.fault->remedy);
  }
  return text;
}

}  // namespace mission
