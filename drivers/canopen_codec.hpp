// CANopen (CiA 301): what a frame on a CANopen bus says, and the frames of a master and a drive.
// Everything is little-endian. Nodes are 1..127.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <variant>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/unread.hpp"
#include "hal/frames.hpp"

namespace drivers::canopen {

enum class NmtCommand : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  pre_operational = 0x80,
  reset_node = 0x81,
  reset_communication = 0x82,
};
enum class NodeState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F,
};

struct Nmt {
  NmtCommand command{};
  std::uint8_t node{};  // 0: all.
  bool operator==(const Nmt&) const = default;
};
struct Sync {
  std::optional<std::uint8_t> counter;
  bool operator==(const Sync&) const = default;
};
struct TimeStamp {
  std::uint32_t since_midnight_ms{};
  std::uint16_t day{};  // Since 1984-01-01.
  bool operator==(const TimeStamp&) const = default;
};
struct Emergency {
  std::uint8_t node{};
  std::uint16_t code{};           // 0: all errors are gone. See emergency_fault().
  std::uint8_t error_register{};  // Object 0x1001, see error_register_faults().
  std::array<std::uint8_t, 5> vendor{};
  bool operator==(const Emergency&) const = default;
};
struct Pdo {
  std::uint8_t node{};
  std::uint8_t number{};  // 1..4
  bool from_node{};       // A TPDO of the node; else an RPDO to it.
  bool asked{};           // A remote frame: asks for it, has no data.
  std::uint8_t size{};
  std::array<std::uint8_t, 8> data{};
  bool operator==(const Pdo&) const = default;
};
struct Heartbeat {
  std::uint8_t node{};
  NodeState state{};
  bool toggle{};  // Of node guarding.
  bool operator==(const Heartbeat&) const = default;
};
struct NodeGuardQuery {
  std::uint8_t node{};
  bool operator==(const NodeGuardQuery&) const = default;
};

// An SDO frame of either direction, one struct for all: which members count depends on `kind`.
enum class SdoKind : std::uint8_t {
  // To the node.
  read_request,
  read_segment_request,
  write_request,  // Whole in `data` when expedited, else `size` bytes will follow in segments.
  write_segment,
  // From the node.
  read_reply,  // As write_request.
  read_segment,
  write_reply,
  write_segment_reply,
  // Either way.
  abort,
};
struct Sdo {
  std::uint8_t node{};
  bool from_node{};
  SdoKind kind{};
  std::uint16_t index{};  // Not in segments.
  std::uint8_t sub{};
  bool expedited{};
  std::optional<std::uint32_t> size;  // As the frame says it; may be missing.
  bool toggle{}, last{};              // Segments only.
  std::uint8_t data_size{};           // Of `data`: up to 4 expedited, up to 7 in a segment.
  std::array<std::uint8_t, 7> data{};
  std::uint32_t abort_code{};  // See abort_fault().
  bool operator==(const Sdo&) const = default;
};

using Message =
    std::variant<Unread, Nmt, Sync, TimeStamp, Emergency, Pdo, Sdo, Heartbeat, NodeGuardQuery>;

// Unread for extended ids, ids without a service, wrong lengths and values that CiA 301 does not
// have. Allocates nothing.
Message decode(const hal::CanFrame& frame);
// Of any message but Unread; its numbers must be in range. Allocates nothing.
hal::CanFrame encode(const Message& message);

std::string_view name(NmtCommand command);
std::string_view name(NodeState state);
std::string_view name(SdoKind kind);

// What to tell a person about an SDO abort code. Codes that CiA 301 does not have get the name
// "unknown abort code".
Fault abort_fault(std::uint32_t code);
// About an EMCY (or 0x603F) error code: the exact code if known, else its class.
Fault emergency_fault(std::uint16_t code);
// The tables' own entries behind these two: their value is that of the class, not the code.
const Fault& abort_entry(std::uint32_t code);
const Fault& emergency_entry(std::uint16_t code);
// Of the bits of object 0x1001, all eight.
std::span<const Fault> error_register_faults();

}  // namespace drivers::canopen
