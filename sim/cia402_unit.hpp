// Two CiA 402 drives on a CANopen bus, one per side of the robot: object dictionaries, SDO servers,
// PDOs on SYNC, heartbeats, emergencies, and the state machine.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen_pdo.hpp"
#include "drivers/cia402.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

struct Cia402NodeConfig {
  std::uint8_t node = 1;
  double units_per_mps = 1000;  // Of target and actual velocity.
  double counts_per_m = 10000;  // Of the position; negative where the motor is mirrored, as above.
  std::int32_t position = 0;    // At power-up.
  std::uint32_t vendor = 0x59, product = 0x402, serial = 7;
  std::string name = "simulated drive", software = "1.0";
  std::uint32_t device_type = 0x00020192;
  std::uint32_t modes = 0x00000185;  // PP, PV, CSP, CSV.
  bool watches_master = true;        // False: takes 0x1016, but does nothing about it.
  // Mapped like this for ever, as some drives are; empty: as it is told.
  std::vector<drivers::canopen::PdoSetup> fixed_mapping;
};

// One drive. Switched off (UnitFault::off) it forgets its settings, its state and its position.
// `wrong` falsifies its position but not its speed.
class Cia402Node {
 public:
  // rolled_m: how far this side rolled since it was last asked, speed_mps: how fast it rolls.
  struct Wheel {
    std::function<double()> rolled_m, speed_mps;
    std::function<void()> told;  // target_mps() may have changed.
  };

  Cia402Node(const Cia402NodeConfig& config, Wheel wheel, hal::Clock& clock, hal::CanBus& bus,
             UnitFaults& faults);

  hal::Task<void> run();  // Ends only by cancellation.

  double target_mps() const;  // 0 unless enabled.
  void set_stalled(bool stalled);
  void open_sto(bool open);  // Its enable input: without it no torque.
  // Falls into this fault, as an over-current would do; 0x0000 is none.
  void fail(std::uint16_t code);

 private:
  struct Object {
    std::uint32_t value{};
    std::uint8_t size{};
    bool writable = true;
  };
  using Key = std::uint32_t;  // Index and sub-index.
  struct MappedPdo {          // As the objects say, for use at every SYNC.
    bool on = false;
    std::vector<drivers::canopen::Mapped> mapping;
    std::vector<Object*> objects;
    std::vector<std::int64_t> values;
  };

  hal::Task<void> listen();
  hal::Task<void> live();
  hal::Task<void> power_up();
  void reset_objects();
  void add_pdo(std::uint16_t parameters, std::uint16_t map, std::uint32_t cob_id);
  hal::Task<void> hear(const hal::CanFrame& frame);
  hal::Task<void> on_nmt(drivers::canopen::NmtCommand command);
  hal::Task<void> on_sync();
  std::variant<drivers::Bytes, std::uint32_t> read(drivers::canopen::Address at);
  std::uint32_t write(drivers::canopen::Address at, drivers::ByteView data);
  std::uint32_t refuses(Key key, const Object& object, std::uint32_t value) const;
  std::uint32_t live_value(Key key, std::uint32_t stored) const;
  void map_pdos();
  void take_rpdo(std::size_t index);
  hal::Task<void> send_tpdo(std::uint8_t number, MappedPdo& pdo);
  void obey(std::uint16_t controlword);
  void enter(drivers::cia402::State state);
  std::uint16_t statusword() const;
  hal::Task<void> tell_emergency();
  void roll();
  hal::Task<void> send(const drivers::canopen::Message& message);
  hal::Task<void> send_frame(const hal::CanFrame& frame);
  std::uint32_t object(std::uint16_t index, std::uint8_t sub) const;

  const Cia402NodeConfig config_;
  Wheel wheel_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyCan bus_;
  drivers::canopen::SdoServer server_;
  std::map<Key, Object> objects_;
  drivers::canopen::NodeState nmt_ = drivers::canopen::NodeState::pre_operational;
  drivers::cia402::State state_ = drivers::cia402::State::switch_on_disabled;
  std::uint16_t controlword_ = 0, error_code_ = 0;
  bool error_untold_ = false, stalled_ = false, sto_open_ = false, was_off_ = false;
  bool booted_ = false, hears_master_ = false;
  double position_ = 0;  // Counts.
  hal::Time master_at_{}, stalled_at_{}, stopping_at_{}, next_heartbeat_{};
  static constexpr std::size_t kPdos = 4;
  std::array<std::optional<drivers::canopen::Pdo>, kPdos> heard_;
  std::array<MappedPdo, kPdos> rpdos_, tpdos_;
  int syncs_ = 0;
};

// Both, on one world. Each node has its own end of the bus and its own faults.
class Cia402Unit {
 public:
  Cia402Unit(const Cia402NodeConfig& left, const Cia402NodeConfig& right, World& world,
             hal::Clock& clock, hal::CanBus& left_bus, hal::CanBus& right_bus,
             UnitFaults& left_faults, UnitFaults& right_faults);

  hal::Task<void> run();

  Cia402Node& left() { return left_; }
  Cia402Node& right() { return right_; }

 private:
  Cia402Node::Wheel wheel(bool is_left);
  double rolled_m(bool is_left);
  void drive();

  World& world_;
  hal::Clock& clock_;
  double left_m_ = 0, right_m_ = 0;  // Rolled, and not yet told to the node.
  Cia402Node left_, right_;
};

}  // namespace sim
