// W on the earth, and messages as simulated receivers write them.
#include "drivers/site_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "drivers/gnss_demux.hpp"
#include "drivers/recognise.hpp"
#include "drivers/ublox_startup.hpp"
#include "drivers/ubx_encode.hpp"
#include "drivers/vn100_codec.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

// From the ellipsoid's own figures, without the library: WGS84's radii of curvature.
TEST(SiteFrame, AStepNorthAndEastIsWhatTheEllipsoidSays) {
  const double latitude_deg = 47.05, degree = std::numbers::pi / 180;
  const double a_m = 6378137.0, f = 1 / 298.257223563, e2 = f * (2 - f);
  const double s = std::sin(latitude_deg * degree);
  const double meridian_m = a_m * (1 - e2) / std::pow(1 - e2 * s * s, 1.5);
  const double normal_m = a_m / std::sqrt(1 - e2 * s * s);
  const SiteFrame site({latitude_deg, 8.31, 0, 0});
  const auto north = site.to_site({latitude_deg + 1e-4, 8.31, 0});
  EXPECT_NEAR(north.y(), meridian_m * 1e-4 * degree, 1e-3);
  EXPECT_NEAR(north.x(), 0, 1e-3);
  const auto east = site.to_site({latitude_deg, 8.31 + 1e-4, 0});
  EXPECT_NEAR(east.x(), normal_m * std::cos(latitude_deg * degree) * 1e-4 * degree, 1e-3);
  EXPECT_NEAR(east.y(), 0, 1e-3);
}

TEST(SiteFrame, WMayBeTurnedAgainstNorth) {
  // North lies a quarter turn counter-clockwise of y: along -x.
  const SiteFrame site({47.05, 8.31, 480, std::numbers::pi / 2});
  const auto north = site.to_site({47.05 + 1e-4, 8.31, 480});
  EXPECT_LT(north.x(), -10);
  EXPECT_NEAR(north.y(), 0, 1e-3);
}

TEST(SiteFrame, ThereAndBackIsTheSamePoint) {
  const SiteFrame site({-45.8775, 170.5, 29, -0.7});
  for (const Eigen::Vector3d& W_point : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(310, -42, 17)}) {
    const GeoPoint point = site.to_earth(W_point);
    EXPECT_LT((site.to_site(point) - W_point).norm(), 1e-6);
  }
}

UbxNavPvt whole_pvt() {
  UbxNavPvt pvt;
  pvt.itow_ms = 302400200;
  pvt.year = 2026;
  pvt.month = 6;
  pvt.day = 3;
  pvt.hour = 11;
  pvt.minute = 59;
  pvt.second = 42;
  pvt.date_valid = pvt.time_valid = pvt.fully_resolved = true;
  pvt.nano = -123456;
  pvt.fix_type = 3;
  pvt.fix_ok = pvt.differential = pvt.heading_valid = true;
  pvt.carrier = UbxCarrier::floating;
  pvt.satellites = 17;
  pvt.longitude_1e7deg = -83100001;
  pvt.latitude_1e7deg = 470500002;
  pvt.height_mm = -480;
  pvt.down_mmps = -12;
  pvt.correction_age_code = 9;
  pvt.declination_centideg = -250;
  return pvt;
}

TEST(UbxEncode, NavPvtReadsBackWhole) {
  const Bytes frame = encode_ubx(whole_pvt());
  EXPECT_EQ(look_gnss(frame).size, frame.size());
  const auto read = ubx_nav_pvt(parse_ubx(frame));
  ASSERT_TRUE(read);
  EXPECT_EQ(encode_ubx(*read), frame);
  EXPECT_EQ(read->nano, -123456);
  EXPECT_EQ(read->longitude_1e7deg, -83100001);
  EXPECT_EQ(read->carrier, UbxCarrier::floating);
  EXPECT_EQ(read->correction_age_code, 9);
  EXPECT_TRUE(read->heading_valid);
  EXPECT_EQ(read->declination_centideg, -250);
}

TEST(UbxEncode, FinePartsOfAPositionKeepTheirSign) {
  for (const std::int64_t sign : {1, -1}) {
    const UbxNavHpposllh wanted{
        1, false, sign * 8'310'000'099, sign * 47'050'000'001, sign * 4807, sign * 3, 141, 282};
    const auto read = ubx_nav_hpposllh(parse_ubx(encode_ubx(wanted)));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->longitude_1e9deg, wanted.longitude_1e9deg);
    EXPECT_EQ(read->latitude_1e9deg, wanted.latitude_1e9deg);
    EXPECT_EQ(read->height_01mm, wanted.height_01mm);
    EXPECT_EQ(read->height_msl_01mm, wanted.height_msl_01mm);
    EXPECT_EQ(read->horizontal_accuracy_01mm, 141U);
  }
}

TEST(UbxEncode, TheRecordedReceiversPositionsWriteBackTheSame) {
  RECORDING_OR_SKIP(log, "gnss/pygpsdata-NAV.log");
  std::size_t pvts = 0, fine = 0;
  for (const Bytes& frame : drivers_test::frames_in(as_bytes(log), look_gnss, kGnssFrameMax)) {
    if (gnss_kind(frame) != GnssKind::ubx) continue;
    const UbxMessage message = parse_ubx(frame);
    if (const auto high = ubx_nav_hpposllh(message)) {
      const auto again = ubx_nav_hpposllh(parse_ubx(encode_ubx(*high)));
      ASSERT_TRUE(again);
      EXPECT_EQ(again->latitude_1e9deg, high->latitude_1e9deg);
      ++fine;
    }
    const auto pvt = ubx_nav_pvt(message);
    if (!pvt || message.payload.size() != 92) continue;
    const auto again = ubx_nav_pvt(parse_ubx(encode_ubx(*pvt)));
    ASSERT_TRUE(again);
    EXPECT_EQ(encode_ubx(*again), encode_ubx(*pvt));
    ++pvts;
  }
  EXPECT_GT(pvts + fine, 0U);
}

TEST(UbxSettings, AreReadAsTheyWereWritten) {
  const UbxSetting settings[] = {{ubx_key::kRateMeas_ms, 200},
                                 {ubx_key::kDynamicModel, 3},
                                 {ubx_key::kUart1Baud, 460800},
                                 {ubx_key::kUart1OutNmea, 0}};
  const auto read = ubx_settings(parse_ubx(*ubx_valset(1, settings)));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ((*read)[i].key, settings[i].key);
    EXPECT_EQ((*read)[i].value, settings[i].value);
  }
  const std::uint32_t keys[] = {ubx_key::kRateMeas_ms, ubx_key::kNavEoeUart1};
  EXPECT_EQ(ubx_asked_keys(parse_ubx(ubx_valget(keys))),
            (std::vector<std::uint32_t>{keys[0], keys[1]}));
  // A value that is cut is no setting.
  Bytes cut{0, 1, 0, 0, 1, 0, 0x21, 0x30, 200};
  EXPECT_FALSE(ubx_settings({0x06, 0x8A, cut}));
}

TEST(UbloxModel, IsReadFromItsExtensions) {
  const auto f9 =
      ublox_model({"EXT CORE 1.00 (61b2dd)",
                   "00190000",
                   {"ROM BASE 0x118B2060", "FWVER=HPG 1.32", "PROTVER=27.31", "MOD=ZED-F9P"}});
  ASSERT_TRUE(f9);
  EXPECT_EQ(f9->model, "ZED-F9P");
  EXPECT_EQ(f9->dialect, UbloxDialect::f9);
  const auto m8 = ublox_model({"2.01 (75331)", "00080000", {"PROTVER 15.00"}});
  ASSERT_TRUE(m8);
  EXPECT_EQ(m8->dialect, UbloxDialect::m8);
  EXPECT_EQ(m8->firmware, "2.01 (75331)");
  EXPECT_FALSE(ublox_model({"7.03 (45969)", "00040007", {}}));
}

TEST(UbloxSettings, AreRefusedWithTheReason) {
  EXPECT_EQ(ublox_settings_problem({}), "");
  UbloxSettings fast;
  fast.rate_hz = 20;
  EXPECT_NE(ublox_settings_problem(fast).find("38400"), std::string::npos);
  fast.port = UbloxPort::usb;
  EXPECT_EQ(ublox_settings_problem(fast), "");
  fast.rate_hz = 3;
  EXPECT_NE(ublox_settings_problem(fast).find("Hz"), std::string::npos);
}

TEST(Recognise, NamesWhoSpeaks) {
  const auto of = [](std::string_view text) { return recognise(as_bytes(text)); };
  EXPECT_EQ(of("$GNHDT,,T*05\r\n"), "a satellite receiver that sends NMEA (GNHDT)");
  EXPECT_EQ(of("$VNRRG,02,4*69\r\n"), "a VectorNav (VNRRG)");
  EXPECT_EQ(recognise(encode_ubx(whole_pvt())), "a u-blox receiver that sends UBX");
  EXPECT_EQ(recognise(encode_vn100_binary(0x29, {})), "a VectorNav that sends packets");
  EXPECT_EQ(of("SSH-2.0-OpenSSH_9.2p1\r\n"), "an SSH server");
  EXPECT_EQ(of("HTTP/1.1 400 Bad Request\r\n"), "a web server");
  EXPECT_EQ(of("\x01\x02garbage"), "");
  EXPECT_EQ(of(""), "");
}

}  // namespace
}  // namespace drivers
