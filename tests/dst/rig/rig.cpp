#include "tests/dst/rig/rig.hpp"

#include <numbers>
#include <stdexcept>

namespace dst {
namespace {

using support::RandomYard;

constexpr support::YardSize kYard{
    .side_min_m = 10, .side_max_m = 16, .stations = 2, .views_max = 1};

constexpr std::size_t kUnmappedMax = 1, kPeopleMax = 2;

constexpr double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

// Every device that a robot can have, and as few beams as a mission can do with.
void equip(RandomYard& yard) {
  mission::MissionConfig& config = yard.config;
  config.phase2.voxel_m = 0.5;
  config.phase2.height_m = config.phase2.height_max_m = 4;
  config.phase2.views_ahead = 1;
  mission::RobotConfig& robot = config.robot;
  robot.scanner.height_m = 1;
  robot.scanner.range_min_m = 0.5;
  robot.scanner.range_max_m = 25;
  robot.scanner.tilt_deg = 0;
  robot.scanner.fov_deg = 180;
  robot.scanner.azimuth_step_deg = 1;
  robot.scanner.elevation_min_deg = -20;
  robot.scanner.elevation_max_deg = 30;
  robot.scanner.elevation_step_deg = 0.5;
  robot.pan.angle_max_deg = 360;
  robot.obstacles.device = "hokuyo";
  robot.power = {.battery_link = "modbus-tcp:victron",
                 .board_link = "modbus-rtu:relays",
                 .safety_link = "modbus-tcp:pilz"};
}

// So many of what the map lacks: what they cost is the planner's time, which is tested elsewhere.
void leave(RandomYard& yard, std::size_t unmapped, std::size_t people) {
  if (yard.unmapped.size() > unmapped) yard.unmapped.resize(unmapped);
  if (yard.people.size() > people) yard.people.resize(people);
  yard.mesh = sim_test::plain(100);
  yard.build();
}

sim::WorldConfig world_config(const RandomYard& yard) {
  const mission::RobotConfig& robot = yard.config.robot;
  sim::WorldConfig world;
  world.seed = yard.config.seed;
  world.threads = 1;
  world.radius_m = robot.body.radius_m;
  world.track_m = robot.body.track_m;
  world.speed_max_mps = robot.body.speed_max_mps;
  world.turn_max_radps = radians(robot.body.turn_max_degps);
  world.people = yard.people;
  world.scanner.height_m = robot.scanner.height_m;
  world.scanner.range_min_m = robot.scanner.range_min_m;
  world.scanner.range_max_m = robot.scanner.range_max_m;
  return world;
}

}  // namespace

RandomYard make_yard(std::uint64_t seed) {
  RandomYard yard(seed, kYard);
  equip(yard);
  leave(yard, kUnmappedMax, kPeopleMax);
  return yard;
}

RandomYard make_quiet_yard() {
  RandomYard yard = make_yard(1);
  leave(yard, 0, 0);
  return yard;
}

mission::Prepared prepared(const RandomYard& yard) {
  mission::Prepared ready;
  ready.config = yard.config;
  ready.site.map = yard.map;
  ready.tasks = yard.tasks;
  return ready;
}

hal::Task<hal::Result<void>> WatchedBus::send(hal::CanFrame frame, hal::Time deadline) {
  watch_(frame, false);
  return bus_.send(frame, deadline);
}

hal::Task<hal::Result<hal::ReceivedFrame>> WatchedBus::receive() {
  auto received = co_await bus_.receive();
  if (received) watch_(received->frame, true);
  co_return received;
}

Rig::Rig(const RandomYard& yard, hal::Clock& clock, const hal::Pose2& stands)
    : yard_(yard),
      scene_(yard.mesh),
      world_(scene_, world_config(yard)),
      can_(clock),
      scanner_(clock),
      pan_(clock),
      imu_(clock),
      gnss_(clock),
      obstacles_(clock),
      drivers_end_(can_.attach(mission::drive_filters(yard.config.robot.drive))),
      bus_(can_.attach()) {
  if (!world_.put_robot(stands, 0)) throw std::runtime_error("the robot cannot stand there");
  connect(clock);
}

void Rig::connect(hal::Clock& clock) {
  const mission::UnitLinks ends{.drive = &bus_,
                                .second_drive = nullptr,
                                .scanner = &scanner_.b(),
                                .pan = &pan_.b(),
                                .imu = &imu_.b(),
                                .gnss = &gnss_.b(),
                                .obstacles = &obstacles_.b(),
                                .packets = nullptr};
  units_ = std::make_unique<mission::RobotUnits>(config(), mission::kSimAnchor, yard_.config.seed,
                                                 1, world_, clock, ends);
  battery_ = std::make_unique<sim::RegisterWire>(clock, *units_->battery());
  board_ = std::make_unique<sim::RegisterWire>(clock, *units_->board());
  safety_ = std::make_unique<sim::RegisterWire>(clock, *units_->safety());
  drivers_ = std::make_unique<mission::RobotDrivers>(
      config(), mission::kSimAnchor, clock,
      mission::RobotDrivers::Links{.drive = &drivers_end_,
                                   .scanner = &scanner_.a(),
                                   .pan = &pan_.a(),
                                   .imu = &imu_.a(),
                                   .gnss = &gnss_.a(),
                                   .obstacles = &obstacles_.a(),
                                   .packets = nullptr,
                                   .power = {.battery = &battery_->client(),
                                             .gateway = nullptr,
                                             .board = &board_->client(),
                                             .safety = &safety_->client()}});
}

sim::RegisterWire* Rig::registers(std::string_view role) {
  if (role == "battery") return battery_.get();
  if (role == "board") return board_.get();
  return role == "safety" ? safety_.get() : nullptr;
}

void Rig::cut_after(std::string_view role, std::uint64_t count) {
  sim::LinkFaults faults;
  faults.cut_after = count;
  cut_.emplace(role);
  if (role == "drive") can_.set_faults(faults);
  if (role == "scanner") scanner_.set_faults(faults);
  if (role == "pan") pan_.set_faults(faults);
  if (role == "imu") imu_.set_faults(faults);
  if (role == "gnss") gnss_.set_faults(faults);
  if (role == "obstacles") obstacles_.set_faults(faults);
  if (sim::RegisterWire* const wire = registers(role)) wire->set_faults(faults);
}

// Whether the cut came or not.
void Rig::mend(std::string_view role) {
  if (const auto found = cut_.find(role); found != cut_.end()) cut_.erase(found);
  const auto whole = [](auto& wire) {
    wire.mend();
    wire.set_faults({});
  };
  if (role == "drive") whole(can_);
  if (role == "scanner") whole(scanner_);
  if (role == "pan") whole(pan_);
  if (role == "imu") whole(imu_);
  if (role == "gnss") whole(gnss_);
  if (role == "obstacles") whole(obstacles_);
  if (sim::RegisterWire* const wire = registers(role)) whole(*wire);
}

void Rig::press(Press what, bool pressed) {
  const unsigned bit = 1U << static_cast<unsigned>(what);
  held_down_ = pressed ? held_down_ | bit : held_down_ & ~bit;
  auto& board = dynamic_cast<sim::RelayUnit&>(*units_->board());
  auto& safety = dynamic_cast<sim::PilzUnit&>(*units_->safety());
  if (what == Press::base_estop) units_->agilex()->press_estop(pressed);
  if (what == Press::transmitter) units_->agilex()->switch_transmitter(pressed);
  if (what == Press::board_estop) board.press_estop(pressed);
  if (what == Press::safety_estop) safety.press_estop(pressed);
  if (what == Press::bumper) safety.press_bumper(pressed);
}

void Rig::press_button(bool pressed) {
  dynamic_cast<sim::RelayUnit&>(*units_->board()).press_reset(pressed);
}

}  // namespace dst
