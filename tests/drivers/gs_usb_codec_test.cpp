#include "drivers/gs_usb_codec.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/drivers/can_frames.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers::gs_usb {
namespace {

using drivers_test::can;
using drivers_test::from_hex;

// candleLight on an STM32F0.
constexpr BitTimingLimits kCandle{0x1F, 48'000'000, 1, 16, 1, 8, 4, 1, 1024, 1};

TEST(GsUsb, WritesControlStructuresByteForByte) {
  EXPECT_EQ(host_format(), from_hex("EF BE 00 00"));
  EXPECT_EQ(encode(BitTiming{1, 12, 2, 1, 6}),
            from_hex("01000000 0C000000 02000000 01000000 06000000"));
  EXPECT_EQ(start_mode(kHardwareTime), from_hex("01000000 10000000"));
  EXPECT_EQ(reset_mode(), from_hex("00000000 00000000"));
  EXPECT_EQ(identify(true), from_hex("01000000"));
}

TEST(GsUsb, ReadsControlRepliesByteForByte) {
  EXPECT_EQ(decode_config(from_hex("000000 00 02000000 01000000")), (DeviceConfig{1, 2, 1}));
  EXPECT_EQ(decode_limits(from_hex("1F000000 006CDC02 01000000 10000000 01000000 08000000 04000000"
                                   "01000000 00040000 01000000")),
            kCandle);
  EXPECT_EQ(decode_state(from_hex("02000000 80000000 01000000")),
            (DeviceState{BusState::passive, 128, 1}));
  EXPECT_EQ(decode_timestamp_us(from_hex("40420F00")), 1'000'000U);
  EXPECT_EQ(decode_timing(encode(BitTiming{1, 2, 3, 4, 5})), (BitTiming{1, 2, 3, 4, 5}));
  EXPECT_EQ(decode_limits(encode(kCandle)), kCandle);
  EXPECT_EQ(decode_config(encode(DeviceConfig{2, 3, 4})), (DeviceConfig{2, 3, 4}));
  EXPECT_EQ(decode_state(encode(DeviceState{BusState::bus_off, 0, 255})),
            (DeviceState{BusState::bus_off, 0, 255}));
  EXPECT_EQ(decode_config(Bytes(11)), std::nullopt);
  EXPECT_EQ(decode_limits(Bytes(39)), std::nullopt);
  EXPECT_EQ(decode_state(from_hex("06000000 00000000 00000000")), std::nullopt);
  EXPECT_EQ(decode_timestamp_us(Bytes(3)), std::nullopt);
}

TEST(GsUsb, FindsTheTimingsOfTheMakersTables) {
  for (const auto& [rate, prescaler] : {std::pair{1'000'000U, 3U},
                                        {500'000U, 6U},
                                        {250'000U, 12U},
                                        {125'000U, 24U},
                                        {100'000U, 30U},
                                        {50'000U, 60U}})
    EXPECT_EQ(timing_for(kCandle, rate), (BitTiming{1, 12, 2, 1, prescaler})) << rate;
  auto fast = kCandle;
  fast.clock_hz = 80'000'000;
  for (const auto& [rate, prescaler] :
       {std::pair{1'000'000U, 5U}, {500'000U, 10U}, {250'000U, 20U}, {125'000U, 40U}})
    EXPECT_EQ(timing_for(fast, rate), (BitTiming{1, 12, 2, 1, prescaler})) << rate;
  EXPECT_EQ(timing_for(kCandle, 800'000), (BitTiming{1, 11, 2, 1, 4}));
  EXPECT_EQ(timing_for(kCandle, 333'333), std::nullopt);
  EXPECT_EQ(timing_for(kCandle, 0), std::nullopt);
}

TEST(GsUsb, EveryTimingFoundIsExactAndWithinTheLimits) {
  std::mt19937 random(6);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    BitTimingLimits limits = kCandle;
    limits.clock_hz = 1'000'000 * (8 + random() % 100);
    limits.segment1_max = 2 + random() % 30;
    limits.segment2_max = 1 + random() % 16;
    limits.prescaler_max = 1 + random() % 256;
    const std::uint32_t rate = 5000 * (1 + random() % 200);
    const auto timing = timing_for(limits, rate);
    if (!timing) continue;
    ++found;
    const auto segment1 = timing->propagation + timing->phase1;
    EXPECT_EQ(std::uint64_t{rate} * timing->prescaler * (1 + segment1 + timing->phase2),
              limits.clock_hz);
    EXPECT_LE(segment1, limits.segment1_max);
    EXPECT_LE(timing->phase2, limits.segment2_max);
    EXPECT_LE(timing->prescaler, limits.prescaler_max);
  }
  EXPECT_GT(found, 20);
}

TEST(GsUsb, ReadsAndWritesBulkFramesByteForByte) {
  const auto frame = can("211#0100010000800005");
  const Bytes received = from_hex("FFFFFFFF 11020000 08 00 00 00 0100010000800005 40420F00");
  EXPECT_EQ(decode(received, true), HostFrame(Received{frame, 0, false, 1'000'000}));
  EXPECT_EQ(decode(received, false), HostFrame(Received{frame, 0, false, std::nullopt}));
  EXPECT_EQ(encode(Received{frame, 0, false, 1'000'000}), received);
  const Bytes echo = from_hex("03000000 11010000 08 01 00 00 0096000000000000");
  EXPECT_EQ(decode(echo, false), HostFrame(Echo{3, 1, can("111#0096000000000000"), std::nullopt}));
  EXPECT_EQ(encode(Echo{3, 1, can("111#0096000000000000"), std::nullopt}), echo);
  const auto sent = encode(can("18DA10F1#0102"), 0, 9);
  EXPECT_EQ(Bytes(sent.begin(), sent.end()),
            from_hex("09000000 F110DA98 02 00 00 00 0102000000000000"));
  const auto asked = encode(can("705#R"), 0, 0);
  EXPECT_EQ(Bytes(asked.begin(), asked.end()),
            from_hex("00000000 05070040 00 00 00 00 0000000000000000"));
  Bytes overflow = received;
  overflow[10] = 1;
  EXPECT_TRUE(std::get<Received>(decode(overflow, true)).overflow);
}

TEST(GsUsb, ReadsErrorFrames) {
  const Bytes bytes = from_hex("FFFFFFFF 24020020 08 00 00 00 00 20 00 00 00 00 88 07");
  const auto error = std::get<BusError>(decode(bytes, false));
  EXPECT_EQ(error, (BusError{0, 0x224, 0x20, 0, 0, 0x88, 0x07}));
  const auto faults = faults_set(bus_faults(), error.classes);
  ASSERT_EQ(faults.size(), 3U);
  EXPECT_EQ(faults[1]->name, "nobody acknowledges");
  EXPECT_EQ(faults_set(controller_faults(), error.controller)[0]->name, "transmit passive");
}

TEST(GsUsb, RefusesShortAndForeignTransfers) {
  const Bytes whole = from_hex("FFFFFFFF 11020000 08 00 00 00 0100010000800005 40420F00");
  for (std::size_t size = 0; size < 24; ++size) {
    const auto cut = ByteView(whole).first(size);
    EXPECT_EQ(decode(cut, true), HostFrame(Unread{"length"})) << size;
    EXPECT_EQ(std::holds_alternative<Unread>(decode(cut, false)), size < 20) << size;
  }
  Bytes changed = whole;
  changed[10] = 2;
  EXPECT_EQ(decode(changed, true), HostFrame(Unread{"CAN FD"}));
  changed = whole;
  changed[8] = 9;
  EXPECT_EQ(decode(changed, true), HostFrame(Unread{"data length"}));
  changed = whole;
  changed[5] = 0x12;
  EXPECT_EQ(decode(changed, true), HostFrame(Unread{"id"}));
}

}  // namespace
}  // namespace drivers::gs_usb
