// How long the loop over two CiA 402 drives waits for what.
#pragma once

#include <cstddef>

#include "hal/values.hpp"

namespace drivers::cia402_times {

constexpr hal::Duration kCycle = std::chrono::milliseconds(20);
constexpr hal::Duration kMasterHeartbeat = std::chrono::milliseconds(100);
constexpr std::uint16_t kMasterHeartbeatMaxMs = 300, kHeartbeatMs = 100;
constexpr hal::Duration kHeartbeatMax = std::chrono::milliseconds(350);
constexpr hal::Duration kReportsMax = 3 * kCycle;  // Then both sides stop.
constexpr hal::Duration kListening =
    std::chrono::seconds(1);  // Before silence at the start is trouble.
constexpr hal::Duration kRetry = std::chrono::seconds(1);  // After a dialogue that failed.
constexpr hal::Duration kAskPause =
    std::chrono::seconds(1);  // Between two looks at the error register.
constexpr hal::Duration kAnswerLate = std::chrono::milliseconds(100);
constexpr hal::Duration kStartMax = std::chrono::seconds(1);
constexpr hal::Duration kModeMax =
    std::chrono::milliseconds(500);  // Until a mode that was set is shown.
constexpr hal::Duration kEnablingMax = std::chrono::seconds(2);  // Brakes take their time.
constexpr hal::Duration kResetPause = std::chrono::seconds(1);   // After a fault.
constexpr hal::Duration kResetHold = std::chrono::milliseconds(100);
constexpr int kResetsMax = 3;  // Until the drive restarts.
constexpr hal::Duration kWellAgain =
    std::chrono::seconds(10);  // Enabled for so long: resets are counted anew.
// The proof of the drives' own time-out: our heartbeat's limit, a report, and some cycles; and
// until both are enabled again.
constexpr hal::Duration kProofMax = std::chrono::milliseconds(500),
                        kProofUpMax = std::chrono::seconds(10);
constexpr hal::Duration kStanding = std::chrono::milliseconds(200);
constexpr hal::Duration kRemembered =
    std::chrono::seconds(2);   // Troubles that come and go are shown for so long.
constexpr int kStrangers = 3;  // So many strange frames are no accident.
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
  kBlocked,
  kFixedMapping
};

}  // namespace drivers::cia402_times
