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
    held,  // In order, but the robot had been stopped and nobody had released it since.
    ended  // In order: it gave the drive back.
  };
  State state = State::running;
  std::string boot_id;  // Of the machine's start, as the kernel gives it; no white space.
  bool operator==(const BootMark&) const = default;
};

// One line, with its end. mark_of() of anything else: nothing.
std::string text_of(const BootMark& mark);
std::optional<BootMark> mark_of(std::string_view text);

// What an operator has ordered of the program's next start.
enum class NextStart {
  as_usual,   // Goes on with a run that was left.
  anew,       // Begins a new run, whatever was left.
  from_start  // Goes on with a run that was left, by a robot that stands where that began.
};
// One line, with its end; next_start_of() of anything else: as_usual.
std::string text_of(NextStart next);
NextStart next_start_of(std::string_view text);

// How the program comes up. `stopped_with` is what the service manager said of the last run, its
// $SERVICE_RESULT and $EXIT_STATUS with a space between; empty when it did not come to that. Where
// nothing is known of the last run, a power cut may have taken it.
Boot boot_after(const std::optional<BootMark>& last, std::string_view boot_id,
                std::string_view stopped_with);

}  // namespace mission
