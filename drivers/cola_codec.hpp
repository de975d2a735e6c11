// SICK's command language in both dialects: CoLa A (text between STX and ETX) and CoLa B (binary).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/resync.hpp"

namespace drivers {

enum class ColaDialect { ascii, binary };

inline constexpr std::size_t kColaFrameMax = 64 * 1024;

// For Resync. Either dialect: the start of a telegram says which one it is.
Look look_cola(ByteView front);

// A telegram without its frame. Views into the frame.
struct ColaMessage {
  ColaDialect dialect{};
  std::string_view command;  // "sRA"
  std::string_view name;     // "LMDscandata"; empty for sFA.
  ByteView body;             // What follows the name and its blank.

  std::string_view text() const;  // The body of an ascii telegram.
};

// `frame` as look_cola() found it. Nothing where it does not begin with a command.
std::optional<ColaMessage> parse_cola(ByteView frame);

// One parameter of a request. In ascii, hex without prefix or decimal with its sign.
struct ColaValue {
  enum class As { hex2, u8, u16, u32, hex32, i16, i32 };
  As as{};
  std::int64_t value{};
};

Bytes encode_cola(ColaDialect dialect, std::string_view command, std::string_view name,
                  std::span<const ColaValue> values = {});
// For telegrams that carry more than numbers: the body as it stands, framed.
Bytes frame_cola(ColaDialect dialect, ByteView payload);

// The code of an sFA answer, 0 where it cannot be read; nothing for other answers.
std::optional<std::uint16_t> cola_error(const ColaMessage& message);
// By code.
std::span<const Fault> cola_errors();

// Reads the body of an answer from front to back in its dialect. Reading past the end or a token
// that is no number makes ok() false for good and gives zeros.
class ColaReader {
 public:
  explicit ColaReader(const ColaMessage& message)
      : ascii_(message.dialect == ColaDialect::ascii), rest_(message.body) {}

  bool ok() const { return ok_; }
  bool at_end() const { return rest_.empty(); }
  bool ascii() const { return ascii_; }
  std::size_t left() const { return rest_.size(); }

  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::int16_t i16() { return std::bit_cast<std::int16_t>(number<std::uint16_t>()); }
  std::int32_t i32() { return std::bit_cast<std::int32_t>(number<std::uint32_t>()); }
  float f32() { return std::bit_cast<float>(number<std::uint32_t>()); }
  std::string_view characters(std::size_t count);
  void u16s(std::span<std::uint16_t> into);
  void u8s(std::span<std::uint16_t> into);

 private:
  template <class T>
  T number() {
    if (ascii_) return static_cast<T>(token(sizeof(T)));
    if (rest_.size() < sizeof(T)) return fail(), T{};
    const T value = big<T>(rest_, 0);
    rest_ = rest_.subspan(sizeof(T));
    return value;
  }
  std::uint32_t token(std::size_t width);
  void fail() { ok_ = false, rest_ = {}; }

  bool ascii_;
  bool ok_ = true;
  ByteView rest_;
};

}  // namespace drivers
