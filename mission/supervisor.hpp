// Whether the robot may move, and who moves it: one ordered decision over a few condition bits. A
// stop stays until a person has released the robot. Pure.
#pragma once

#include <cstdint>
#include <string_view>

namespace mission {

// What is so now, a bit each. Whatever is not surely otherwise counts as set for the stops.
enum class Condition : std::uint16_t {
  estop = 1 << 0,         // Pressed, or not surely released.
  bumper = 1 << 1,        // The same.
  drive_silent = 1 << 2,  // It does not report.
  drive_held = 1 << 3,    // A remote control or a fault of its own has it.
  fault = 1 << 4,         // Another one whose action is Action::stop.
  operator_alive = 1 << 5,
  pose_uncertain = 1 << 6,
  range_stale = 1 << 7,
  hold_fault = 1 << 8,  // One whose action is Action::hold.
  battery_reserve = 1 << 9,
  mission_loaded = 1 << 10,
  // The drive was seen to stop by itself since the program started, and the e-stop loop reads.
  proven = 1 << 11,
};
inline constexpr int kConditions = 12;

class Conditions {
 public:
  constexpr Conditions() = default;
  constexpr explicit Conditions(unsigned bits) : bits_(static_cast<std::uint16_t>(bits)) {}
  constexpr bool has(Condition condition) const {
    return (bits_ & static_cast<std::uint16_t>(condition)) != 0;
  }
  constexpr void set(Condition condition, bool on = true) {
    const auto bit = static_cast<std::uint16_t>(condition);
    bits_ = static_cast<std::uint16_t>(on ? bits_ | bit : bits_ & ~bit);
  }
  constexpr std::uint16_t bits() const { return bits_; }
  bool operator==(const Conditions&) const = default;

 private:
  std::uint16_t bits_ = 0;
};

// Why the robot is stopped until a person releases it: the stops among the conditions by their own
// bits, and how the program came up.
namespace latch {
inline constexpr std::uint16_t kStops = 0x1F;  // estop to fault.
inline constexpr std::uint16_t kWatchdogRestart = 1 << 5, kCrash = 1 << 6, kPowerCut = 1 << 7;
}  // namespace latch

enum class Mode : std::uint8_t {
  idle,        // Nothing to do.
  autonomous,  // The mission drives.
  returning,   // The mission drives home.
  holding,     // Stands until a reason is over, or until it is released.
  teleop,      // The operator drives.
  stopped,     // Stands until its reasons are over and a person has released it.
};
std::string_view name(Mode mode);
constexpr bool moves(Mode mode) {
  return mode == Mode::autonomous || mode == Mode::returning || mode == Mode::teleop;
}

// How the program came up.
enum class Boot : std::uint8_t {
  clean,  // Started by a person, or by itself after a clean shutdown.
  watchdog_restart,
  crash,
  power_cut,
};

enum class Event : std::uint8_t {
  none,
  start,    // The program's own beginning: counts once, after a clean boot that saw no stop since.
  release,  // A person: reset input, key, console. Once for each time they ask.
  hold,     // A person wants it to stand until the next release.
};

struct SupervisorState {
  std::uint16_t latched = 0;  // See namespace latch.
  bool released = false;
  bool begun = false;  // Event::start was used up.
  bool operator==(const SupervisorState&) const = default;
};

SupervisorState booted(Boot how);

// What became of a release or start.
enum class Answer : std::uint8_t {
  none,        // Nobody asked.
  released,    // It may move.
  not_yet,     // A stop is still there.
  not_proven,  // Condition::proven is missing.
  not_enough,  // Only a person can release it now.
};
std::string_view name(Answer answer);

struct Decision {
  Mode mode = Mode::stopped;
  Answer answer = Answer::none;
};

// The mode for these conditions; `latched`: some stop was, and nobody has released since.
Mode decide(Conditions conditions, bool latched, bool released);

// One cycle. Stops latch before the event is looked at: a release in the same cycle is refused.
Decision supervise(SupervisorState& state, Conditions conditions, Event event);

}  // namespace mission
