// How long the loop over two CiA 402 drives waits for what.
#pragma once

#include <cstddef>

#include "hal/values.hpp"

namespace drivers::cia402_times {

using namespace std::chrono_literals;

constexpr hal::Duration kCycle = 20ms;
constexpr hal::Duration kMasterHeartbeat = 100ms;
constexpr std::uint16_t kMasterHeartbeatMaxMs = 300, kHeartbeatMs = 100;
constexpr hal::Duration kHeartbeatMax = 350ms;
constexpr hal::Duration kReportsMax = 3 * kCycle;  // Then both sides stop.
constexpr hal::Duration kListening = 1s;           // Before silence at the start is trouble.
constexpr hal::Duration kRetry = 1s;               // After a dialogue that failed.
constexpr hal::Duration kAskPause = 1s;            // Between two looks at the error register.
constexpr hal::Duration kAnswerLate = 100ms;
constexpr hal::Duration kStartMax = 1s;
constexpr hal::Duration kModeMax = 500ms;   // Until a mode that was set is shown.
constexpr hal::Duration kEnablingMax = 2s;  // Brakes take their time.
constexpr hal::Duration kResetPause = 1s;   // After a fault.
constexpr hal::Duration kResetHold = 100ms;
constexpr int kResetsMax = 3;              // Until the drive restarts.
constexpr hal::Duration kWellAgain = 10s;  // Enabled for so long: resets are counted anew.
constexpr hal::Duration kStanding = 200ms;
constexpr hal::Duration kRemembered = 2s;  // Troubles that come and go are shown for so long.
constexpr int kStrangers = 3;              // So many strange frames are no accident.
constexpr std::size_t kRepliesMax = 8;

enum Which {
  kSilent,
  kNoAck,
  kBusDown,
  kStranger,
  kNotADrive,
  kWrongDrive,
  kNoMode,
  kNotInEds,
  kRefused,
  kNotKept,
  kNotOperational,
  kNotEnabled,
  kPersists,
  kReportsStale,
  kMissed,
  kDoubled,
  kUnread,
  kLate,
  kDeaf,
  kJumped,
  kDisagree,
  kWarning,
  kBlocked
};

}  // namespace drivers::cia402_times
