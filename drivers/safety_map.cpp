#include "drivers/safety_map.hpp"

namespace drivers::safety {
namespace {

// Register 520, high byte.
constexpr std::uint16_t kRun = 0x1000;
constexpr Fault kLamps[] = {
    {0x0100, "safety output fault", "an output of the safety controller",
     "read its diagnosis; check what is wired to its outputs"},
    {0x0200, "safety input fault", "an input of the safety controller, or its two channels differ",
     "check e-stop buttons and bumper; press and release each"},
    {0x0400, "safety controller fault", "the controller itself",
     "restart it; if it stays, service"},
    {0x0800, "safety diagnosis", "there is a message in its list", "read its diagnosis"},
};
constexpr Fault kNotRunning{kRun, "safety controller does not run", "stopped or starting",
                            "start it; load its project"};

}  // namespace

std::optional<PilzStatus> pilz_status(const std::vector<bool>& bits) {
  if (bits.size() != kPilzStatus.count) return std::nullopt;
  return PilzStatus{bits[0], bits[1], bits[2]};
}

std::vector<const Fault*> pilz_faults(std::uint16_t leds) {
  std::vector<const Fault*> faults = faults_set(kLamps, leds);
  if ((leds & kRun) == 0) faults.push_back(&kNotRunning);
  return faults;
}

std::string_view name(Loop loop) {
  switch (loop) {
    case Loop::released:
      return "released";
    case Loop::pressed:
      return "pressed";
    case Loop::fault:
      return "fault";
  }
  return {};
}

void ContactPair::update(bool normally_closed, bool normally_open, hal::Time now) {
  heard_ = now;
  if (normally_closed == normally_open) {
    if (!contradicting_since_) contradicting_since_ = now;
    if (loop_ == Loop::released) loop_ = Loop::pressed;
    if (now - *contradicting_since_ > times_.discrepancy_max) loop_ = Loop::fault;
    return;
  }
  contradicting_since_.reset();
  const bool released = normally_closed;
  if (!released)
    loop_ = Loop::pressed;
  else if (loop_ != Loop::fault)
    loop_ = Loop::released;
}

Loop ContactPair::loop(hal::Time now) const {
  const bool silent = !heard_ || now - *heard_ > times_.silence_max;
  return silent && loop_ == Loop::released ? Loop::pressed : loop_;
}

bool ResetButton::update(bool pressed, hal::Time now) {
  if (pressed) {
    if (seen_released_ && !pressed_since_) pressed_since_ = now;
    return false;
  }
  const bool counts = pressed_since_ && now - *pressed_since_ >= times_.hold_min &&
                      now - *pressed_since_ <= times_.hold_max;
  seen_released_ = true;
  pressed_since_.reset();
  return counts;
}

bool ResetButton::stuck(hal::Time now) const {
  return pressed_since_ && now - *pressed_since_ > times_.hold_max;
}

}  // namespace drivers::safety
