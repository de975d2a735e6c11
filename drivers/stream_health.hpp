// How a device's stream of messages does: what every device that keeps sending has in common.
#pragma once

#include <cstdint>

#include "drivers/frame_reader.hpp"
#include "drivers/troubles.hpp"

namespace drivers {

namespace stream_fault {
inline constexpr Fault kGone{1, "link lost", "the port or the connection is gone",
                             "plug it in again; it is opened again by itself"};
inline constexpr Fault kSilent{2, "silent", "no power, a broken cable, or the wrong port",
                               "check power, cable and port"};
inline constexpr Fault kWrongBaud{3, "not understood", "another bit rate, or not this device",
                                  "set the bit rate of the robot file to the device's"};
inline constexpr Fault kOtherDevice{4, "another device", "another device is on this port",
                                    "correct the port or the model in the robot file"};
inline constexpr Fault kRefused{5, "setting refused", "the device does not take the setting",
                                "correct the setting in the robot file, or the firmware"};
inline constexpr Fault kNotKept{6, "setting not kept", "the device reads back something else",
                                "check the firmware, restart the device"};
inline constexpr Fault kDamaged{7, "damaged bytes", "interference, a long or loose cable",
                                "check cable and ground, lower the bit rate"};
inline constexpr Fault kRepeated{8, "messages repeated or out of order",
                                 "something between sends them twice",
                                 "take away converters and servers in between"};
inline constexpr Fault kLate{9, "messages late", "a converter or a busy port holds them back",
                             "set the port's latency timer to 1 ms, take converters away"};
inline constexpr Fault kSlow{10, "slower than set", "messages are lost, or another program sets it",
                             "lower the rate, raise the bit rate; one program only per device"};
inline constexpr Fault kFrozen{11, "frozen", "messages come, but their time stands still",
                               "restart the device"};
inline constexpr Fault kImplausible{12, "values impossible", "the sensor is damaged or saturated",
                                    "restart the device; if it stays, replace it"};
}  // namespace stream_fault

class StreamHealth {
 public:
  struct Limits {
    double period_s{};    // Between two messages, as set.
    double late_s = 0.1;  // Beyond the least latency of the last two minutes.
  };
  explicit StreamHealth(Limits limits) : limits_(limits) {}

  // Forgets what was before; its troubles are the caller's to clear.
  void restart(hal::Time now, const FrameReader& reader);

  void good(double late_s = 0);  // A message that is used.
  void repeated() { ++now_.repeated; }
  void implausible() { ++now_.implausible; }

  // Once a second at most it judges what came since and sets or clears the troubles.
  void judge(hal::Time now, const FrameReader& reader, Troubles& troubles);

 private:
  struct Counts {
    std::uint64_t good{}, repeated{}, implausible{}, bytes{}, damaged{};
    double latest_s{};
  };

  Limits limits_;
  hal::Time since_{};
  Counts now_;
};

}  // namespace drivers
