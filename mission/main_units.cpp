#include "mission/main_units.hpp"

#include "hal/angles.hpp"
#include "hal/together.hpp"
#include "mission/look.hpp"
#include "mission/main_corrections.hpp"
#include "mission/main_scanner.hpp"

namespace mission {
namespace {

constexpr double kArcsecPerStep = 46.2857;  // A PTU-E46-70 in half steps.
constexpr double kObstacleRangeMax_m = 20;  // Of a UST-20LX.
constexpr double kBaseNorth_deg = 0.03;     // 3.3 km: a base of the neighbourhood.
constexpr double kShortRangeMax_m = 65;     // What an LMS5xx can tell in millimetres.

drivers::agilex::Limits limits_of(const std::string& device) {
  return device == "agilex-scout2" ? drivers::agilex::kScout2 : drivers::agilex::kScoutMini;
}

sim::Cia402NodeConfig node_config(int node, double units_per_mps, double counts_per_m) {
  sim::Cia402NodeConfig config;
  config.node = static_cast<std::uint8_t>(node);
  config.units_per_mps = units_per_mps;
  config.counts_per_m = counts_per_m;
  return config;
}

}  // namespace

RobotUnits::RobotUnits(const RobotConfig& config, const drivers::GeoAnchor& anchor,
                       std::uint64_t seed, int threads, sim::World& world, hal::Clock& clock,
                       const UnitLinks& links)
    : seed_(seed), world_(world), clock_(clock), supply_(sim::BatteryConfig{}, world) {
  if (links.drive) add_drive(config, links);
  if (links.scanner && links.pan && needs_pan(config.scanner)) add_sweep(config, threads, links);
  if (links.packets && !needs_pan(config.scanner)) add_turning(config, links);
  if (links.imu)
    imu_.emplace(sim::Vn100UnitConfig{}, world_, clock_, *links.imu, add_faults("imu"));
  if (links.gnss) add_gnss(config, anchor, links);
  if (links.obstacles && config.obstacles.device == "hokuyo") add_obstacles(config, threads, links);
  add_power(config.power);
  if (links.corrections && has_corrections(config))
    add_corrections(config.corrections, anchor, *links.corrections);
}

RobotUnits::~RobotUnits() = default;

// Each with a seed of its own, in the order in which they are made.
sim::UnitFaults& RobotUnits::add_faults(std::string role) {
  const std::uint64_t seed = seed_ * 64 + faults_.size();
  return *faults_.emplace_back(std::move(role), std::make_unique<sim::UnitFaults>(clock_, seed))
              .faults;
}

sim::UnitFaults* RobotUnits::faults(std::string_view role) {
  for (const Faulty& faulty : faults_)
    if (faulty.role == role) return faulty.faults.get();
  return nullptr;
}

void RobotUnits::add_drive(const RobotConfig& config, const UnitLinks& links) {
  const DriveConfig& drive = config.drive;
  sim::UnitFaults& faults = add_faults("drive");
  if (drive.device == "cia402") {
    cia402_.emplace(
        node_config(drive.left_node, drive.left_units_per_mps, drive.left_counts_per_m),
        node_config(drive.right_node, drive.right_units_per_mps, drive.right_counts_per_m), world_,
        clock_, *links.drive, *links.second_drive, faults, add_faults("drive2"));
    return;
  }
  sim::AgilexUnit::Config agilex;
  agilex.limits = limits_of(drive.device);
  agilex_.emplace(agilex, world_, &supply_, clock_, *links.drive, faults);
}

void RobotUnits::add_sweep(const RobotConfig& config, int threads, const UnitLinks& links) {
  sim::FlirPtuUnitConfig ptu;
  ptu.arcsec_per_step = kArcsecPerStep;
  ptu.counter_clockwise = config.pan.counter_clockwise;
  ptu.angle_max_rad = hal::radians(config.pan.angle_max_deg);
  ptu.reset_time = {};  // It was on before the computer was.
  ptu.seed = seed_;
  ptu_.emplace(ptu, clock_, *links.pan, add_faults("pan"));
  if (config.scanner.device == "hokuyo") {
    sim::HokuyoUnitConfig hokuyo;
    hokuyo.parameters = hokuyo_parameters(config.scanner.model);
    hokuyo.T_P_L = mount_of(config.scanner).T_P_L();
    hokuyo.ranges = world_.config().scanner;
    hokuyo.seed = seed_;
    hokuyo.threads = threads;
    hokuyo_.emplace(hokuyo, world_, clock_, *links.scanner, add_faults("scanner"), *ptu_);
    return;
  }
  sim::SickLmsUnitConfig lms;
  lms.lms5xx = config.scanner.device == "sick-lms5xx";
  lms.long_range = lms.lms5xx && config.scanner.range_max_m > kShortRangeMax_m;
  lms.T_P_L = mount_of(config.scanner).T_P_L();
  lms.ranges = world_.config().scanner;
  lms.seed = seed_;
  lms.threads = threads;
  lms_.emplace(lms, world_, clock_, *links.scanner, add_faults("scanner"), *ptu_);
}

void RobotUnits::add_obstacles(const RobotConfig& config, int threads, const UnitLinks& links) {
  sim::HokuyoUnitConfig hokuyo;
  hokuyo.parameters = hokuyo_parameters(config.obstacles.model);
  // Lower than the scanner whose height the world knows, by so much.
  hokuyo.T_P_L.translation() << config.obstacles.offset_x_m, 0,
      config.obstacles.height_m - world_.config().scanner.height_m;
  hokuyo.ranges = world_.config().scanner;
  hokuyo.ranges.range_min_m = hokuyo.parameters.range_min_mm / 1000.0;
  hokuyo.ranges.range_max_m = kObstacleRangeMax_m;
  hokuyo.seed = seed_ + 1;
  hokuyo.threads = threads;
  obstacles_.emplace(hokuyo, world_, clock_, *links.obstacles, add_faults("obstacles"), level_);
}

// Of a robot in motion only the beams that look ahead are wanted.
void RobotUnits::add_turning(const RobotConfig& robot, const UnitLinks& links) {
  const ScannerConfig& config = robot.scanner;
  const double in_motion_max_rad = looks_with_scanner(robot) ? look_max_rad() : -hal::radians(90);
  sim::DatagramSender& packets = *links.packets;
  if (config.device == "ouster") {
    sim::OusterUnitConfig ouster;
    const OusterFile file = ouster_file(config);
    ouster.metadata = file.metadata;
    ouster.metadata_text = file.text;
    ouster.settings.udp_port_lidar =
        links.packets_port != 0 ? links.packets_port : packets_port(config);
    ouster.ranges = world_.config().scanner;
    ouster.seed = seed_;
    ouster.in_motion_max_rad = in_motion_max_rad;
    ouster_.emplace(std::move(ouster), world_, clock_, packets, add_faults("scanner"),
                    asks_ouster(config) ? links.scanner_api : nullptr);
    return;
  }
  sim::VelodyneUnitConfig velodyne;
  velodyne.ranges = world_.config().scanner;
  velodyne.seed = seed_;
  velodyne.in_motion_max_rad = in_motion_max_rad;
  velodyne_.emplace(velodyne, world_, clock_, packets, add_faults("scanner"));
}

void RobotUnits::add_gnss(const RobotConfig& config, const drivers::GeoAnchor& anchor,
                          const UnitLinks& links) {
  sim::GnssSourceConfig source;
  source.anchor = anchor;
  sim::UnitFaults& faults = add_faults("gnss");
  if (config.gnss.device == "nmea") {
    sim::NmeaUnitConfig nmea;
    nmea.source = source;
    nmea_.emplace(nmea, world_, clock_, *links.gnss, faults);
  } else if (config.gnss.device == "gpsd") {
    sim::GpsdUnitConfig gpsd;
    gpsd.source = source;
    gpsd_.emplace(gpsd, world_, clock_, *links.gnss, faults);
  } else {
    sim::UbloxUnitConfig ublox;
    ublox.source = source;
    ublox_.emplace(ublox, world_, clock_, *links.gnss, faults);
  }
}

void RobotUnits::add_power(const PowerConfig& config) {
  if (!config.battery_link.empty())
    victron_.emplace(sim::VictronUnit::Config{}, supply_, clock_, add_faults("battery"));
  if (!config.board_link.empty()) board_.emplace(clock_, add_faults("board"));
  if (!config.safety_link.empty()) pilz_.emplace(add_faults("safety"));
}

void RobotUnits::add_corrections(const CorrectionsConfig& config, const drivers::GeoAnchor& anchor,
                                 hal::ByteStream& end) {
  sim::NtripUnitConfig caster;
  caster.mountpoint = config.mountpoint;
  caster.version = config.version == 1 ? drivers::NtripVersion::v1 : drivers::NtripVersion::v2;
  caster.wants_position = config.tells_position;
  caster.base = {anchor.latitude_deg + kBaseNorth_deg, anchor.longitude_deg, anchor.height_m};
  caster_.emplace(std::move(caster), clock_, end, add_faults("corrections"));
}

hal::Task<void> RobotUnits::run() {
  std::vector<hal::Task<void>> loops;
  const auto add = [&](auto& unit) {
    if (unit) loops.push_back(unit->run());
  };
  add(agilex_);
  add(cia402_);
  add(ptu_);
  add(lms_);
  add(hokuyo_);
  add(obstacles_);
  add(velodyne_);
  add(ouster_);
  add(imu_);
  add(ublox_);
  add(nmea_);
  add(gpsd_);
  add(board_);
  add(caster_);
  co_await hal::together(std::move(loops));
}

SimulatedRobot::SimulatedRobot(const RobotConfig& config, const drivers::GeoAnchor& anchor,
                               std::uint64_t seed, int threads, sim::World& world,
                               hal::Clock& clock)
    : can_(clock),
      scanner_(clock),
      pan_(clock),
      imu_(clock),
      gnss_(clock),
      obstacles_(clock),
      corrections_(clock),
      scanner_api_(clock),
      packets_(clock) {
  hal::CanBus& drivers_end = can_.attach(drive_filters(config.drive));
  const UnitLinks ends{.drive = &can_.attach(),
                       .second_drive = config.drive.device == "cia402" ? &can_.attach() : nullptr,
                       .scanner = &scanner_.b(),
                       .pan = &pan_.b(),
                       .imu = &imu_.b(),
                       .gnss = &gnss_.b(),
                       .obstacles = &obstacles_.b(),
                       .corrections = &corrections_.b(),
                       .packets = &packets_.sender(),
                       .scanner_api = &scanner_api_.b(),
                       .packets_port = 0};
  units_ = std::make_unique<RobotUnits>(config, anchor, seed, threads, world, clock, ends);
  const auto registers = [&](sim::RegisterUnit* unit) -> hal::Registers* {
    if (!unit) return nullptr;
    return &registers_.emplace_back(std::make_unique<sim::RegisterWire>(clock, *unit))->client();
  };
  drivers_ = std::make_unique<RobotDrivers>(
      config, anchor, clock,
      RobotDrivers::Links{.drive = &drivers_end,
                          .scanner = &scanner_.a(),
                          .pan = &pan_.a(),
                          .imu = &imu_.a(),
                          .gnss = &gnss_.a(),
                          .obstacles = &obstacles_.a(),
                          .scanner_api = &scanner_api_.a(),
                          .drop_scanner_api =
                              [this] {
                                scanner_api_.cut();
                                scanner_api_.mend();
                              },
                          .own_address = {},
                          .corrections = &corrections_.a(),
                          .drop_corrections =
                              [this] {
                                corrections_.cut();
                                corrections_.mend();
                              },
                          .account = {},
                          .packets = &packets_.receiver(),
                          .power = {.battery = registers(units_->battery()),
                                    .gateway = nullptr,
                                    .board = registers(units_->board()),
                                    .safety = registers(units_->safety())}});
}

SimulatedRobot::~SimulatedRobot() = default;

hal::Task<void> SimulatedRobot::run() {
  std::vector<hal::Task<void>> both;
  both.push_back(units_->run());
  both.push_back(drivers_->run());
  co_await hal::together(std::move(both));
}

}  // namespace mission
