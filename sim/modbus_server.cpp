#include "sim/modbus_server.hpp"

#include <map>

#include "drivers/modbus_errors.hpp"
#include "drivers/modbus_frames.hpp"
#include "drivers/resync.hpp"
#include "sim/unit_faults.hpp"

namespace sim {
namespace {

namespace modbus = drivers::modbus;
using drivers::Bytes;
using drivers::ByteView;
using modbus::Function;
using modbus::Pdu;

struct Request {
  std::uint16_t transaction{};
  std::uint8_t unit{};
  Pdu pdu;
};

modbus::Exception refusal(Function function, boost::system::error_code error) {
  return {static_cast<std::uint8_t>(function), modbus::exception_of(error)};
}

template <class Values, class Reply>
Pdu reply_with(Function function, const hal::Result<Values>& values) {
  if (!values) return refusal(function, values.error());
  return Reply{function, *values};
}

Pdu answer_read(RegisterUnit& unit, const modbus::Read& request) {
  const hal::RegisterRange range{request.first, request.count};
  switch (request.function) {
    case Function::read_coils:
      return reply_with<std::vector<bool>, modbus::ReadBits>(request.function,
                                                             unit.read_coils(range));
    case Function::read_discrete:
      return reply_with<std::vector<bool>, modbus::ReadBits>(request.function,
                                                             unit.read_discrete(range));
    case Function::read_holding:
      return reply_with<std::vector<std::uint16_t>, modbus::ReadRegisters>(
          request.function, unit.read_holding(range));
    default:
      return reply_with<std::vector<std::uint16_t>, modbus::ReadRegisters>(request.function,
                                                                           unit.read_input(range));
  }
}

Pdu answer_write(RegisterUnit& unit, const modbus::WriteOne& request) {
  const auto done = request.function == Function::write_coil
                        ? unit.write_coil_raw(request.at, request.value)
                        : unit.write_register(request.at, request.value);
  if (!done) return refusal(request.function, done.error());
  return request;
}

// Several at once are written one after the other; the first that is refused ends it.
template <class Values, class Write>
Pdu answer_write_many(Function function, std::uint16_t first, const Values& values, Write write) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const auto done = write(static_cast<std::uint16_t>(first + i), values[i]); !done)
      return refusal(function, done.error());
  return modbus::Written{function, first, static_cast<std::uint16_t>(values.size())};
}

// Unread for what is no request.
Pdu answer(RegisterUnit& unit, const Pdu& request) {
  if (const auto* read = std::get_if<modbus::Read>(&request)) return answer_read(unit, *read);
  if (const auto* one = std::get_if<modbus::WriteOne>(&request)) return answer_write(unit, *one);
  if (const auto* bits = std::get_if<modbus::WriteBits>(&request))
    return answer_write_many(
        Function::write_coils, bits->first, bits->bits,
        [&](std::uint16_t at, bool on) { return unit.write_coil_raw(at, on ? 0xFF00 : 0); });
  if (const auto* words = std::get_if<modbus::WriteRegisters>(&request))
    return answer_write_many(
        Function::write_registers, words->first, words->values,
        [&](std::uint16_t at, std::uint16_t value) { return unit.write_register(at, value); });
  return drivers::Unread{"no request"};
}

Request decode(ModbusWire wire, ByteView frame) {
  if (wire == ModbusWire::rtu) {
    auto rtu = modbus::decode_rtu(frame, modbus::Side::request);
    return {0, rtu.unit, std::move(rtu.pdu)};
  }
  auto tcp = modbus::decode_tcp(frame, modbus::Side::request);
  return {tcp.transaction, tcp.unit, std::move(tcp.pdu)};
}

Bytes encode(ModbusWire wire, const Request& to, Pdu pdu) {
  if (wire == ModbusWire::rtu) return modbus::encode_rtu({to.unit, std::move(pdu)});
  return modbus::encode_tcp({to.transaction, to.unit, std::move(pdu)});
}

class Server {
 public:
  Server(hal::ByteStream& stream, ModbusWire wire, hal::Clock& clock, UnitOfNumber unit_of)
      : stream_(stream), wire_(wire), clock_(clock), unit_of_(std::move(unit_of)) {}

  hal::Task<void> serve() {
    Bytes buffer(1024);
    for (;;) {
      const auto size = co_await stream_.read_some(buffer);
      if (!size) {
        requests_ = drivers::Resync(modbus::kTcpMax);
        continue;
      }
      requests_.feed(ByteView(buffer).first(*size));
      while (const auto frame = requests_.next(look())) co_await reply(decode(wire_, *frame));
    }
  }

 private:
  drivers::Look (*look() const)(ByteView) {
    if (wire_ == ModbusWire::tcp) return modbus::look_tcp;
    return [](ByteView front) { return modbus::look_rtu(front, modbus::Side::request); };
  }

  hal::Task<void> reply(Request request) {
    RegisterUnit* const unit = unit_of_(request.unit);
    if (unit == nullptr) co_return;
    UnitFaults* const faults = unit->faults();
    if (faults != nullptr && faults->silent()) co_return;
    Pdu pdu = answer(*unit, request.pdu);
    if (std::holds_alternative<drivers::Unread>(pdu)) co_return;
    if (faults != nullptr) {
      pdu = as_stuck(*faults, request, std::move(pdu));
      co_await clock_.sleep_for(faults->slowed(kReplyTime) + faults->delay());
    } else {
      co_await clock_.sleep_for(kReplyTime);
    }
    Bytes bytes = encode(wire_, request, std::move(pdu));
    if (faults != nullptr && faults->is(UnitFault::garbage))
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(faults->dice().next());
    // A client that left does not matter: the next asks again.
    static_cast<void>(co_await stream_.write(bytes));
    if (faults != nullptr && faults->is(UnitFault::duplicated_reordered) &&
        faults->dice().hit(0.25))
      static_cast<void>(co_await stream_.write(bytes));
  }

  // The first reply to each request since the unit is stuck.
  Pdu as_stuck(const UnitFaults& faults, const Request& request, Pdu pdu) {
    if (faults.generation() != generation_) stuck_.clear();
    generation_ = faults.generation();
    if (!faults.is(UnitFault::stuck)) return pdu;
    Bytes key = modbus::encode_pdu(request.pdu);
    key.push_back(request.unit);
    return stuck_.try_emplace(std::move(key), std::move(pdu)).first->second;
  }

  static constexpr hal::Duration kReplyTime = std::chrono::milliseconds(1);

  hal::ByteStream& stream_;
  ModbusWire wire_;
  hal::Clock& clock_;
  UnitOfNumber unit_of_;
  drivers::Resync requests_{modbus::kTcpMax};
  std::map<Bytes, Pdu> stuck_;
  std::uint64_t generation_{};
};

}  // namespace

hal::Task<void> serve_modbus(hal::ByteStream& stream, ModbusWire wire, hal::Clock& clock,
                             UnitOfNumber unit_of) {
  Server server(stream, wire, clock, std::move(unit_of));
  co_await server.serve();
}

}  // namespace sim
