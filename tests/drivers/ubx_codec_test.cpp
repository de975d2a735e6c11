#include "drivers/ubx_codec.hpp"

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::from_hex;

Bytes pvt_bytes() {
  Bytes p(92);
  put_little<std::uint32_t>(p, 0, 474000200);
  put_little<std::uint16_t>(p, 4, 2026);
  const std::uint8_t clock[] = {11, 23, 9, 5, 1, 0x0F};
  std::copy(std::begin(clock), std::end(clock), p.begin() + 6);
  put_little<std::uint32_t>(p, 12, 30);
  put_little<std::int32_t>(p, 16, -120000);
  p[20] = 3;
  p[21] = 0xA3;
  p[22] = 0xE0;
  p[23] = 19;
  put_little<std::int32_t>(p, 24, 1705001306);
  put_little<std::int32_t>(p, 28, -458775286);
  put_little<std::int32_t>(p, 32, 29234);
  put_little<std::int32_t>(p, 36, 27434);
  put_little<std::uint32_t>(p, 40, 14);
  put_little<std::uint32_t>(p, 44, 21);
  put_little<std::int32_t>(p, 48, 100);
  put_little<std::int32_t>(p, 52, -200);
  put_little<std::int32_t>(p, 56, 50);
  put_little<std::int32_t>(p, 60, 224);
  put_little<std::int32_t>(p, 64, 29656505);
  put_little<std::uint32_t>(p, 68, 77);
  put_little<std::uint32_t>(p, 72, 123456);
  put_little<std::uint16_t>(p, 76, 131);
  put_little<std::uint16_t>(p, 78, 0x0006);
  put_little<std::int32_t>(p, 84, 1234567);
  put_little<std::int16_t>(p, 88, -250);
  put_little<std::uint16_t>(p, 90, 40);
  return p;
}

TEST(Ubx, NavPvtIsReadWhole) {
  const Bytes payload = pvt_bytes();
  const auto pvt = ubx_nav_pvt({1, 7, payload});
  ASSERT_TRUE(pvt);
  EXPECT_EQ(pvt->itow_ms, 474000200U);
  EXPECT_EQ(pvt->year, 2026);
  EXPECT_EQ(pvt->month, 11);
  EXPECT_EQ(pvt->day, 23);
  EXPECT_EQ(pvt->hour, 9);
  EXPECT_EQ(pvt->minute, 5);
  EXPECT_EQ(pvt->second, 1);
  EXPECT_TRUE(pvt->date_valid && pvt->time_valid && pvt->fully_resolved && pvt->magnetic_valid);
  EXPECT_EQ(pvt->time_accuracy_ns, 30U);
  EXPECT_EQ(pvt->nano, -120000);
  EXPECT_EQ(pvt->fix_type, 3);
  EXPECT_TRUE(pvt->fix_ok && pvt->differential && pvt->heading_valid);
  EXPECT_EQ(pvt->carrier, UbxCarrier::fixed);
  EXPECT_EQ(pvt->flags2, 0xE0);
  EXPECT_EQ(pvt->satellites, 19);
  EXPECT_EQ(pvt->longitude_1e7deg, 1705001306);
  EXPECT_EQ(pvt->latitude_1e7deg, -458775286);
  EXPECT_EQ(pvt->height_mm, 29234);
  EXPECT_EQ(pvt->height_msl_mm, 27434);
  EXPECT_EQ(pvt->horizontal_accuracy_mm, 14U);
  EXPECT_EQ(pvt->vertical_accuracy_mm, 21U);
  EXPECT_EQ(pvt->north_mmps, 100);
  EXPECT_EQ(pvt->east_mmps, -200);
  EXPECT_EQ(pvt->down_mmps, 50);
  EXPECT_EQ(pvt->ground_speed_mmps, 224);
  EXPECT_EQ(pvt->motion_heading_1e5deg, 29656505);
  EXPECT_EQ(pvt->speed_accuracy_mmps, 77U);
  EXPECT_EQ(pvt->heading_accuracy_1e5deg, 123456U);
  EXPECT_EQ(pvt->pdop_centi, 131);
  EXPECT_FALSE(pvt->position_invalid);
  EXPECT_EQ(pvt->correction_age_code, 3);
  EXPECT_EQ(pvt->vehicle_heading_1e5deg, 1234567);
  EXPECT_EQ(pvt->declination_centideg, -250);
  EXPECT_EQ(pvt->declination_accuracy_centideg, 40);
  EXPECT_TRUE(ubx_nav_pvt({1, 7, ByteView(payload).first(84)}));
  for (const std::size_t size : {0U, 83U, 85U, 91U})
    EXPECT_FALSE(ubx_nav_pvt({1, 7, ByteView(payload).first(size)}));
  EXPECT_FALSE(ubx_nav_pvt({1, 8, payload}));
}

TEST(Ubx, AnEpochKeepsTheReceiversIntegers) {
  const auto epoch = epoch_of(*ubx_nav_pvt({1, 7, pvt_bytes()}));
  EXPECT_EQ(epoch.date, (GnssDate{2026, 11, 23}));
  EXPECT_EQ(epoch.time_of_day_ns, (9 * 3600 + 5 * 60 + 1) * 1'000'000'000LL - 120000);
  EXPECT_EQ(epoch.mode, 3);
  EXPECT_EQ(epoch.quality, GnssQuality::rtk_fixed);
  EXPECT_EQ(epoch.latitude->nanominutes, -458775286LL * 6000);
  EXPECT_EQ(epoch.longitude->nanominutes, 1705001306LL * 6000);
  EXPECT_EQ(epoch.altitude_ellipsoid_m, 29.234);
  EXPECT_EQ(epoch.altitude_msl_m, 27.434);
  EXPECT_EQ(epoch.climb_mps, -0.05);
  EXPECT_TRUE(epoch.usable());
  Bytes midnight = pvt_bytes();
  midnight[6] = 3;
  midnight[7] = 1;
  midnight[8] = midnight[9] = midnight[10] = 0;
  const auto before = epoch_of(*ubx_nav_pvt({1, 7, midnight}));
  EXPECT_EQ(before.date, (GnssDate{2026, 2, 28}));
  EXPECT_EQ(before.time_of_day_ns, 86400 * 1'000'000'000LL - 120000);
}

TEST(Ubx, HighPrecisionRefinesTheEpochThatEoeEnds) {
  Bytes high(36);
  put_little<std::uint32_t>(high, 4, 474000200);
  put_little<std::int32_t>(high, 8, 1705001306);
  put_little<std::int32_t>(high, 12, -458775286);
  put_little<std::int32_t>(high, 16, 29234);
  put_little<std::int32_t>(high, 20, 27434);
  const std::uint8_t parts[] = {0x9D, 49, 9, 0xF7};  // -99, 49, 9, -9
  std::copy(std::begin(parts), std::end(parts), high.begin() + 24);
  put_little<std::uint32_t>(high, 28, 141);
  put_little<std::uint32_t>(high, 32, 205);
  const auto got = ubx_nav_hpposllh({1, 0x14, high});
  ASSERT_TRUE(got);
  EXPECT_EQ(got->longitude_1e9deg, 170500130600LL - 99);
  EXPECT_EQ(got->latitude_1e9deg, -45877528600LL + 49);
  EXPECT_EQ(got->height_01mm, 292349);
  EXPECT_EQ(got->height_msl_01mm, 274331);
  EXPECT_EQ(got->horizontal_accuracy_01mm, 141U);
  EXPECT_EQ(got->vertical_accuracy_01mm, 205U);
  EXPECT_FALSE(got->invalid);
  Bytes eoe;
  append_little<std::uint32_t>(eoe, 474000200);
  UbxEpochs grouping;
  const Bytes pvt = pvt_bytes();
  EXPECT_TRUE(grouping.add({1, 7, pvt}).empty());
  EXPECT_TRUE(grouping.add({1, 0x14, high}).empty());
  const auto done = grouping.add({1, 0x61, eoe});
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].longitude->nanominutes, (170500130600LL - 99) * 60);
  EXPECT_EQ(done[0].altitude_ellipsoid_m, 29.2349);
  EXPECT_EQ(done[0].horizontal_accuracy_m, 0.0141);
  EXPECT_FALSE(grouping.flush());
}

TEST(Ubx, RelativePositionIsReadWhole) {
  Bytes p(64);
  p[0] = 1;
  put_little<std::uint16_t>(p, 2, 7);
  put_little<std::uint32_t>(p, 4, 1000);
  const std::int32_t cm[] = {-123, 456, -7, 472};
  for (std::size_t i = 0; i < 4; ++i) put_little<std::int32_t>(p, 8 + 4 * i, cm[i]);
  put_little<std::int32_t>(p, 24, 10512345);
  const std::int8_t parts[] = {-99, 1, -50, 99};
  for (std::size_t i = 0; i < 4; ++i) put_little<std::int8_t>(p, 32 + i, parts[i]);
  for (std::uint32_t i = 0; i < 5; ++i) put_little<std::uint32_t>(p, 36 + 4 * i, 100 + i);
  put_little<std::uint32_t>(p, 60, 0x117);
  const auto got = ubx_nav_relposned({1, 0x3C, p});
  ASSERT_TRUE(got);
  EXPECT_EQ(got->station, 7);
  EXPECT_EQ(got->itow_ms, 1000U);
  EXPECT_EQ(got->north_01mm, -12399);
  EXPECT_EQ(got->east_01mm, 45601);
  EXPECT_EQ(got->down_01mm, -750);
  EXPECT_EQ(got->length_01mm, 47299);
  EXPECT_EQ(got->heading_1e5deg, 10512345);
  EXPECT_EQ(got->north_accuracy_01mm, 100U);
  EXPECT_EQ(got->east_accuracy_01mm, 101U);
  EXPECT_EQ(got->down_accuracy_01mm, 102U);
  EXPECT_EQ(got->length_accuracy_01mm, 103U);
  EXPECT_EQ(got->heading_accuracy_1e5deg, 104U);
  EXPECT_TRUE(got->fix_ok && got->differential && got->position_valid && got->heading_valid);
  EXPECT_EQ(got->carrier, UbxCarrier::fixed);
}

TEST(Ubx, SmallMessagesAreReadWhole) {
  const auto status = ubx_nav_status({1, 3, from_hex("01000000 03 5d 00 18 02000000 03000000")});
  ASSERT_TRUE(status);
  EXPECT_EQ(status->itow_ms, 1U);
  EXPECT_EQ(status->fix_type, 3);
  EXPECT_EQ(status->flags, 0x5D);
  EXPECT_EQ(status->flags2, 0x18);
  EXPECT_EQ(status->first_fix_ms, 2U);
  EXPECT_EQ(status->uptime_ms, 3U);
  ASSERT_EQ(ubx_faults(*status).size(), 1U);
  EXPECT_EQ(ubx_faults(*status)[0]->name, "spoofing on several signals");

  const auto dop = ubx_nav_dop({1, 4, from_hex("09000000 0100 0200 0300 0400 0500 0600 0700")});
  ASSERT_TRUE(dop);
  EXPECT_EQ(dop->itow_ms, 9U);
  EXPECT_EQ((std::array{dop->geometric, dop->position, dop->time, dop->vertical, dop->horizontal,
                        dop->northing, dop->easting}),
            (std::array<std::uint16_t, 7>{1, 2, 3, 4, 5, 6, 7}));

  Bytes p(64);
  p[5] = p[6] = 1;
  for (std::size_t i = 0; i < 6; ++i) {
    put_little<float>(p, 16 + 4 * i, static_cast<float>(i) + 0.5F);
    put_little<float>(p, 40 + 4 * i, -static_cast<float>(i));
  }
  const auto cov = ubx_nav_cov({1, 0x36, p});
  ASSERT_TRUE(cov);
  EXPECT_TRUE(cov->position_valid && cov->velocity_valid);
  EXPECT_EQ(cov->position_m2, (std::array<float, 6>{0.5, 1.5, 2.5, 3.5, 4.5, 5.5}));
  EXPECT_EQ(cov->velocity_m2ps2, (std::array<float, 6>{0, -1, -2, -3, -4, -5}));

  Bytes version(70);
  constexpr std::string_view kTexts[] = {"EXT CORE 1.00", "00190000", "PROTVER=27.31"};
  std::copy(kTexts[0].begin(), kTexts[0].end(), version.begin());
  std::copy(kTexts[1].begin(), kTexts[1].end(), version.begin() + 30);
  std::copy(kTexts[2].begin(), kTexts[2].end(), version.begin() + 40);
  const auto ver = ubx_mon_ver({0x0A, 4, version});
  ASSERT_TRUE(ver);
  EXPECT_EQ(ver->software, kTexts[0]);
  EXPECT_EQ(ver->hardware, kTexts[1]);
  EXPECT_EQ(ver->extensions, std::vector<std::string>{"PROTVER=27.31"});

  const auto rf = ubx_mon_rf(
      {0x0A, 0x38,
       from_hex("00 01 0000 00 03 04 01 00000000 00000000 5700 1200 c8 00000000 000000")});
  ASSERT_TRUE(rf);
  ASSERT_EQ(rf->blocks.size(), 1U);
  EXPECT_EQ(rf->blocks[0].noise, 0x57);
  EXPECT_EQ(rf->blocks[0].gain, 0x12);
  EXPECT_EQ(rf->blocks[0].jamming_indicator, 200);
  ASSERT_EQ(ubx_faults(rf->blocks[0]).size(), 2U);
  EXPECT_EQ(ubx_faults(rf->blocks[0])[0]->name, "jammed");
  EXPECT_EQ(ubx_faults(rf->blocks[0])[1]->name, "antenna open");

  const auto rtcm = ubx_rxm_rtcm({2, 0x32, from_hex("02 03 0000 d307 ed03")});
  ASSERT_TRUE(rtcm);
  EXPECT_EQ(rtcm->type, 1005);
  EXPECT_EQ(rtcm->station, 2003);
  ASSERT_EQ(ubx_faults(*rtcm).size(), 2U);
  EXPECT_EQ(ubx_faults(*rtcm)[0]->name, "damaged correction");

  const auto ack = ubx_ack({5, 0, from_hex("068a")});
  ASSERT_TRUE(ack);
  EXPECT_FALSE(ack->accepted);
  EXPECT_EQ(ack->cls, 6);
  EXPECT_EQ(ack->id, 0x8A);
}

TEST(Ubx, RequestsAreTheProtocolsBytes) {
  EXPECT_EQ(encode_ubx(0x0A, 0x04), from_hex("b562 0a04 0000 0e34"));
  EXPECT_EQ(ubx_cfg_rate(200, 1, 1), from_hex("b562 0608 0600 c800 0100 0100 de6a"));
  EXPECT_EQ(ubx_cfg_msg(1, 7, 1), from_hex("b562 0601 0300 0107 01 1351"));
  const std::vector<UbxSetting> settings{
      {ubx_key::kRateMeas_ms, 100}, {ubx_key::kUart1OutNmea, 0}, {ubx_key::kUart1Baud, 115200}};
  const auto set = ubx_valset(1, settings);
  ASSERT_TRUE(set);
  EXPECT_EQ(Bytes(set->begin() + 4, set->end() - 2),
            from_hex("1700 00 01 0000 01002130 6400 02007410 00 01005240 00c20100"));
  const std::vector<UbxSetting> odd{{0x00000001, 1}};
  EXPECT_FALSE(ubx_valset(1, odd));
  const Bytes model = ubx_cfg_nav5_model(4);
  EXPECT_EQ(model.size(), 44U);
  EXPECT_EQ(model[6], 1);
  EXPECT_EQ(model[8], 4);
}

}  // namespace
}  // namespace drivers
