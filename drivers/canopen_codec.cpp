#include "drivers/canopen_codec.hpp"

#include <algorithm>
#include <cassert>

namespace drivers::canopen {
namespace {

using hal::CanFrame;

// The services by id without the node (CiA 301, predefined connection set).
enum Service : std::uint32_t {
  kNmt = 0x000,
  kSyncOrEmergency = 0x080,
  kTime = 0x100,
  kTpdo1 = 0x180,
  kRpdo1 = 0x200,
  kRpdo4 = 0x500,
  kSdoFromNode = 0x580,
  kSdoToNode = 0x600,
  kHeartbeat = 0x700,
};

std::uint8_t node_of(const CanFrame& frame) {
  return static_cast<std::uint8_t>(frame.id & 0x7F);
}

CanFrame frame_of(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  return frame;
}

Message decode_nmt(const CanFrame& frame) {
  if (node_of(frame) != 0) return Unread{"no such service"};
  if (frame.size != 2) return Unread{"length"};
  if (name(NmtCommand{frame.data[0]}).empty()) return Unread{"no such NMT command"};
  if (frame.data[1] > 127) return Unread{"no such node"};
  return Nmt{NmtCommand{frame.data[0]}, frame.data[1]};
}

Message decode_sync_or_emergency(const CanFrame& frame) {
  if (node_of(frame) == 0) {
    if (frame.size > 1) return Unread{"length"};
    return Sync{frame.size == 1 ? std::optional(frame.data[0]) : std::nullopt};
  }
  if (frame.size != 8) return Unread{"length"};
  Emergency emergency{node_of(frame), little<std::uint16_t>(frame.data, 0), frame.data[2], {}};
  std::copy_n(frame.data.begin() + 3, 5, emergency.vendor.begin());
  return emergency;
}

Message decode_time(const CanFrame& frame) {
  if (node_of(frame) != 0) return Unread{"no such service"};
  if (frame.size != 6) return Unread{"length"};
  return TimeStamp{little<std::uint32_t>(frame.data, 0) & 0x0FFFFFFF,
                   little<std::uint16_t>(frame.data, 4)};
}

Message decode_pdo(const CanFrame& frame) {
  if (node_of(frame) == 0) return Unread{"no such node"};
  if (frame.size > 8) return Unread{"length"};
  const std::uint32_t step = (frame.id & 0x780U) - kTpdo1;  // 0x80 apart, TPDO and RPDO in turn.
  Pdo pdo;
  pdo.node = node_of(frame);
  pdo.number = static_cast<std::uint8_t>(step / 0x100 + 1);
  pdo.from_node = step % 0x100 == 0;
  pdo.asked = frame.remote;
  pdo.size = frame.remote ? std::uint8_t{0} : frame.size;
  std::copy_n(frame.data.begin(), pdo.size, pdo.data.begin());
  return pdo;
}

Message decode_heartbeat(const CanFrame& frame) {
  if (node_of(frame) == 0) return Unread{"no such node"};
  if (frame.remote) return NodeGuardQuery{node_of(frame)};
  if (frame.size != 1) return Unread{"length"};
  const NodeState state{static_cast<std::uint8_t>(frame.data[0] & 0x7F)};
  if (name(state).empty()) return Unread{"no such node state"};
  return Heartbeat{node_of(frame), state, (frame.data[0] & 0x80) != 0};
}

// --- SDO. The command byte: bits 5-7 what, and below that n, e, s, t, c as CiA 301 names them.

enum Specifier : unsigned {
  kWriteSegment = 0,
  kWrite = 1,
  kRead = 2,
  kReadSegment = 3,
  kAbort = 4,
  kReadSegmentReply = 0,
  kWriteSegmentReply = 1,
  kReadReply = 2,
  kWriteReply = 3,
};

std::optional<SdoKind> kind_of(unsigned specifier, bool from_node) {
  if (specifier == kAbort) return SdoKind::abort;
  if (specifier > kAbort) return std::nullopt;  // Block transfer.
  static constexpr SdoKind kToNode[]{SdoKind::write_segment, SdoKind::write_request,
                                     SdoKind::read_request, SdoKind::read_segment_request};
  static constexpr SdoKind kFromNode[]{SdoKind::read_segment, SdoKind::write_segment_reply,
                                       SdoKind::read_reply, SdoKind::write_reply};
  return from_node ? kFromNode[specifier] : kToNode[specifier];
}

bool is_segment(SdoKind kind) {
  return kind == SdoKind::write_segment || kind == SdoKind::read_segment;
}
bool has_toggle(SdoKind kind) {
  return is_segment(kind) || kind == SdoKind::read_segment_request ||
         kind == SdoKind::write_segment_reply;
}
bool begins_data(SdoKind kind) {
  return kind == SdoKind::write_request || kind == SdoKind::read_reply;
}

void read_first_data(const CanFrame& frame, Sdo& sdo) {
  const unsigned command = frame.data[0];
  sdo.expedited = (command & 2) != 0;
  const bool sized = (command & 1) != 0;
  if (!sdo.expedited) {
    if (sized) sdo.size = little<std::uint32_t>(frame.data, 4);
    return;
  }
  sdo.data_size = static_cast<std::uint8_t>(sized ? 4 - (command >> 2 & 3) : 4);
  if (sized) sdo.size = sdo.data_size;
  std::copy_n(frame.data.begin() + 4, sdo.data_size, sdo.data.begin());
}

void read_segment_data(const CanFrame& frame, Sdo& sdo) {
  const unsigned command = frame.data[0];
  sdo.last = (command & 1) != 0;
  sdo.data_size = static_cast<std::uint8_t>(7 - (command >> 1 & 7));
  std::copy_n(frame.data.begin() + 1, sdo.data_size, sdo.data.begin());
}

Message decode_sdo(const CanFrame& frame) {
  if (node_of(frame) == 0) return Unread{"no such node"};
  const bool from_node = (frame.id & 0x780U) == kSdoFromNode;
  const auto kind = frame.size > 0 ? kind_of(frame.data[0] >> 5, from_node) : std::nullopt;
  // Some clients leave out the four unused bytes of a read request.
  const bool short_read = kind == SdoKind::read_request && frame.size >= 4;
  if (frame.size != 8 && !short_read) return Unread{"length"};
  if (!kind) return Unread{"SDO block transfer or unknown command"};
  Sdo sdo;
  sdo.node = node_of(frame);
  sdo.from_node = from_node;
  sdo.kind = *kind;
  if (has_toggle(sdo.kind)) {
    sdo.toggle = (frame.data[0] & 0x10) != 0;
  } else {
    sdo.index = little<std::uint16_t>(frame.data, 1);
    sdo.sub = frame.data[3];
  }
  if (begins_data(sdo.kind)) read_first_data(frame, sdo);
  if (is_segment(sdo.kind)) read_segment_data(frame, sdo);
  if (sdo.kind == SdoKind::abort) sdo.abort_code = little<std::uint32_t>(frame.data, 4);
  return sdo;
}

unsigned specifier_of(SdoKind kind) {
  switch (kind) {
    case SdoKind::write_segment:
    case SdoKind::read_segment:
      return 0;
    case SdoKind::write_request:
    case SdoKind::write_segment_reply:
      return 1;
    case SdoKind::read_request:
    case SdoKind::read_reply:
      return 2;
    case SdoKind::read_segment_request:
    case SdoKind::write_reply:
      return 3;
    case SdoKind::abort:
      break;
  }
  return kAbort;
}

void write_first_data(const Sdo& sdo, CanFrame& frame) {
  unsigned command = frame.data[0];
  if (sdo.expedited) {
    command |= 2;
    if (sdo.size) command |= 1 | (4U - sdo.data_size) << 2;
    std::copy_n(sdo.data.begin(), sdo.data_size, frame.data.begin() + 4);
  } else if (sdo.size) {
    command |= 1;
    put_little<std::uint32_t>(frame.data, 4, *sdo.size);
  }
  frame.data[0] = static_cast<std::uint8_t>(command);
}

struct Encoder {
  CanFrame operator()(const Unread&) const {
    assert(!"nothing to encode");
    return {};
  }
  CanFrame operator()(const Nmt& m) const {
    CanFrame frame = frame_of(kNmt, 2);
    frame.data[0] = static_cast<std::uint8_t>(m.command);
    frame.data[1] = m.node;
    return frame;
  }
  CanFrame operator()(const Sync& m) const {
    CanFrame frame = frame_of(kSyncOrEmergency, m.counter ? 1 : 0);
    frame.data[0] = m.counter.value_or(0);
    return frame;
  }
  CanFrame operator()(const TimeStamp& m) const {
    CanFrame frame = frame_of(kTime, 6);
    put_little<std::uint32_t>(frame.data, 0, m.since_midnight_ms);
    put_little<std::uint16_t>(frame.data, 4, m.day);
    return frame;
  }
  CanFrame operator()(const Emergency& m) const {
    CanFrame frame = frame_of(kSyncOrEmergency + m.node, 8);
    put_little<std::uint16_t>(frame.data, 0, m.code);
    frame.data[2] = m.error_register;
    std::copy(m.vendor.begin(), m.vendor.end(), frame.data.begin() + 3);
    return frame;
  }
  CanFrame operator()(const Pdo& m) const {
    assert(m.number >= 1 && m.number <= 4);
    const std::uint32_t base = (m.from_node ? kTpdo1 : kRpdo1) + (m.number - 1U) * 0x100;
    CanFrame frame = frame_of(base + m.node, m.size);
    frame.data = m.data;
    frame.remote = m.asked;
    return frame;
  }
  CanFrame operator()(const Heartbeat& m) const {
    CanFrame frame = frame_of(kHeartbeat + m.node, 1);
    frame.data[0] =
        static_cast<std::uint8_t>(static_cast<unsigned>(m.state) | (m.toggle ? 0x80U : 0U));
    return frame;
  }
  CanFrame operator()(const NodeGuardQuery& m) const {
    CanFrame frame = frame_of(kHeartbeat + m.node, 0);
    frame.remote = true;
    return frame;
  }
  CanFrame operator()(const Sdo& m) const {
    CanFrame frame = frame_of((m.from_node ? kSdoFromNode : kSdoToNode) + m.node, 8);
    unsigned command = specifier_of(m.kind) << 5;
    if (has_toggle(m.kind)) {
      command |= m.toggle ? 0x10U : 0U;
    } else {
      put_little<std::uint16_t>(frame.data, 1, m.index);
      frame.data[3] = m.sub;
    }
    if (is_segment(m.kind)) {
      command |= (7U - m.data_size) << 1 | (m.last ? 1U : 0U);
      std::copy_n(m.data.begin(), m.data_size, frame.data.begin() + 1);
    }
    frame.data[0] = static_cast<std::uint8_t>(command);
    if (begins_data(m.kind)) write_first_data(m, frame);
    if (m.kind == SdoKind::abort) put_little<std::uint32_t>(frame.data, 4, m.abort_code);
    return frame;
  }
};

}  // namespace

Message decode(const CanFrame& frame) {
  if (frame.extended) return Unread{"extended id"};
  const std::uint32_t service = frame.id & 0x780U;
  if (frame.id > 0x7FF) return Unread{"no such service"};
  if (service >= kTpdo1 && service <= kRpdo4) return decode_pdo(frame);
  if (service == kHeartbeat) return decode_heartbeat(frame);
  if (frame.remote) return Unread{"remote frame"};
  if (service == kNmt) return decode_nmt(frame);
  if (service == kSyncOrEmergency) return decode_sync_or_emergency(frame);
  if (service == kTime) return decode_time(frame);
  if (service == kSdoFromNode || service == kSdoToNode) return decode_sdo(frame);
  return Unread{"no such service"};
}

CanFrame encode(const Message& message) {
  return std::visit(Encoder{}, message);
}

std::string_view name(NmtCommand command) {
  switch (command) {
    case NmtCommand::start:
      return "start";
    case NmtCommand::stop:
      return "stop";
    case NmtCommand::pre_operational:
      return "pre-operational";
    case NmtCommand::reset_node:
      return "reset node";
    case NmtCommand::reset_communication:
      return "reset communication";
  }
  return {};
}

std::string_view name(NodeState state) {
  switch (state) {
    case NodeState::boot_up:
      return "boot-up";
    case NodeState::stopped:
      return "stopped";
    case NodeState::operational:
      return "operational";
    case NodeState::pre_operational:
      return "pre-operational";
  }
  return {};
}

std::string_view name(SdoKind kind) {
  switch (kind) {
    case SdoKind::read_request:
      return "read request";
    case SdoKind::read_segment_request:
      return "read segment request";
    case SdoKind::write_request:
      return "write request";
    case SdoKind::write_segment:
      return "write segment";
    case SdoKind::read_reply:
      return "read reply";
    case SdoKind::read_segment:
      return "read segment";
    case SdoKind::write_reply:
      return "write reply";
    case SdoKind::write_segment_reply:
      return "write segment reply";
    case SdoKind::abort:
      return "abort";
  }
  return {};
}

}  // namespace drivers::canopen
