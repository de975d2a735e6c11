// CANopen's codes in words: SDO aborts, emergency codes, the error register.
#include <algorithm>

#include "drivers/canopen_codec.hpp"

namespace drivers::canopen {
namespace {

constexpr Fault kAborts[] = {
    {0x05030000, "toggle bit not alternated", "a segment was lost or doubled", "try again"},
    {0x05040000, "SDO timed out", "the other side was silent, or is still booting",
     "check power, node id and bit rate; try again"},
    {0x05040001, "unknown SDO command", "the node does not know this kind of transfer",
     "do not use block transfer with this node"},
    {0x05040005, "out of memory", "the node cannot hold the value", "send less at a time"},
    {0x06010000, "access not supported", "the object cannot be used in this way",
     "compare with the EDS"},
    {0x06010001, "object can only be written", "it was read", "do not read it back"},
    {0x06010002, "object can only be read", "it was written; fixed mappings answer so",
     "leave it as it is: poll by SDO where a mapping is fixed"},
    {0x06020000, "no such object", "the drive does not have it", "compare with the drive's EDS"},
    {0x06040041, "object cannot be mapped", "not allowed in this PDO",
     "map another object or poll it by SDO"},
    {0x06040042, "PDO too long", "more than 64 bits are mapped", "map fewer objects"},
    {0x06040043, "parameters do not fit together", "a value contradicts another",
     "check the settings against the manual"},
    {0x06040047, "node-internal incompatibility", "the device's own parts disagree",
     "restart the drive; check its firmware"},
    {0x06060000, "hardware fault", "the node could not do it because of a fault",
     "read the drive's error code"},
    {0x06070010, "wrong length", "the value has another size than the object",
     "use the data type of the EDS"},
    {0x06070012, "value too long", "the value has more bytes than the object",
     "use the data type of the EDS"},
    {0x06070013, "value too short", "the value has fewer bytes than the object",
     "use the data type of the EDS"},
    {0x06090011, "no such sub-index", "the object has fewer parts", "compare with the EDS"},
    {0x06090030, "value out of range", "the drive does not take it", "see the object's limits"},
    {0x06090031, "value too high", "above the object's limit", "write a smaller value"},
    {0x06090032, "value too low", "below the object's limit", "write a larger value"},
    {0x08000000, "general error", "the drive does not say more", "read the drive's error code"},
    {0x08000020, "cannot be stored", "saving or transferring failed", "try again when standing"},
    {0x08000021, "refused: local control", "another program or panel commands the drive",
     "release it there"},
    {0x08000022, "refused because of the device state",
     "for example mapping a PDO while operational", "go to pre-operational first"},
    {0x08000023, "no object dictionary", "it could not be loaded", "restart the drive"},
};

struct Class {
  std::uint16_t mask;
  Fault fault;
};

// The exact codes first, then ever wider classes.
constexpr Class kEmergencies[] = {
    {0xFFFF, {0x0000, "no error", "all errors are gone", "nothing to do"}},
    {0xFFFF, {0x2310, "current too high", "wheel blocked or overload", "free the wheel; reset"}},
    {0xFFFF, {0x2340, "short circuit", "motor cable or winding", "check the motor cable"}},
    {0xFFFF, {0x3110, "supply voltage too high", "wrong supply", "check the supply"}},
    {0xFFFF, {0x3120, "supply voltage too low", "battery low or bad contact", "charge; check"}},
    {0xFFFF,
     {0x3210, "DC link voltage too high", "braking with a full battery", "brake more gently"}},
    {0xFFFF, {0x3220, "DC link voltage too low", "battery low, or e-stop open", "charge; check"}},
    {0xFFFF, {0x4210, "device too hot", "overload or no air", "stop until it has cooled"}},
    {0xFFFF, {0x4310, "drive too hot", "overload or no air", "stop until it has cooled"}},
    {0xFFFF, {0x6100, "internal software error", "firmware", "restart the drive; update it"}},
    {0xFFFF, {0x6320, "parameter error", "a setting is not valid", "check the settings"}},
    {0xFFFF, {0x7121, "motor blocked", "wheel stuck or brake closed", "free the wheel"}},
    {0xFFFF, {0x7305, "incremental sensor 1 fault", "encoder cable", "check the encoder cable"}},
    {0xFFFF, {0x7306, "incremental sensor 2 fault", "encoder cable", "check the encoder cable"}},
    {0xFFFF, {0x8110, "CAN overrun", "more frames than the drive can take", "lower the load"}},
    {0xFFFF,
     {0x8120, "CAN error passive", "disturbed bus or missing termination",
      "check cable and the two 120 ohm terminations"}},
    {0xFFFF,
     {0x8130, "heartbeat lost", "the master was silent for too long",
      "check the CAN cable and that the program runs"}},
    {0xFFFF, {0x8140, "recovered from bus off", "disturbed bus", "check cable and termination"}},
    {0xFFFF, {0x8210, "PDO too short", "mapping of master and drive differ", "map anew"}},
    {0xFFFF, {0x8611, "following error", "the wheel cannot follow", "lower speed or load"}},
    {0xF000, {0x1000, "generic error", "the drive does not say more", "see the drive's manual"}},
    {0xF000, {0x2000, "current error", "overload or a motor fault", "check motor and cable"}},
    {0xF000, {0x3000, "voltage error", "supply out of range", "check battery and supply"}},
    {0xF000, {0x4000, "temperature error", "overload or no air", "stop until it has cooled"}},
    {0xF000, {0x5000, "hardware error", "the device itself", "restart it; if it stays, service"}},
    {0xF000, {0x6000, "software error", "firmware or parameters", "restart; check settings"}},
    {0xF000, {0x7000, "module error", "motor, brake or sensor", "check what is connected"}},
    {0xF000, {0x8000, "monitoring error", "bus or control loop", "check the CAN bus and load"}},
    {0xF000, {0x9000, "external error", "an input of the drive", "check what is connected"}},
    {0xFF00, {0xFF00, "device-specific error", "see the drive's manual", "see its manual"}},
    {0x0000, {0x0000, "unknown error", "a code that CiA 301 does not have", "see its manual"}},
};

constexpr Fault kErrorRegister[] = {
    {0x01, "generic", "any error sets it", "see the other bits and the error code"},
    {0x02, "current", "overload or a motor fault", "check motor and cable"},
    {0x04, "voltage", "supply out of range", "check battery and supply"},
    {0x08, "temperature", "overload or no air", "stop until it has cooled"},
    {0x10, "communication", "CAN disturbed or a master lost", "check the CAN bus"},
    {0x20, "device profile", "what CiA 402 watches", "read object 0x603F"},
    {0x40, "reserved", "CiA 301 reserves this bit", "see the drive's manual"},
    {0x80, "manufacturer", "what the maker watches", "see the drive's manual"},
};

constexpr Fault kUnknownAbort{0, "unknown abort code", "not in CiA 301: the maker's own",
                              "see the drive's manual"};

}  // namespace

const Fault& abort_entry(std::uint32_t code) {
  const Fault* found = fault_of(kAborts, code);
  return found != nullptr ? *found : kUnknownAbort;
}

const Fault& emergency_entry(std::uint16_t code) {
  return std::find_if(std::begin(kEmergencies), std::end(kEmergencies),
                      [&](const Class& known) { return (code & known.mask) == known.fault.value; })
      ->fault;
}

Fault abort_fault(std::uint32_t code) {
  Fault fault = abort_entry(code);
  fault.value = code;
  return fault;
}

Fault emergency_fault(std::uint16_t code) {
  Fault fault = emergency_entry(code);
  fault.value = code;
  return fault;
}

std::span<const Fault> error_register_faults() {
  return kErrorRegister;
}

}  // namespace drivers::canopen
