#include "drivers/modbus_line.hpp"

#include <modbus/modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <thread>

#include "drivers/modbus_errors.hpp"
#include "drivers/serial_port.hpp"

namespace drivers {
namespace {

namespace errc = boost::system::errc;
using boost::system::error_code;

constexpr hal::Duration kPauseFirst = std::chrono::milliseconds(100);
constexpr hal::Duration kPauseMax = std::chrono::seconds(5);

std::string name_of(const ModbusBus::Address& address, std::uint8_t unit) {
  return std::visit(
      [unit](auto where) {
        where.unit = unit;
        return to_text(LinkAddress(where));
      },
      address);
}

bool is_exception(int error) {
  return error > MODBUS_ENOBASE && error <= EMBXGTAR;
}
bool is_damage(int error) {
  return error >= EMBBADCRC && error <= EMBBADSLAVE;
}

error_code code_of(int error) {
  if (is_exception(error))
    return modbus::error_of(static_cast<std::uint8_t>(error - MODBUS_ENOBASE));
  if (is_damage(error)) return errc::make_error_code(errc::bad_message);
  if (error == ETIMEDOUT) return errc::make_error_code(errc::timed_out);
  if (error == EINVAL) return errc::make_error_code(errc::invalid_argument);
  return errc::make_error_code(errc::not_connected);
}

// Counts that the protocol cannot carry; a value is always right.
bool is_possible(const ModbusRequest& request) {
  using modbus::Function;
  const bool bits =
      request.function == Function::read_coils || request.function == Function::read_discrete;
  const bool words =
      request.function == Function::read_holding || request.function == Function::read_input;
  const int count = request.count_or_value;
  if (!bits && !words) return true;
  return count >= 1 && count <= (bits ? MODBUS_MAX_READ_BITS : MODBUS_MAX_READ_REGISTERS);
}

}  // namespace

void ModbusLine::Close::operator()(_modbus* context) {
  if (std::exchange(locked, false)) unlock_port(modbus_get_socket(context));
  modbus_close(context);
  modbus_free(context);
}

ModbusLine::ModbusLine(ModbusBus::Address address, const hal::Clock& clock,
                       ModbusBus::Config config)
    : address_(std::move(address)), clock_(clock), config_(config) {}
ModbusLine::~ModbusLine() = default;

ModbusOutcome ModbusLine::perform(const ModbusRequest& request) {
  if (!is_possible(request)) return failed(EINVAL, request);
  if (!context_) {
    if (const int error = connect(); error != 0) return failed(error, request);
  }
  if (std::holds_alternative<ModbusRtuAddress>(address_)) std::this_thread::sleep_for(config_.gap);
  ModbusOutcome outcome;
  const int error = exchange(request, outcome);
  if (error == 0) return outcome;
  if (is_exception(error)) return failed(error, request);
  // Over TCP a late reply would be taken for the next one's; a serial line only needs its rest
  // thrown away.
  const bool serial = std::holds_alternative<ModbusRtuAddress>(address_);
  if (serial && (error == ETIMEDOUT || is_damage(error)))
    modbus_flush(context_.get());
  else
    context_.reset();
  return failed(error, request);
}

int ModbusLine::connect() {
  if (clock_.now() < connect_again_) return connect_error_;
  connect_error_ = make_context();
  if (connect_error_ == 0 && modbus_connect(context_.get()) != 0)
    connect_error_ = errno != 0 ? errno : EIO;
  if (connect_error_ == 0) connect_error_ = prepare_port();
  if (connect_error_ == 0) {
    pause_ = {};
    return 0;
  }
  context_.reset();
  pause_ = std::clamp(2 * pause_, kPauseFirst, kPauseMax);
  connect_again_ = clock_.now() + pause_;
  return connect_error_;
}

int ModbusLine::make_context() {
  errno = 0;
  if (const auto* tcp = std::get_if<ModbusTcpAddress>(&address_)) {
    context_.reset(modbus_new_tcp_pi(tcp->host.c_str(), std::to_string(tcp->port).c_str()));
  } else {
    const SerialLine& line = std::get<ModbusRtuAddress>(address_).line;
    context_.reset(modbus_new_rtu(line.path.c_str(), static_cast<int>(line.baud), line.parity, 8,
                                  line.stop_bits));
  }
  if (!context_) return errno != 0 ? errno : ENOMEM;
  const auto timeout_us =
      std::chrono::duration_cast<std::chrono::microseconds>(config_.reply_timeout).count();
  modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(timeout_us / 1'000'000),
                              static_cast<std::uint32_t>(timeout_us % 1'000'000));
  return 0;
}

// The library knows few baud rates, takes 9600 for the others, and does not lock the port.
int ModbusLine::prepare_port() {
  const auto* rtu = std::get_if<ModbusRtuAddress>(&address_);
  if (rtu == nullptr) return 0;
  const int port = modbus_get_socket(context_.get());
  if (const error_code error = lock_port(port)) return error.value();
  context_.get_deleter().locked = true;
  return apply_settings(port, rtu->line).value();
}

int ModbusLine::exchange(const ModbusRequest& request, ModbusOutcome& outcome) {
  using modbus::Function;
  modbus_t* const context = context_.get();
  if (modbus_set_slave(context, request.unit) != 0) return EINVAL;
  const int at = request.at, count = request.count_or_value;
  std::array<std::uint8_t, MODBUS_MAX_READ_BITS> bits{};
  std::array<std::uint16_t, MODBUS_MAX_READ_REGISTERS> words{};
  errno = 0;
  int got = -1;
  switch (request.function) {
    case Function::read_coils:
      got = modbus_read_bits(context, at, count, bits.data());
      break;
    case Function::read_discrete:
      got = modbus_read_input_bits(context, at, count, bits.data());
      break;
    case Function::read_holding:
      got = modbus_read_registers(context, at, count, words.data());
      break;
    case Function::read_input:
      got = modbus_read_input_registers(context, at, count, words.data());
      break;
    case Function::write_register:
      got = modbus_write_register(context, at, request.count_or_value);
      break;
    case Function::write_coil:
      return write_any_coil(request);
    default:
      return EINVAL;
  }
  if (got < 0) return errno != 0 ? errno : EIO;
  if (request.function == Function::write_register) return 0;
  if (got != count) return EMBBADDATA;
  const bool reads_bits =
      request.function == Function::read_coils || request.function == Function::read_discrete;
  if (reads_bits)
    outcome.bits.assign(bits.begin(), bits.begin() + got);
  else
    outcome.words.assign(words.begin(), words.begin() + got);
  return 0;
}

// modbus_write_bit() knows on and off only.
int ModbusLine::write_any_coil(const ModbusRequest& request) {
  const auto high = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
  const auto low = [](std::uint16_t word) { return static_cast<std::uint8_t>(word); };
  const std::uint8_t raw[] = {request.unit,
                              static_cast<std::uint8_t>(request.function),
                              high(request.at),
                              low(request.at),
                              high(request.count_or_value),
                              low(request.count_or_value)};
  if (modbus_send_raw_request(context_.get(), raw, sizeof raw) < 0) return errno != 0 ? errno : EIO;
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> reply{};
  const int size = modbus_receive_confirmation(context_.get(), reply.data());
  if (size < 0) return errno != 0 ? errno : EIO;
  const auto head = static_cast<std::size_t>(modbus_get_header_length(context_.get()));
  if (static_cast<std::size_t>(size) < head + 2) return EMBBADDATA;
  // The header ends with the unit.
  if (reply[head - 1] != request.unit) return EMBBADSLAVE;
  if (reply[head] == (raw[1] | 0x80)) return MODBUS_ENOBASE + reply[head + 1];
  const bool same = static_cast<std::size_t>(size) >= head + 5 &&
                    std::equal(raw + 1, raw + 6, reply.begin() + static_cast<std::ptrdiff_t>(head));
  return same ? 0 : EMBBADDATA;
}

ModbusOutcome ModbusLine::failed(int error, const ModbusRequest& request) {
  ModbusOutcome outcome;
  outcome.error = code_of(error);
  const std::string name = name_of(address_, request.unit);
  const std::string asked = std::string(modbus::name(request.function)) + " at " +
                            std::to_string(request.at) + ": " + modbus_strerror(error);
  const auto* rtu = std::get_if<ModbusRtuAddress>(&address_);
  if (is_exception(error))
    outcome.trouble = trouble(
        error == EMBXGPATH || error == EMBXGTAR ? LinkFault::no_answer : LinkFault::refused_by_unit,
        name + ": " + asked);
  else if (is_damage(error))
    outcome.trouble = trouble(LinkFault::damaged, name + ": " + asked);
  else
    outcome.trouble = trouble_of({error, boost::system::system_category()}, name,
                                 rtu != nullptr ? rtu->line.path : "");
  return outcome;
}

}  // namespace drivers
