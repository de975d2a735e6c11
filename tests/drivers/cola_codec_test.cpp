#include "drivers/cola_codec.hpp"

#include <array>

#include "drivers/sick_lms_codec.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::from_hex;

TEST(Cola, ErrorsAreNamedInEitherWidthAndDialect) {
  const auto code = [](ColaDialect dialect, const Bytes& payload) {
    const Bytes frame = frame_cola(dialect, payload);
    return cola_error(*parse_cola(frame));
  };
  EXPECT_EQ(code(ColaDialect::ascii, bytes_of("sFA 1A")), 0x1A);
  EXPECT_EQ(code(ColaDialect::ascii, bytes_of("sFA x")), 0);
  EXPECT_EQ(code(ColaDialect::binary, from_hex("734641 05")), 5);
  EXPECT_EQ(code(ColaDialect::binary, from_hex("734641 20")), 0x20);
  EXPECT_EQ(code(ColaDialect::binary, from_hex("734641 20 05")), 5);
  EXPECT_EQ(code(ColaDialect::binary, from_hex("734641 0005")), 5);
  EXPECT_EQ(code(ColaDialect::binary, from_hex("734641 20 0005")), 5);
  for (std::uint32_t known = 1; known <= 0x20; ++known) {
    const Fault* fault = fault_of(cola_errors(), known);
    EXPECT_EQ(fault != nullptr, known <= 0x19 || known == 0x20) << known;
    if (fault != nullptr) {
      EXPECT_FALSE(fault->name.empty() || fault->cause.empty() || fault->remedy.empty());
    }
  }
}

TEST(Cola, WholeTelegramsSurviveDamage) {
  LmsScan scan;
  scan.channels16 = {{{'D', 'I', 'S', 'T', '1'}, 1, 0, -450000, 5000, {0x0202, 0x0202, 0x0203, 3}}};
  const std::vector<Bytes> binary{
      encode_cola(ColaDialect::binary, "sRN", "SCdevicestate"),
      encode_lms_scan(ColaDialect::binary, "sSN", scan),
      from_hex("02020202 00000013 73414e205365744163636573734d6f646520 01 38"),
      encode_lms_scan(ColaDialect::binary, "sSN", scan)};
  drivers_test::expect_whole_frames_survive(binary, look_cola, kColaFrameMax,
                                            from_hex("02 03 0202 00 ff 020202 02020202020202"));
  drivers_test::expect_flips_cost_one_frame(binary, look_cola, kColaFrameMax);
  const std::vector<Bytes> ascii{bytes_of("\x02sRA SCdevicestate 1\x03"),
                                 encode_lms_scan(ColaDialect::ascii, "sSN", scan),
                                 bytes_of("\x02sFA 5\x03"), bytes_of("\x02sAN Run 1\x03")};
  drivers_test::expect_whole_frames_survive(ascii, look_cola, kColaFrameMax,
                                            from_hex("03 02 ff 41"));
}

TEST(Cola, RequestsAreTheRecordedBytes) {
  EXPECT_EQ(encode_cola(ColaDialect::binary, "sMN", "SetAccessMode",
                        std::array<ColaValue, 2>{
                            {{ColaValue::As::u8, 3}, {ColaValue::As::hex32, 0xF4724744}}}),
            from_hex("02020202 00000017 734d4e205365744163636573734d6f646520 03 f4724744 b3"));
  EXPECT_EQ(encode_cola(ColaDialect::binary, "sRN", "FirmwareVersion"),
            from_hex("02020202 00000013 73524e204669726d7761726556657273696f6e 24"));
}

}  // namespace
}  // namespace drivers
