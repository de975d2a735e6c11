// Supply, relays and safety inputs over Modbus: a Victron battery monitor behind a Cerbo GX (TCP),
// a Waveshare relay and input board (RTU), a Pilz PNOZmulti 2 (TCP). A robot may lack some of them.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/safety_map.hpp"
#include "drivers/victron_map.hpp"
#include "drivers/waveshare_map.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

// Reads along: hardware stops the robot. Inputs are asked for 20 times a second and count as
// pressed when they are older than 200 ms, the battery once a second and is unknown after 5 s.
class PowerIo final : public hal::PowerIo, public Device {
 public:
  // Null where the robot does not have it. Each is one unit: a battery service, the gateway's own
  // (100), the board, the safety controller.
  struct Links {
    hal::Registers* battery{};
    hal::Registers* gateway{};
    hal::Registers* board{};
    hal::Registers* safety{};
  };
  // Two contacts of a safety relay on inputs of the board, 0 to 7.
  struct Contacts {
    int normally_closed{}, normally_open{};
  };
  struct Config {
    std::optional<Contacts> estop = Contacts{0, 1};
    std::optional<Contacts> bumper;
    std::optional<int> reset_input = 2;
    // What the safety controller's outputs o0 and o1 say counts too, where there is one.
    bool safety_has_bumper = true;
  };

  PowerIo(const Config& config, hal::Clock& clock, Links links);

  // Does not wait. Fails with errc::not_connected when the battery was not heard for 5 s.
  hal::Task<hal::Result<hal::BatteryState>> battery() override;
  // Does not wait and does not fail. Without any e-stop in the configuration it is pressed for
  // ever; without any bumper it is released. reset_pressed holds for 500 ms after somebody pressed
  // the button for 0.1 to 3 s and let it go.
  hal::Task<hal::Result<hal::SafetyInputs>> inputs() override;
  // The same at once; nothing for a robot without safety inputs, and until all that it has were
  // heard for the first time. Does not allocate.
  std::optional<hal::SafetyInputs> inputs_now() const;
  // channel: 0 to 7; hold: 0.1 s to 3276.7 s, rounded up to tenths. Fails with
  // errc::argument_out_of_domain beyond these, errc::not_connected without a board that answers.
  hal::Task<hal::Result<void>> set_relay(int channel, bool on, hal::Duration hold) override;

  std::string_view model() const override { return "modbus-power"; }
  hal::Task<void> run() override;
  DeviceState state() const override;
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override;

  std::span<const Fault> faults() const;  // All of this driver's own.

 private:
  // One unit: when it was heard, and what the latest failure was.
  struct Peer {
    std::string_view name;
    hal::Registers* link{};
    hal::Duration silence_max{};
    hal::Time heard_at{}, failed_at{}, late_at{};  // Time 0: never.
    bool heard = false;
    boost::system::error_code failure;
    hal::Duration took{};
  };

  hal::Task<void> watch_battery();
  hal::Task<void> watch_board();
  hal::Task<void> watch_safety();
  hal::Task<bool> read_battery();
  hal::Task<bool> set_up_board();
  hal::Task<void> read_inputs();
  hal::Task<void> read_relays();
  void take_inputs(waveshare::Channels inputs, hal::Time now);
  template <class T>
  hal::Task<hal::Result<T>> ask(Peer& peer, hal::Task<hal::Result<T>> request, hal::Duration late);

  bool fresh(const Peer& peer, hal::Time now) const;
  hal::SafetyInputs read_inputs_at(hal::Time now) const;
  bool estop_pressed(hal::Time now) const;
  bool bumper_pressed(hal::Time now) const;
  void add_peer_troubles(std::vector<Trouble>& all, const Peer& peer, hal::Time now) const;
  void add_battery_troubles(std::vector<Trouble>& all, hal::Time now) const;
  void add_input_troubles(std::vector<Trouble>& all, hal::Time now) const;

  const Config config_;
  hal::Clock& clock_;
  Peer battery_peer_, board_peer_, safety_peer_;
  hal::Registers* gateway_;
  Identity identity_;
  bool started_ = false;
  hal::Time started_at_{};

  victron::Battery battery_;
  std::vector<victron::Alarm> alarms_;
  std::bitset<8> ranges_missing_;
  bool battery_disagrees_ = false;

  safety::ContactPair estop_, bumper_;
  safety::ResetButton reset_;
  hal::Time reset_at_{};
  bool inputs_taken_ = false, reset_stuck_ = false, board_ready_ = false, other_board_ = false,
       mode_refused_ = false;
  struct Relay {
    hal::Time set_at{}, off_at{};
    bool strays = false;  // Does not stand as it was set.
  };
  std::array<Relay, waveshare::kChannels> relays_;

  std::optional<safety::PilzStatus> safety_;
  std::vector<const Fault*> safety_faults_;
};

}  // namespace drivers
