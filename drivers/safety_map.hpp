// The e-stop as the program sees it: hardware stops the robot, this only reads along. Pure.
//
// Two wirings: a Pilz PNOZmulti 2 by Modbus TCP, or any safety relay whose auxiliary contacts hang
// on two inputs of a relay board (one normally closed, one normally open).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/fault.hpp"
#include "hal/frames.hpp"
#include "hal/values.hpp"

namespace drivers::safety {

// --- Pilz. Outputs o0, o1, o2 and inputs i0, i1 have to be configured so in the device.

constexpr hal::RegisterRange kPilzStatus{8192, 3};  // Discrete inputs o0..o2.
constexpr hal::RegisterRange kPilzLeds{520, 1};     // Input register.
constexpr std::uint16_t kSoftStopCoil = 0;          // Virtual input i0: false stops.
constexpr std::uint16_t kResetCoil = 1;             // Virtual input i1: a pulse resets.

struct PilzStatus {
  bool estop_released{};
  bool bumper_ok{};
  bool drive_enabled{};
  bool operator==(const PilzStatus&) const = default;
};
// Nothing for a reply of another length.
std::optional<PilzStatus> pilz_status(const std::vector<bool>& bits);
// Of register 520: what its lamps say is wrong. RUN that is off is one of them.
std::vector<const Fault*> pilz_faults(std::uint16_t leds);

// --- Two contacts on inputs.

enum class Loop : std::uint8_t {
  released,
  pressed,
  fault,  // The contacts contradict each other for longer than they may: a wire is broken.
};
std::string_view name(Loop loop);

// Whatever is not surely released counts as pressed.
class ContactPair {
 public:
  // Contacts do not switch at the same instant. Silence of the board counts as pressed.
  struct Times {
    hal::Duration discrepancy_max = std::chrono::milliseconds(500);
    hal::Duration silence_max = std::chrono::milliseconds(200);
  };
  ContactPair() = default;
  explicit ContactPair(Times times) : times_(times) {}

  // closed: of the normally closed contact (closed while released); open: of the normally open one.
  // A fault stays until both contacts have said "pressed" once: then they are known to work again.
  void update(bool normally_closed, bool normally_open, hal::Time now);
  Loop loop(hal::Time now) const;

 private:
  Times times_;
  Loop loop_ = Loop::pressed;
  std::optional<hal::Time> heard_;
  std::optional<hal::Time> contradicting_since_;
};

// The reset input: pressed, held for a while and let go again, not stuck.
class ResetButton {
 public:
  struct Times {
    hal::Duration hold_min = std::chrono::milliseconds(100);
    hal::Duration hold_max = std::chrono::seconds(3);
  };
  ResetButton() = default;
  explicit ResetButton(Times times) : times_(times) {}

  // True once, when it is let go after having been held for long enough and not too long. A button
  // that is pressed when first seen does not count.
  bool update(bool pressed, hal::Time now);
  bool stuck(hal::Time now) const;

 private:
  Times times_;
  bool seen_released_ = false;
  std::optional<hal::Time> pressed_since_;
};

}  // namespace drivers::safety
