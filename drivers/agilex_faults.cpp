// Every fault bit of AgileX bases in words.
#include "drivers/agilex_codec.hpp"

namespace drivers::agilex {
namespace {

constexpr std::string_view kAskMaker =
    "note the bit and the firmware version and ask the maker; restart the base if it stays";
constexpr std::string_view kUndocumented = "not documented by the maker";
constexpr std::string_view kMotorLine = "motor driver without power, or its CAN line is loose";
constexpr std::string_view kMotorRemedy =
    "check plug and fuse of that motor's driver, then clear faults; if it stays, service";

constexpr Fault kSystem[] = {
    {0x0001, "battery too low: the base stops", "below its cut-off voltage (22 V)",
     "charge the battery now"},
    {0x0002, "battery low", "below the warning voltage (about 23 V)",
     "end the survey and drive back to charge"},
    {0x0004, "remote control lost", "transmitter off, far away or its battery empty",
     "switch the transmitter on, or bring it closer"},
    {0x0008, "no contact to motor 1", kMotorLine, kMotorRemedy},
    {0x0010, "no contact to motor 2", kMotorLine, kMotorRemedy},
    {0x0020, "no contact to motor 3", kMotorLine, kMotorRemedy},
    {0x0040, "no contact to motor 4", kMotorLine, kMotorRemedy},
    {0x0080, "reserved fault bit 7", kUndocumented, kAskMaker},
    {0x0100, "vendor bit 8", kUndocumented, kAskMaker},
    {0x0200, "vendor bit 9", kUndocumented, kAskMaker},
    {0x0400, "vendor bit 10", kUndocumented, kAskMaker},
    {0x0800, "vendor bit 11", kUndocumented, kAskMaker},
    {0x1000, "vendor bit 12", kUndocumented, kAskMaker},
    {0x2000, "vendor bit 13", kUndocumented, kAskMaker},
    {0x4000, "vendor bit 14", kUndocumented, kAskMaker},
    {0x8000, "vendor bit 15", "not documented; Bunker bases set it with the e-stop pressed",
     "release the e-stop; if it stays, note it and ask the maker"},
};

constexpr Fault kMotor[] = {
    {0x01, "motor driver supply low", "battery low or a bad contact",
     "charge the battery; check the driver's supply"},
    {0x02, "motor too hot", "long climb, overload or a dragging brake",
     "stop until it has cooled; lighten the load"},
    {0x04, "motor current too high", "wheel blocked or overload",
     "free the wheel, then clear faults"},
    {0x08, "motor driver too hot", "long overload or no air", "stop until it has cooled"},
    {0x10, "motor driver lost CAN", kMotorLine, kMotorRemedy},
    {0x20, "reserved motor bit 5", kUndocumented, kAskMaker},
    {0x40, "reserved motor bit 6", "not documented; Hunter bases set it at rest", kAskMaker},
    {0x80, "reserved motor bit 7", kUndocumented, kAskMaker},
};

constexpr Fault kVersion1[] = {
    {0x0001, "battery too low: the base stops", "below its cut-off voltage",
     "charge the battery now"},
    {0x0002, "battery voltage too high", "wrong charger, or braking with a full battery",
     "unplug the charger; check its voltage"},
    {0x0004, "no contact to motor 1", kMotorLine, kMotorRemedy},
    {0x0008, "no contact to motor 2", kMotorLine, kMotorRemedy},
    {0x0010, "no contact to motor 3", kMotorLine, kMotorRemedy},
    {0x0020, "no contact to motor 4", kMotorLine, kMotorRemedy},
    {0x0040, "motor driver too hot: the base stops", "long overload or no air",
     "stop until it has cooled, then clear faults"},
    {0x0080, "motor current too high: the base stops", "wheel blocked or overload",
     "free the wheel, then clear faults"},
    {0x0100, "command with a wrong checksum", "disturbed bus or a wrong sender",
     "check cable, termination and who else sends on the bus"},
    {0x0200, "motor driver hot", "long overload or no air", "slow down"},
    {0x0400, "motor current high", "steep ground or overload", "slow down"},
    {0x0800, "battery low", "below the warning voltage", "end the survey and drive back"},
    {0x1000, "remote control lost", "transmitter off, far away or its battery empty",
     "switch the transmitter on, or bring it closer"},
    {0x2000, "reserved bit 13", kUndocumented, kAskMaker},
    {0x4000, "reserved bit 14", kUndocumented, kAskMaker},
    {0x8000, "reserved bit 15", kUndocumented, kAskMaker},
};

}  // namespace

std::span<const Fault> system_faults() {
  return kSystem;
}
std::span<const Fault> motor_faults() {
  return kMotor;
}
std::span<const Fault> v1_faults() {
  return kVersion1;
}

}  // namespace drivers::agilex
