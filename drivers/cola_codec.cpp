#include "drivers/cola_codec.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr std::uint8_t kStx = 0x02, kEtx = 0x03;
constexpr std::size_t kHeader = 8;  // CoLa B: four STX and the length.

std::uint8_t exclusive_or(ByteView bytes) {
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : bytes) sum ^= byte;
  return sum;
}

Look look_binary(ByteView front) {
  for (std::size_t i = 0; i < 4 && i < front.size(); ++i)
    if (front[i] != kStx) return Look::none("no start", i - 1);  // An ascii one may start there.
  if (front.size() < kHeader) return Look::more();
  const std::size_t length = big<std::uint32_t>(front, 4);
  if (length < 3 || length > kColaFrameMax - kHeader - 1) return Look::none("length");
  if (front.size() > kHeader && front[kHeader] != 's') return Look::none("no command");
  if (front.size() < kHeader + length + 1) return Look::more();
  const ByteView payload = front.subspan(kHeader, length);
  if (exclusive_or(payload) != front[kHeader + length]) return Look::none("checksum");
  return Look::frame(kHeader + length + 1);
}

Look look_ascii(ByteView front) {
  if (front[1] != 's') return Look::none("no command");
  const auto end = std::find_if(front.begin() + 1, front.end(), [](std::uint8_t byte) {
    return byte == kEtx || byte == kStx || byte > 0x7E || (byte < 0x20 && byte != '\t');
  });
  const auto size = static_cast<std::size_t>(end - front.begin());
  if (end == front.end()) return size < kColaFrameMax ? Look::more() : Look::none("length", size);
  if (*end != kEtx) return Look::none(*end == kStx ? "cut" : "not text", size);
  return size < 4 ? Look::none("no command", size + 1) : Look::frame(size + 1);
}

void append_text(Bytes& bytes, std::string_view text) {
  bytes.insert(bytes.end(), text.begin(), text.end());
}

// Upper-case hex, at least `digits_min` digits.
void append_hex(Bytes& bytes, std::uint32_t value, int digits_min) {
  char text[8];
  const auto end = std::to_chars(text, text + sizeof text, value, 16).ptr;
  for (auto digits = end - text; digits < digits_min; ++digits) bytes.push_back('0');
  for (const char* at = text; at != end; ++at)
    bytes.push_back(static_cast<std::uint8_t>(*at >= 'a' ? *at - 'a' + 'A' : *at));
}

void append_ascii(Bytes& bytes, const ColaValue& value) {
  using As = ColaValue::As;
  const auto bits = static_cast<std::uint32_t>(value.value);
  bytes.push_back(' ');
  if (value.as == As::i16 || value.as == As::i32) {
    if (value.value >= 0) bytes.push_back('+');
    append_text(bytes, std::to_string(value.value));
  } else {
    append_hex(bytes, bits, value.as == As::hex2 ? 2 : value.as == As::hex32 ? 8 : 1);
  }
}

void append_binary(Bytes& bytes, const ColaValue& value) {
  using As = ColaValue::As;
  if (value.as == As::hex2 || value.as == As::u8)
    append_big<std::uint8_t>(bytes, static_cast<std::uint8_t>(value.value));
  else if (value.as == As::u16 || value.as == As::i16)
    append_big<std::uint16_t>(bytes, static_cast<std::uint16_t>(value.value));
  else
    append_big<std::uint32_t>(bytes, static_cast<std::uint32_t>(value.value));
}

constexpr Fault kErrors[] = {
    {0x01, "access denied", "not logged in for this", "log in with SetAccessMode 3 first"},
    {0x02, "unknown method", "the firmware has no such method", "use this model's method"},
    {0x03, "unknown variable", "the firmware has no such variable", "use this model's variable"},
    {0x04, "local condition failed", "not allowed in this state", "stop measuring, then try again"},
    {0x05, "invalid data", "a value is not allowed", "correct the setting"},
    {0x06, "unknown error", "the device does not say", "try again, then restart the device"},
    {0x07, "buffer overflow", "the telegram is too long", "send fewer values"},
    {0x08, "buffer underflow", "a value is missing", "send all values of the telegram"},
    {0x09, "unknown type", "the firmware does not know a value's type", "check the firmware"},
    {0x0A, "write access denied", "the variable is read-only at this level", "log in higher"},
    {0x0B, "unknown command for the name server", "bad command", "use CoLa's commands"},
    {0x0C, "unknown command", "bad command letters", "check the dialect, CoLa A or B"},
    {0x0D, "method busy", "the same method still runs", "wait for its answer"},
    {0x0E, "flexible array out of bounds", "a list is too long", "send a shorter list"},
    {0x0F, "unknown event", "the firmware has no such event", "use this model's event"},
    {0x10, "value overflow in CoLa A", "a number has too many digits", "send a smaller number"},
    {0x11, "invalid character in CoLa A", "a number cannot be read", "check the dialect"},
    {0x12, "no message", "internal to the device", "restart the device"},
    {0x13, "no answer message", "internal to the device", "restart the device"},
    {0x14, "internal error", "internal to the device", "restart the device"},
    {0x15, "hub address corrupted", "the telegram was routed wrongly", "connect directly"},
    {0x16, "hub address decoding", "the telegram was routed wrongly", "connect directly"},
    {0x17, "hub address too long", "the telegram was routed wrongly", "connect directly"},
    {0x18, "hub address expected", "the telegram was routed wrongly", "connect directly"},
    {0x19, "asynchronous methods suppressed", "asynchronous calls are off", "call it directly"},
    {0x20, "complex arrays unsupported", "the device cannot read the array", "send plain values"},
};

}  // namespace

Look look_cola(ByteView front) {
  if (front[0] != kStx) {
    const auto next = std::find(front.begin(), front.end(), kStx);
    return Look::none("no start", static_cast<std::size_t>(next - front.begin()));
  }
  if (front.size() < 2) return Look::more();
  return front[1] == kStx ? look_binary(front) : look_ascii(front);
}

std::string_view ColaMessage::text() const {
  return as_text(body);
}

std::optional<ColaMessage> parse_cola(ByteView frame) {
  if (frame.size() < 5) return std::nullopt;
  ColaMessage message;
  message.dialect = frame[1] == kStx ? ColaDialect::binary : ColaDialect::ascii;
  if (message.dialect == ColaDialect::binary && frame.size() < kHeader + 4) return std::nullopt;
  const ByteView payload = message.dialect == ColaDialect::binary
                               ? frame.subspan(kHeader, frame.size() - kHeader - 1)
                               : frame.subspan(1, frame.size() - 2);
  const std::string_view text = as_text(payload);
  if (text.size() < 3 || text[0] != 's') return std::nullopt;
  message.command = text.substr(0, 3);
  std::size_t at = 3;
  if (message.command != "sFA") {
    if (text.size() < 5 || text[3] != ' ') return std::nullopt;
    const auto end = std::min(text.find(' ', 4), text.size());
    message.name = text.substr(4, end - 4);
    if (message.name.empty()) return std::nullopt;
    at = end;
  }
  // A binary sFA may hold its code without a blank, and the code may look like one.
  if (at < text.size() && text[at] == ' ' && (at + 1 < text.size() || !message.name.empty())) ++at;
  message.body = payload.subspan(at);
  return message;
}

Bytes frame_cola(ColaDialect dialect, ByteView payload) {
  Bytes bytes;
  bytes.reserve(kHeader + payload.size() + 1);
  if (dialect == ColaDialect::ascii) {
    bytes.push_back(kStx);
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    bytes.push_back(kEtx);
    return bytes;
  }
  bytes.assign(4, kStx);
  append_big<std::uint32_t>(bytes, static_cast<std::uint32_t>(payload.size()));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  bytes.push_back(exclusive_or(payload));
  return bytes;
}

Bytes encode_cola(ColaDialect dialect, std::string_view command, std::string_view name,
                  std::span<const ColaValue> values) {
  Bytes payload;
  append_text(payload, command);
  payload.push_back(' ');
  append_text(payload, name);
  if (dialect == ColaDialect::binary && !values.empty()) payload.push_back(' ');
  for (const ColaValue& value : values)
    dialect == ColaDialect::ascii ? append_ascii(payload, value) : append_binary(payload, value);
  return frame_cola(dialect, payload);
}

std::optional<std::uint16_t> cola_error(const ColaMessage& message) {
  if (message.command != "sFA") return std::nullopt;
  if (message.dialect == ColaDialect::ascii)
    return whole_number<std::uint16_t>(message.text(), 16).value_or(0);
  if (message.body.size() == 1) return message.body[0];
  return message.body.size() == 2 ? big<std::uint16_t>(message.body, 0) : std::uint16_t{0};
}

std::span<const Fault> cola_errors() {
  return kErrors;
}

std::uint32_t ColaReader::token(std::size_t width) {
  std::string_view rest = as_text(rest_);
  const std::string_view word = take_field(rest, ' ');
  rest_ = as_bytes(rest);
  const std::int64_t limit = std::int64_t{1} << (8 * width);
  const bool decimal = !word.empty() && (word[0] == '+' || word[0] == '-');
  const auto value =
      decimal ? whole_number<std::int64_t>(word) : whole_number<std::int64_t>(word, 16);
  if (!value || *value >= limit || *value < -(limit / 2)) return fail(), 0U;
  return static_cast<std::uint32_t>(*value);
}

std::string_view ColaReader::characters(std::size_t count) {
  if (rest_.size() < count) return fail(), std::string_view{};
  const std::string_view text = as_text(rest_.first(count));
  rest_ = rest_.subspan(count);
  if (ascii_ && !rest_.empty()) {  // The blank after the text.
    if (rest_[0] != ' ') return fail(), std::string_view{};
    rest_ = rest_.subspan(1);
  }
  return text;
}

void ColaReader::u16s(std::span<std::uint16_t> into) {
  if (ascii_) {
    for (auto& value : into) value = u16();
    return;
  }
  if (rest_.size() < 2 * into.size()) return fail();
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = big<std::uint16_t>(rest_, 2 * i);
  rest_ = rest_.subspan(2 * into.size());
}

void ColaReader::u8s(std::span<std::uint16_t> into) {
  if (ascii_) {
    for (auto& value : into) value = u8();
    return;
  }
  if (rest_.size() < into.size()) return fail();
  std::copy_n(rest_.begin(), into.size(), into.begin());
  rest_ = rest_.subspan(into.size());
}

}  // namespace drivers
