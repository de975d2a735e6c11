#include "drivers/can_offline.hpp"
#include "drivers/cia402.hpp"
#include "drivers/offline_can.hpp"

namespace drivers {
namespace {

using namespace canopen;

struct Named {
  Address at;
  std::string_view name;
};
constexpr Named kObjects[] = {
    {{0x1000, 0}, "device type"},
    {{0x1001, 0}, "error register"},
    {{0x1003, 0}, "errors kept"},
    {{0x1010, 1}, "store parameters"},
    {{0x1016, 1}, "longest silence of the master"},
    {{0x1017, 0}, "heartbeat period"},
    {{0x1018, 1}, "vendor id"},
    {{0x1018, 2}, "product code"},
    {{0x1018, 3}, "revision"},
    {{0x1018, 4}, "serial number"},
    {cia402::kAbortConnection, "reaction to a silent master"},
    {cia402::kErrorCode, "error code"},
    {cia402::kControlword, "controlword"},
    {cia402::kStatusword, "statusword"},
    {cia402::kVlTarget, "velocity target"},
    {cia402::kVlDemand, "velocity demand"},
    {cia402::kVlActual, "velocity actual"},
    {cia402::kQuickStopOption, "quick-stop option"},
    {cia402::kModes, "mode of operation"},
    {cia402::kModesDisplay, "mode of operation displayed"},
    {cia402::kPosition, "position"},
    {cia402::kVelocityActual, "velocity actual"},
    {{0x6072, 0}, "torque limit"},
    {cia402::kTorqueActual, "torque"},
    {cia402::kDcLinkMv, "DC link voltage in mV"},
    {cia402::kMotorSpeedMax, "motor speed limit"},
    {cia402::kAcceleration, "acceleration"},
    {cia402::kDeceleration, "deceleration"},
    {cia402::kQuickStopDeceleration, "quick-stop deceleration"},
    {cia402::kVelocityTarget, "velocity target"},
    {cia402::kSupportedModes, "supported modes"},
};

std::string hex_number(std::uint32_t value, int digits) {
  std::string text = "0x";
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4)
    text += "0123456789ABCDEF"[value >> shift & 15];
  return text;
}

void add_fault(Fields& fields, const Fault& fault) {
  const Fault* const one[]{&fault};
  fields.faults(one);
}

void add_value(Fields& fields, const Sdo& sdo) {
  std::uint32_t value = 0;
  for (int i = sdo.data_size - 1; i >= 0; --i)
    value = value << 8 | sdo.data[static_cast<std::size_t>(i)];
  fields.add("value", value).add("bytes", sdo.data_size);
  if (Address{sdo.index, sdo.sub} != cia402::kStatusword || sdo.data_size < 2) return;
  const auto state = cia402::state_of(static_cast<std::uint16_t>(value));
  fields.add("state", state ? cia402::name(*state) : "none that CiA 402 has");
}

// Fills a message with the values of one struct. Returns its name and whether the node sent it.
struct Describe {
  Fields& fields;
  using Head = std::pair<std::string, bool>;

  Head operator()(const Unread&) const { return {}; }
  Head operator()(const Nmt& m) const {
    fields.add("command", name(m.command)).add("node", m.node);
    return {"NMT", false};
  }
  Head operator()(const Sync& m) const {
    fields.maybe("counter", m.counter);
    return {"SYNC", false};
  }
  Head operator()(const TimeStamp& m) const {
    fields.add("since_midnight_ms", m.since_midnight_ms).add("day", m.day);
    return {"TIME", false};
  }
  Head operator()(const Emergency& m) const {
    fields.add("node", m.node).add("code", hex_number(m.code, 4));
    fields.add("error_register", m.error_register).add("vendor", hex_text(m.vendor));
    add_fault(fields, emergency_fault(m.code));
    return {"EMCY", true};
  }
  Head operator()(const Pdo& m) const {
    fields.add("node", m.node).add("data", hex_text(ByteView(m.data).first(m.size)));
    if (m.asked) fields.add("asked", true);
    return {(m.from_node ? "TPDO" : "RPDO") + std::to_string(m.number), m.from_node && !m.asked};
  }
  Head operator()(const Heartbeat& m) const {
    fields.add("node", m.node).add("state", name(m.state)).add("toggle", m.toggle);
    return {"heartbeat", true};
  }
  Head operator()(const NodeGuardQuery& m) const {
    fields.add("node", m.node);
    return {"node guard query", false};
  }
  Head operator()(const Sdo& m) const {
    fields.add("node", m.node);
    const bool segment = m.kind == SdoKind::read_segment || m.kind == SdoKind::write_segment;
    if (segment) {
      fields.add("data", hex_text(ByteView(m.data).first(m.data_size))).add("last", m.last);
    } else if (m.kind != SdoKind::read_segment_request && m.kind != SdoKind::write_segment_reply) {
      fields.add("object", hex_number(m.index, 4) + ":" + std::to_string(m.sub));
      for (const Named& known : kObjects)
        if (known.at == Address{m.index, m.sub}) fields.add("object_name", known.name);
    }
    if (m.expedited)
      add_value(fields, m);
    else
      fields.maybe("size", m.size);
    if (m.kind == SdoKind::abort) {
      fields.add("abort_code", hex_number(m.abort_code, 8));
      add_fault(fields, abort_fault(m.abort_code));
    }
    return {"SDO " + std::string(name(m.kind)), m.from_node};
  }
};

class Offline : public OfflineDecoder {
 public:
  void feed(const Captured& captured, const std::function<void(drivers::Message)>& out) override {
    const auto frame = can_frame(captured);
    if (!frame) return skip(skipped_, "length", captured.bytes.size());
    const canopen::Message read = decode(*frame);
    if (const auto* unread = std::get_if<Unread>(&read))
      return skip(skipped_, unread->why, captured.bytes.size());
    drivers::Message message{"", captured.t_s, true, {}};
    Fields fields(message);
    std::tie(message.name, message.from_device) = std::visit(Describe{fields}, read);
    out(std::move(message));
  }
  SkippedBy skipped() const override { return skipped_; }

 private:
  SkippedBy skipped_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> canopen_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
