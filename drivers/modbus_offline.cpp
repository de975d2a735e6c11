#include "drivers/can_offline.hpp"
#include "drivers/modbus_frames.hpp"
#include "drivers/offline_can.hpp"

namespace drivers {
namespace {

using namespace modbus;

// What was asked last: replies do not say.
using Asked = std::optional<Read>;

struct Describe {
  Fields& fields;
  const Asked& asked;

  std::string operator()(const Unread&) const { return {}; }
  std::string operator()(const Read& m) const {
    fields.add("first", m.first).add("count", m.count);
    return std::string(name(m.function));
  }
  std::string operator()(const ReadBits& m) const {
    const bool fits =
        asked && asked->function == m.function && (asked->count + 7U) / 8 * 8 == m.bits.size();
    if (fits) fields.add("first", asked->first);
    const std::size_t count = fits ? asked->count : m.bits.size();
    fields.add("bits", std::vector<bool>(m.bits.begin(),
                                         m.bits.begin() + static_cast<std::ptrdiff_t>(count)));
    return std::string(name(m.function));
  }
  std::string operator()(const ReadRegisters& m) const {
    if (asked && asked->function == m.function && asked->count == m.values.size())
      fields.add("first", asked->first);
    fields.add("values", m.values);
    return std::string(name(m.function));
  }
  std::string operator()(const WriteOne& m) const {
    fields.add("at", m.at).add("value", m.value);
    return std::string(name(m.function));
  }
  std::string operator()(const WriteBits& m) const {
    fields.add("first", m.first).add("bits", m.bits);
    return std::string(name(Function::write_coils));
  }
  std::string operator()(const WriteRegisters& m) const {
    fields.add("first", m.first).add("values", m.values);
    return std::string(name(Function::write_registers));
  }
  std::string operator()(const Written& m) const {
    fields.add("first", m.first).add("count", m.count);
    return std::string(name(m.function));
  }
  std::string operator()(const Exception& m) const {
    const Fault fault = exception_fault(m.code);
    const Fault* const one[]{&fault};
    fields.add("code", m.code).faults(one);
    return std::string(name(Function{m.function})) + ": exception";
  }
};

class Offline : public OfflineDecoder {
 public:
  void feed(const Captured& captured, const std::function<void(Message)>& out) override {
    const Side side = captured.from_device ? Side::reply : Side::request;
    if (kind_ != Kind::tcp) feed_rtu(captured, side, out);
    if (kind_ != Kind::rtu) feed_tcp(captured, side, out);
  }

  SkippedBy skipped() const override {
    SkippedBy all = (kind_ == Kind::tcp ? tcp_ : rtu_).skipped();
    add(all, skipped_);
    return all;
  }

 private:
  enum class Kind { unknown, rtu, tcp };

  void feed_rtu(const Captured& captured, Side side, const std::function<void(Message)>& out) {
    Resync& stream = rtu_.of(captured.from_device);
    stream.feed(captured.bytes);
    while (const auto view = stream.next([&](ByteView front) { return look_rtu(front, side); })) {
      kind_ = Kind::rtu;
      const RtuFrame frame = decode_rtu(*view, side);
      tell(captured, frame.unit, std::nullopt, frame.pdu, view->size(), out);
    }
  }

  void feed_tcp(const Captured& captured, Side side, const std::function<void(Message)>& out) {
    Resync& stream = tcp_.of(captured.from_device);
    stream.feed(captured.bytes);
    while (const auto view = stream.next(look_tcp)) {
      kind_ = Kind::tcp;
      const TcpFrame frame = decode_tcp(*view, side);
      tell(captured, frame.unit, frame.transaction, frame.pdu, view->size(), out);
    }
  }

  void tell(const Captured& captured, std::uint8_t unit, std::optional<std::uint16_t> transaction,
            const Pdu& pdu, std::size_t size, const std::function<void(Message)>& out) {
    if (const auto* unread = std::get_if<Unread>(&pdu)) return skip(skipped_, unread->why, size);
    if (const auto* read = std::get_if<Read>(&pdu)) asked_ = *read;
    Message message{"", captured.t_s, captured.from_device, {}};
    Fields fields(message);
    fields.add("unit", unit).maybe("transaction", transaction);
    message.name = std::visit(Describe{fields, asked_}, pdu);
    out(std::move(message));
  }

  Kind kind_ = Kind::unknown;
  TwoStreams rtu_{kRtuMax}, tcp_{kTcpMax};
  Asked asked_;
  SkippedBy skipped_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> modbus_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
