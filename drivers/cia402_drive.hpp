// Two CiA 402 drives in a velocity mode on a CANopen bus, one per side: a base of one's own.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen_pdo.hpp"
#include "drivers/cia402.hpp"
#include "drivers/cia402_layout.hpp"
#include "drivers/device.hpp"
#include "drivers/eds.hpp"
#include "drivers/odometer.hpp"
#include "drivers/stall.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"
#include "hal/wake.hpp"

namespace drivers {

// Configures both drives (every setting read back; PDO mappings where they can be written, else the
// drive's own mapping is used if it has what is needed), enables both, and moves them only while
// both are enabled and report: when one drops out, the other is stopped in the same cycle of 20 ms.
// The drives themselves stop when this program's heartbeat is missing for 300 ms. A drive that was
// switched off is configured anew; a fault is reset a few times, then left for a person.
class Cia402Drive final : public hal::GuardedDrive, public Device {
 public:
  struct Side {
    std::uint8_t node{};  // 1..126
    // Of 0x60FF and 0x606C (or 0x6042 and 0x6044), and of 0x6064. Negative where the motor is
    // mounted the other way round. Found at commissioning.
    double units_per_mps{};
    double counts_per_m{};
  };
  struct Config {
    Side left{1, 1000, 10000}, right{2, 1000, 10000};
    double track_m = 0.6;
    double speed_max_mps = 1.0;  // Of either side.
    std::uint8_t master = 127;   // Our own node.
    cia402::Mode mode = cia402::Mode::profile_velocity;
    std::uint32_t acceleration{}, deceleration{}, quick_stop_deceleration{};  // 0: as is.
    std::uint32_t vendor{}, product{};                                        // 0: any.
    std::optional<eds::Description> eds;  // What the drives have: checked before they are asked.
    // A command counts for this long unless repeated.
    hal::Duration command_max = std::chrono::milliseconds(200);
    StallWatch::Limits stall;
  };

  Cia402Drive(const Config& config, hal::Clock& clock, hal::CanBus& bus);

  // Slowed down as a whole beyond speed_max_mps. Fails with
  //   errc::io_error: the wheels stood though they were told to turn (Config::stall); both are told
  //     to stand, and stay so until something else than pushing on is commanded;
  //   errc::operation_not_permitted: both report, but not both are enabled: their STO input is open
  //     or a fault holds them (troubles() says which);
  //   errc::not_connected: not both report;
  //   errc::invalid_argument: not finite.
  hal::Task<hal::Result<void>> command(hal::Twist twist) override;
  // Waits for both drives, however long one is silent. One caller at a time.
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override;

  // An open STO input and a fault look alike: either is `held`. So does enabling, at the start.
  hal::DriveStatus status() const override;
  // The time-out is the drives' watch over our heartbeat (0x1016, read back after it was set, with
  // quick stop as what follows). Here our heart stops while both stand enabled, and both must leave
  // that state by themselves; then they are brought up anew. Nothing moves.
  hal::Task<hal::Result<hal::Duration>> prove_timeout() override;

  std::string_view model() const override { return "cia402"; }
  hal::Task<void> run() override;
  DeviceState state() const override;
  const Identity& identity() const override { return identity_; }  // Of the left drive.
  std::vector<Trouble> troubles() const override;

  // Before the program ends: stands, then switches the power stages off.
  hal::Task<void> release();

  std::span<const Fault> faults() const;  // All of this driver's own.

 private:
  struct Reports {  // Of one drive. Time 0: never.
    hal::Time heartbeat_at{}, status_at{}, position_at{};
    std::optional<canopen::NodeState> nmt;
    std::optional<std::uint16_t> statusword;
    std::int64_t velocity{}, torque_permille{};
    std::int32_t position{};
    std::optional<std::int32_t> position_before_restart;
    std::uint32_t position_offset{};
    int since_sync = 0;
    hal::Time doubled_at{}, missed_at{}, unread_at{};
    std::string_view unread_why;
    int missed{};
    std::uint16_t emergency{};
    std::uint8_t error_register{};
  };
  struct Node {
    explicit Node(const Side& its_side, std::string_view its_name)
        : side(its_side), name(its_name) {}

    const Side side;
    const std::string_view name;
    Reports heard;
    // The dialogue.
    std::deque<hal::CanFrame> replies;  // At most kRepliesMax; the oldest are lost beyond that.
    hal::Wake replied;
    bool configured = false;
    cia402::PdoLayout layout;
    bool refused_mapping = false;    // In the dialogue under way.
    std::optional<Trouble> failure;  // Why it is not configured.
    std::string serial, type, version;
    hal::Duration answer_took{};
    bool deaf = false;  // Its heart beats, but it does not answer.
    // The state machine.
    hal::Time enabling_since{}, enabled_since{}, fault_since{};
    bool resetting = false;
    int resets = 0;
    SideWatch watch;
    int boots = 0;
  };
  struct Outcome {
    Bytes data;
    std::optional<canopen::SdoFailure> failure;
  };

  hal::Task<void> listen();
  hal::Task<void> serve(Node& node);
  hal::Task<void> cycle();
  void hear(const hal::ReceivedFrame& received);
  void on(const canopen::Heartbeat& heartbeat, hal::Time at);
  void on(const canopen::Emergency& emergency, hal::Time at);
  void on(const canopen::Pdo& pdo, hal::Time at);
  void on(const canopen::Sdo& sdo, hal::Time at);
  void on_status(Node& node, const canopen::Pdo& pdo, hal::Time at);
  void on_position(Node& node, const canopen::Pdo& pdo, hal::Time at);
  void roll(hal::Time at);
  void watch_sides();
  Node* node_of(std::uint8_t id);

  hal::Task<std::optional<Trouble>> bring_up(Node& node);
  hal::Task<std::optional<Trouble>> identify(Node& node);
  hal::Task<std::optional<Trouble>> apply_all(Node& node, std::vector<canopen::Setting> settings);
  hal::Task<std::optional<Trouble>> apply(Node& node, const canopen::Setting& setting);
  hal::Task<std::optional<Trouble>> use_fixed_mapping(Node& node,
                                                      const cia402::VelocityConfig& wanted);
  hal::Task<std::vector<canopen::Mapped>> read_mapping(Node& node, std::uint16_t index);
  cia402::VelocityConfig velocity_config(const Node& node) const;
  hal::Task<std::optional<Trouble>> start(Node& node);
  hal::Task<void> look_after(Node& node);
  hal::Task<Outcome> transfer(Node& node, canopen::SdoClient client);
  hal::Task<Outcome> read(Node& node, canopen::Address at);
  hal::Task<std::uint32_t> number(Node& node, canopen::Address at);
  hal::Task<std::string> text(Node& node, canopen::Address at);
  std::optional<Trouble> against_eds(const Node& node, const canopen::Setting& setting) const;
  Trouble sdo_trouble(const Node& node, const canopen::SdoFailure& failure,
                      std::string_view what) const;

  void count_reports(hal::Time now);
  void decide(hal::Time now);
  std::uint16_t controlword(Node& node, hal::Time now);
  std::uint16_t reset_word(Node& node, hal::Time now);
  double target_mps(const Node& node) const;
  canopen::Pdo target(Node& node, hal::Time now);
  hal::Task<void> send(const canopen::Message& message);
  hal::Task<void> stand_now();
  hal::Task<hal::Result<hal::Duration>> stop_our_heart();

  std::optional<cia402::State> state_of(const Node& node) const;
  bool beats(const Node& node, hal::Time now) const;
  bool reports(const Node& node, hal::Time now) const;
  bool enabled(const Node& node, hal::Time now) const;
  void add_bus_troubles(std::vector<Trouble>& all, hal::Time now) const;
  void add_node_troubles(std::vector<Trouble>& all, const Node& node, hal::Time now) const;
  void add_report_troubles(std::vector<Trouble>& all, const Node& node, hal::Time now) const;
  std::string who(const Node& node, const std::string& what = {}) const;
  std::string others() const;

  const Config config_;
  hal::Clock& clock_;
  hal::CanBus& bus_;
  const cia402::VelocityObjects objects_;
  Node left_, right_;
  Identity identity_;
  bool started_ = false, ran_ = false, released_ = false;
  hal::Time started_at_{};

  Odometer odometer_;
  hal::Wake odometry_heard_;
  hal::Time rolled_at_{};
  bool left_fresh_ = false, right_fresh_ = false;

  hal::Twist wanted_;
  hal::Time wanted_at_{};
  hal::Twist told_;
  BlockedWay way_;
  bool moving_allowed_ = false, stopping_ = false;
  bool heart_stopped_ = false;  // Of ours, for the proof of the drives' time-out.

  hal::Time next_heartbeat_{};
  std::bitset<128> heard_nodes_;
  int strangers_ = 0;
  hal::Time stranger_at_{};
  std::uint32_t stranger_id_{};
  boost::system::error_code send_error_, receive_error_;
};

}  // namespace drivers
