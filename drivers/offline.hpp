// Captures decoded with the shipped codecs, for people: every message with its values and units.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/resync.hpp"

namespace drivers {

struct Field {
  std::string name;  // As in the codec's struct, with its unit: "battery_v".
  std::variant<bool, std::int64_t, std::uint64_t, double, std::string, std::vector<double>> value;
};

struct Message {
  std::string name;           // "LMDscandata", "NAV-PVT", "motion feedback"
  std::optional<double> t_s;  // When the capture says that it was on the wire.
  bool from_device = true;    // Else sent to it.
  std::vector<Field> fields;
};

// What a capture holds: a run of stream bytes, a datagram, or a CAN frame as it stands in candump.
struct Captured {
  std::optional<double> t_s;
  bool from_device = true;
  ByteView bytes;          // Of a CAN frame: its data.
  std::uint32_t can_id{};  // CAN only.
  bool can_extended{}, can_remote{};
};

class OfflineDecoder {
 public:
  virtual ~OfflineDecoder() = default;
  // Decodes what comes next in the capture; calls out for every whole message. Never throws for
  // what the bytes say.
  virtual void feed(const Captured& captured, const std::function<void(Message)>& out) = 0;
  virtual SkippedBy skipped() const = 0;
};

}  // namespace drivers
