#include "drivers/gpsd_codec.hpp"

#include "drivers/nmea_codec.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

TEST(Gpsd, ALineIsReadWhole) {
  const auto line = parse_gpsd(as_bytes(
      R"({"class":"TPV","device":"/dev/ttyACM0","status":3,"mode":3,"time":"2020-03-18T13:38:59.800Z",)"
      R"("leapseconds":18,"ept":0.005,"lat":41.575030034,"lon":-93.750597775,"altHAE":249.385,)"
      R"("altMSL":280.827,"epx":1.5,"epy":2.5,"epv":4.2,"track":92.3,"speed":0.004,"climb":0.002,)"
      R"("eps":7.0,"epc":8.4,"epd":3.0,"geoidSep":-31.442,"eph":13.3,"sep":22.8,"dgpsAge":5.8,"dgpsSta":2})"));
  ASSERT_TRUE(line);
  const auto& tpv = std::get<GpsdTpv>(*line);
  EXPECT_EQ(tpv.device, "/dev/ttyACM0");
  EXPECT_EQ(tpv.mode, 3);
  EXPECT_EQ(tpv.status, 3);
  EXPECT_EQ(tpv.leap_seconds, 18);
  EXPECT_EQ(tpv.latitude_deg, 41.575030034);
  EXPECT_EQ(tpv.longitude_deg, -93.750597775);
  EXPECT_EQ(tpv.altitude_ellipsoid_m, 249.385);
  EXPECT_EQ(tpv.altitude_msl_m, 280.827);
  EXPECT_EQ(tpv.geoid_separation_m, -31.442);
  EXPECT_EQ(tpv.track_deg, 92.3);
  EXPECT_EQ(tpv.speed_mps, 0.004);
  EXPECT_EQ(tpv.climb_mps, 0.002);
  EXPECT_EQ(tpv.ept_s, 0.005);
  EXPECT_EQ(tpv.epx_m, 1.5);
  EXPECT_EQ(tpv.epy_m, 2.5);
  EXPECT_EQ(tpv.epv_m, 4.2);
  EXPECT_EQ(tpv.eph_m, 13.3);
  EXPECT_EQ(tpv.sep_m, 22.8);
  EXPECT_EQ(tpv.eps_mps, 7.0);
  EXPECT_EQ(tpv.epc_mps, 8.4);
  EXPECT_EQ(tpv.epd_deg, 3.0);
  EXPECT_EQ(tpv.correction_age_s, 5.8);
  EXPECT_EQ(tpv.correction_station, 2);
  const GnssEpoch epoch = epoch_of(tpv);
  EXPECT_EQ(epoch.date, (GnssDate{2020, 3, 18}));
  EXPECT_EQ(epoch.time_of_day_ns, nmea_time_ns("133859.8"));
  EXPECT_EQ(epoch.latitude, ExactAngle::from_1e9deg(41575030034));
  EXPECT_EQ(epoch.quality, GnssQuality::rtk_fixed);
}

TEST(Gpsd, OtherLinesAreNamedAndBadOnesCounted) {
  const auto decoder = gpsd_offline();
  std::vector<std::string> names;
  Captured captured;
  constexpr std::string_view kLines =
      "{\"class\":\"VERSION\",\"release\":\"3.22\",\"proto_major\":3,\"proto_minor\":14}\r\n"
      "$GPHDT,,T*1B\r\n"
      "{\"class\":\"SKY\",\"hdop\":0.9,\"nSat\":2,\"uSat\":1,\"satellites\":[{\"PRN\":5,\"el\":4.0,"
      "\"used\":true},{\"PRN\":9,\"used\":false}]}\r\n"
      "{\"class\":\"WATCH\",\"enable\":true}\r\n{\"class\":}\r\n{}\r\n{\"class\":\"ERROR\","
      "\"message\":\"x\"}\n";
  captured.bytes = as_bytes(kLines);
  decoder->feed(captured, [&](const Message& m) { names.push_back(m.name); });
  EXPECT_EQ(names, (std::vector<std::string>{"VERSION", "SKY", "WATCH", "ERROR"}));
  EXPECT_EQ(decoder->skipped().at("no JSON").bytes, 14U);
  EXPECT_EQ(decoder->skipped().at("no JSON object").bytes, 12U);
  EXPECT_EQ(decoder->skipped().at("no class").times, 1U);
}

TEST(Gpsd, WholeLinesSurviveDamage) {
  const auto line = [](std::string_view text) {
    return drivers_test::bytes_of(std::string(text) + "\r\n");
  };
  const std::vector<Bytes> frames{
      line(R"({"class":"TPV","mode":3,"lat":41.5})"),
      line(R"({"class":"DEVICES","devices":[{"class":"DEVICE","path":"/dev/ttyACM0"}]})"),
      line(R"({"class":"SKY","satellites":[{"PRN":5,"used":true}]})"),
      line(R"({"class":"WATCH"})")};
  drivers_test::expect_whole_frames_survive(frames, look_gpsd, kGpsdLineMax,
                                            drivers_test::bytes_of("x{\"class\":{{\x02$"));
}

}  // namespace
}  // namespace drivers
