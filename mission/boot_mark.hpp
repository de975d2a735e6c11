// How the program's last run ended, as it left word in its state folder: whether the robot may
// start by itself, or a person must look at it first. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "mission/supervisor.hpp"

namespace mission {

// What a run leaves about itself: `running` while it lasts, so that whoever finds that afterwards
// knows that it did not end in order.
struct BootMark {
  enum class State {
    running,
    hung,  // A part of it did not go on; its watchdog was no longer fed.
    ended  // In order: it gave the drive back.
  };
  State state = State::running;
  std::string boot_id;  // Of the machine's start, as the kernel gives it; no white space.
  bool operator==(const BootMark&) const = default;
};

// One line, with its end. mark_of() of anything else: nothing.
std::string text_of(const BootMark& mark);
std::optional<BootMark> mark_of(std::string_view text);

// How the program comes up. `stopped_with` is what the service manager said of the last run, its
// $SERVICE_RESULT and $EXIT_STATUS with a space between; empty when it did not come to that. Where
// nothing is known of the last run, a power cut may have taken it.
Boot boot_after(const std::optional<BootMark>& last, std::string_view boot_id,
                std::string_view stopped_with);

}  // namespace mission
