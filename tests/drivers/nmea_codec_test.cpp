#include "drivers/nmea_codec.hpp"

#include "drivers/gnss_demux.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::frames_in;

std::optional<NmeaSentence> parse(std::string_view text) {
  return parse_nmea(as_bytes(encode_nmea(text)));
}

TEST(Nmea, AnglesAreExact) {
  EXPECT_EQ(nmea_angle("4552.65403", "S", 90)->nanominutes,
            -(45 * 60 + 52) * 1'000'000'000LL - 654030000);
  EXPECT_EQ(nmea_angle("17030.00668", "E", 180)->nanominutes,
            (170 * 60 + 30) * 1'000'000'000LL + 6680000);
  EXPECT_EQ(nmea_angle("0000.0", "N", 90)->nanominutes, 0);
  EXPECT_EQ(nmea_angle("4134.4978216612345", "N", 90)->nanominutes,
            (41 * 60 + 34) * 1'000'000'000LL + 497821661);
  EXPECT_EQ(nmea_angle("9000.000", "N", 90)->deg(), 90);
  for (const char* bad : {"", "9000.001", "4560.0", "45x2.0", "-4552.0", "4552.-1", "12345678.0"})
    EXPECT_FALSE(nmea_angle(bad, "N", 90)) << bad;
  EXPECT_FALSE(nmea_angle("4552.0", "E", 90));
  EXPECT_FALSE(nmea_angle("4552.0", "", 90));
}

TEST(Nmea, TimesAreExact) {
  EXPECT_EQ(nmea_time_ns("132819.60"), (13 * 3600 + 28 * 60 + 19) * 1'000'000'000LL + 600000000);
  EXPECT_EQ(nmea_time_ns("235960"), 86400 * 1'000'000'000LL);
  for (const char* bad : {"", "240000", "236000", "235961", "1:2:3"})
    EXPECT_FALSE(nmea_time_ns(bad));
}

TEST(Nmea, SentencesAreReadWhole) {
  const auto gga = parse(
      "GNGGA,132819.60,4134.49795459,N,09345.03431408,W,4,10,0.9,278.161,M,-31.442,M,6.6,0133");
  ASSERT_TRUE(gga);
  EXPECT_EQ(gga->talker, "GN");
  EXPECT_EQ(gga->type, "GGA");
  const auto& g = std::get<NmeaGga>(gga->value);
  EXPECT_EQ(g.time_of_day_ns, nmea_time_ns("132819.60"));
  EXPECT_EQ(g.latitude->nanominutes, (41 * 60 + 34) * 1'000'000'000LL + 497954590);
  EXPECT_EQ(g.longitude->nanominutes, -(93 * 60 + 45) * 1'000'000'000LL - 34314080);
  EXPECT_EQ(g.quality, 4);
  EXPECT_EQ(g.satellites, 10);
  EXPECT_EQ(g.hdop, 0.9);
  EXPECT_EQ(g.altitude_msl_m, 278.161);
  EXPECT_EQ(g.geoid_separation_m, -31.442);
  EXPECT_EQ(g.correction_age_s, 6.6);
  EXPECT_EQ(g.station, 133);

  const auto r = std::get<NmeaRmc>(
      parse("GPRMC,193221.00,A,2037.7279,N,08704.0848,W,00.1,201.8,231207,01,W,A,V")->value);
  EXPECT_TRUE(r.valid);
  EXPECT_EQ(r.speed_knots, 0.1);
  EXPECT_EQ(r.track_deg, 201.8);
  EXPECT_EQ(r.date, (GnssDate{2007, 12, 23}));
  EXPECT_EQ(r.magnetic_variation_deg, -1);
  EXPECT_EQ(r.mode, 'A');
  EXPECT_EQ(r.navigation_status, 'V');

  const auto t = std::get<NmeaGst>(parse("GNGST,181142.00,46,1,2,3,4.7,1.9,5.3")->value);
  EXPECT_EQ(t.rms, 46);
  EXPECT_EQ(t.semi_major_m, 1);
  EXPECT_EQ(t.semi_minor_m, 2);
  EXPECT_EQ(t.orientation_deg, 3);
  EXPECT_EQ(t.latitude_sigma_m, 4.7);
  EXPECT_EQ(t.longitude_sigma_m, 1.9);
  EXPECT_EQ(t.altitude_sigma_m, 5.3);

  const auto v = std::get<NmeaVtg>(parse("GPVTG,150.20,T,164.83,M,0.02,N,0.05,K,A")->value);
  EXPECT_EQ(v.track_deg, 150.20);
  EXPECT_EQ(v.magnetic_track_deg, 164.83);
  EXPECT_EQ(v.speed_knots, 0.02);
  EXPECT_EQ(v.speed_kmph, 0.05);
  EXPECT_EQ(v.mode, 'A');

  const auto a = std::get<NmeaGsa>(parse("GNGSA,A,3,13,16,,,,,,,,,,,1.05,0.64,0.83,1")->value);
  EXPECT_EQ(a.selection, 'A');
  EXPECT_EQ(a.fix, 3);
  EXPECT_EQ(a.satellites, (std::vector<int>{13, 16}));
  EXPECT_EQ(a.pdop, 1.05);
  EXPECT_EQ(a.hdop, 0.64);
  EXPECT_EQ(a.vdop, 0.83);
  EXPECT_EQ(a.system, 1);

  const auto s = std::get<NmeaGsv>(parse("GPGSV,2,2,06,24,25,247,36,30,,,17,1")->value);
  EXPECT_EQ(s.sentences, 2);
  EXPECT_EQ(s.sentence, 2);
  EXPECT_EQ(s.in_view, 6);
  ASSERT_EQ(s.satellites.size(), 2U);
  EXPECT_EQ(s.satellites[0].id, 24);
  EXPECT_EQ(s.satellites[0].elevation_deg, 25);
  EXPECT_EQ(s.satellites[0].azimuth_deg, 247);
  EXPECT_EQ(s.satellites[0].signal_dbhz, 36);
  EXPECT_FALSE(s.satellites[1].elevation_deg);
  EXPECT_EQ(s.satellites[1].signal_dbhz, 17);

  EXPECT_FALSE(std::get<NmeaHdt>(parse("GPHDT,,T")->value).heading_deg);
  EXPECT_EQ(std::get<NmeaHdt>(parse("GPHDT,274.07,T")->value).heading_deg, 274.07);
  EXPECT_EQ(std::get<NmeaZda>(parse("GPZDA,193223.00,23,12,2007,00,00")->value).date,
            (GnssDate{2007, 12, 23}));
  const auto l = std::get<NmeaGll>(parse("GNGLL,3203.94995,N,03446.42914,E,084158.00,A,D")->value);
  EXPECT_TRUE(l.valid);
  EXPECT_EQ(l.mode, 'D');
  EXPECT_EQ(l.longitude->nanominutes, (34 * 60 + 46) * 1'000'000'000LL + 429140000);
  EXPECT_EQ(std::get<NmeaOther>(parse("PUBX,04,1")->value).fields,
            (std::vector<std::string>{"04", "1"}));
}

TEST(Nmea, FieldsThatCannotBeReadSpoilTheSentence) {
  for (const char* bad :
       {"GPGGA,1x2819.60,,,,,0", "GPGGA,,4134.5,Q,,,0", "GPGGA,,,,,,9", "GPHDT,nan,T",
        "GPRMC,,A,,,,,,,321320", "GPRMC,,A,,,,,,,12032", "GPZDA,,1,13,2020", "GP"})
    EXPECT_FALSE(parse(bad)) << bad;
}

TEST(Nmea, AnEpochEndsWithTheSentenceThatEndedTheLast) {
  NmeaEpochs grouping;
  const auto feed = [&](std::string_view text) { return grouping.add(*parse(text)).size(); };
  EXPECT_EQ(feed("GNRMC,000001.00,A,4552.0,S,17030.0,E,1.0,2.0,120419,,,R"), 0U);
  EXPECT_EQ(feed("GNGGA,000001.00,4552.0,S,17030.0,E,4,12,0.6,14.2,M,1.8,M,,"), 0U);
  EXPECT_EQ(feed("GNGST,000001.00,1,,,,0.1,0.2,0.3"), 0U);
  EXPECT_EQ(feed("GNRMC,000002.00,A,4552.0,S,17030.0,E,1.0,2.0,120419,,,R"), 1U);
  EXPECT_EQ(feed("GNGGA,000002.00,4552.0,S,17030.0,E,4,12,0.6,14.2,M,1.8,M,,"), 0U);
  EXPECT_EQ(feed("GNGST,000002.00,1,,,,0.1,0.2,0.3"), 1U);
  EXPECT_FALSE(grouping.flush());
  EXPECT_EQ(feed("GNRMC,000003.00,V,,,,,,,120419,,,N"), 0U);
  const auto last = grouping.flush();  // Silence.
  ASSERT_TRUE(last);
  EXPECT_EQ(last->mode, 1);
  EXPECT_FALSE(last->usable());
}

TEST(Nmea, NoFlippedByteGivesAnotherSentence) {
  const std::string text = encode_nmea("GPHDT,274.07,T");
  for (std::size_t at = 0; at + 2 < text.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      std::string bad = text;
      bad[at] = static_cast<char>(bad[at] ^ (1 << bit));
      for (const Bytes& frame : frames_in(as_bytes(bad + "$"), look_gnss, kGnssFrameMax)) {
        const auto got = parse_nmea(frame);  // A hex digit may come in lower case.
        ASSERT_TRUE(got);
        EXPECT_EQ(std::get<NmeaHdt>(got->value).heading_deg, 274.07) << at << ' ' << bit;
      }
    }
}

}  // namespace
}  // namespace drivers
