#include "mission/main_robot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "drivers/flir_ptu.hpp"
#include "drivers/gpsd_client.hpp"
#include "drivers/hokuyo.hpp"
#include "drivers/link_address.hpp"
#include "drivers/nmea_gnss.hpp"
#include "drivers/ntrip.hpp"
#include "drivers/ouster.hpp"
#include "drivers/sick_lms.hpp"
#include "drivers/ublox.hpp"
#include "drivers/velodyne.hpp"
#include "drivers/vn100.hpp"
#include "hal/angles.hpp"
#include "hal/together.hpp"
#include "mission/look.hpp"
#include "mission/main_corrections.hpp"
#include "mission/main_scanner.hpp"

namespace mission {
namespace {

constexpr int kObstacleTurnsSkipped = 3;  // Of 40 a second.
constexpr hal::Duration kLook = std::chrono::milliseconds(100);

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
  result.speed_max_mps = config.body.speed_max_mps +
                         hal::radians(config.body.turn_max_degps) * config.body.track_m / 2;
  return result;
}

// Of a link that may be read.
std::string tcp_host(const std::string& link) {
  const auto parsed = drivers::parse_link_address(link);
  const auto* address = std::get_if<drivers::LinkAddress>(&parsed);
  const auto* tcp = address != nullptr ? std::get_if<drivers::TcpAddress>(address) : nullptr;
  return tcp != nullptr ? tcp->host : std::string();
}

}  // namespace

std::vector<hal::CanFilter> drive_filters(const DriveConfig& drive) {
  if (drive.device == "cia402") return {};
  const auto filters = drivers::AgilexDrive::filters();
  return {filters.begin(), filters.end()};
}

drivers::OusterApi RobotDrivers::ouster_api(const RobotConfig& config, const Links& links) {
  drivers::OusterApi api;
  if (!asks_ouster(config.scanner)) return api;
  api.config.host = tcp_host(config.scanner.api_link);
  api.config.port = packets_port(config.scanner);
  api.config.own_address = links.own_address;
  api.link = links.scanner_api;
  api.drop = links.drop_scanner_api;
  return api;
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
  add_obstacles(config, links);
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
  const ScannerConfig& scanner = config.scanner;
  if (scanner.device == "vlp16") {
    drivers::VelodyneConfig velodyne;
    velodyne.scan.look_max_rad = look_max_rad();
    add_turning(config, std::make_unique<drivers::Velodyne>(velodyne, clock_, *links.packets));
  } else if (scanner.device == "ouster") {
    drivers::OusterConfig ouster{.scan = {}, .metadata = ouster_file(scanner).metadata};
    ouster.scan.look_max_rad = look_max_rad();
    add_turning(config, std::make_unique<drivers::Ouster>(std::move(ouster), clock_, *links.packets,
                                                          ouster_api(config, links)));
  } else if (scanner.device == "hokuyo") {
    drivers::HokuyoConfig hokuyo;
    hokuyo.model = scanner.model;
    auto& device = own("scanner", scanner.link,
                       std::make_unique<drivers::Hokuyo>(hokuyo, clock_, *links.scanner));
    add_sweep(config, links, device, [&device] { return device.clock_jitter_s(); });
  } else {
    const drivers::SickLmsConfig sick{.settings = lms_settings(scanner)};
    auto& device = own("scanner", scanner.link,
                       std::make_unique<drivers::SickLms>(sick, clock_, *links.scanner));
    add_sweep(config, links, device, [&device] { return device.clock_jitter_s(); });
  }
}

// A 3-D scanner by itself.
template <class T>
void RobotDrivers::add_turning(const RobotConfig& config, std::unique_ptr<T> scanner) {
  T& device = own("scanner", config.scanner.link, std::move(scanner));
  scanner_ = &device;
  if (looks_with_scanner(config)) obstacles_ = &device;
  scan_problem_ = [&device]() -> const std::string& { return device.problem(); };
}

void RobotDrivers::add_sweep(const RobotConfig& config, const Links& links,
                             hal::ProfileScanner& profiles,
                             std::function<double()> clock_jitter_s) {
  drivers::FlirPtuConfig ptu;
  ptu.counter_clockwise = config.pan.counter_clockwise;
  ptu.angle_max_rad = hal::radians(config.pan.angle_max_deg);
  ptu.angle_min_rad = -ptu.angle_max_rad;
  ptu.acceleration_radps2 = kPanAcceleration_radps2;
  auto& pan = own("pan", config.pan.link,
                  std::make_unique<drivers::FlirPtu>(ptu, clock_, *links.pan, links.pan_line));
  drivers::SweepScannerConfig sweep;
  sweep.mount = mount_of(config.scanner);
  sweep.field = field_of(config.scanner);
  sweep.stop_and_go = config.pan.stop_and_go;
  sweep.acceleration_radps2 = kPanAcceleration_radps2;
  sweep.pan_late_s = config.pan.late_s;
  sweep.clock_jitter_s = std::move(clock_jitter_s);
  sweep_ = std::make_unique<drivers::SweepScanner>(sweep, clock_, profiles, pan);
  scanner_ = sweep_.get();
  scan_problem_ = [this]() -> const std::string& { return sweep_->problem(); };
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
    add_ublox(config, output, links);
}

void RobotDrivers::add_ublox(const RobotConfig& config, const drivers::GnssOutputConfig& output,
                             const Links& links) {
  std::unique_ptr<drivers::NtripClient> caster;
  if (has_corrections(config) && links.corrections != nullptr)
    caster = std::make_unique<drivers::NtripClient>(
        drivers::NtripConfig{.request = ntrip_request_of(config.corrections, links.account),
                             .tells_position = config.corrections.tells_position},
        clock_, *links.corrections, links.drop_corrections);
  auto& receiver =
      own("gnss", config.gnss.link,
          std::make_unique<drivers::Ublox>(drivers::UbloxConfig{.settings = {}, .output = output},
                                           clock_, *links.gnss, drivers::SetBaud(), caster.get()));
  gnss_ = &receiver;
  if (!caster) return;
  caster->watch_position([&receiver] { return receiver.output().last(); });
  own("corrections", config.corrections.link, std::move(caster));
}

// Ten scans a second are enough for what moves at a walk, and the newest are what counts.
void RobotDrivers::add_obstacles(const RobotConfig& config, const Links& links) {
  if (config.obstacles.device != "hokuyo" || !links.obstacles) return;
  drivers::HokuyoConfig hokuyo;
  hokuyo.model = config.obstacles.model;
  hokuyo.skip = kObstacleTurnsSkipped;
  hokuyo.profiles_max = 4;
  obstacles_ = &own("obstacles", config.obstacles.link,
                    std::make_unique<drivers::Hokuyo>(hokuyo, clock_, *links.obstacles));
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
  power_ = &own("power", link, std::make_unique<drivers::PowerIo>(settings, clock_, power));
}

std::optional<hal::SafetyInputs> RobotDrivers::safety_inputs() const {
  return power_ == nullptr ? std::nullopt : power_->inputs_now();
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
  return told([](const auto& device) { return device.state() != drivers::DeviceState::running; });
}

std::string RobotDrivers::complaints() const {
  std::string text = told([](const auto& device) {
    return device.state() != drivers::DeviceState::running || !device.troubles().empty();
  });
  const std::string& scan = scan_problem();
  if (!scan.empty()) text += (text.empty() ? "" : "; ") + ("the last scan: " + scan);
  return text;
}

std::string RobotDrivers::told(const std::function<bool(const drivers::Device&)>& of) const {
  std::string text;
  for (const NamedDevice& named : devices_) {
    if (!of(*named.device)) continue;
    text += fmt::format("{}{} ({} at {})", text.empty() ? "" : "; ", named.role,
                        named.device->model(), named.link);
    for (const drivers::Trouble& trouble : named.device->troubles())
      text += fmt::format(": {}{}{}; {}", trouble.fault->name, trouble.detail.empty() ? "" : ", ",
                          trouble.detail, trouble.fault->remedy);
  }
  return text;
}

}  // namespace mission
