// Receivers' streams against the bytes that they sent and against what gpsd says of them.
#include <chrono>
#include <cmath>

#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_codec.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/ubx_codec.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::frames_in;
using drivers_test::from_hex;
using drivers_test::joined;

// Logs begin with comment lines.
std::string without_comments(std::string_view log) {
  while (log.starts_with('#')) log.remove_prefix(std::min(log.find('\n') + 1, log.size()));
  return std::string(log);
}

std::vector<GnssEpoch> nmea_epochs(std::string_view log) {
  NmeaEpochs grouping;
  std::vector<GnssEpoch> epochs;
  for (const Bytes& frame : frames_in(as_bytes(log), look_gnss, kGnssFrameMax)) {
    if (gnss_kind(frame) != GnssKind::nmea) continue;
    const auto sentence = parse_nmea(frame);
    if (!sentence) continue;
    for (GnssEpoch& epoch : grouping.add(*sentence)) epochs.push_back(epoch);
  }
  if (const auto last = grouping.flush()) epochs.push_back(*last);
  return epochs;
}

template <class T>
std::vector<T> gpsd_messages(std::string_view chk) {
  std::vector<T> all;
  for (const Bytes& line : frames_in(as_bytes(chk), look_gpsd, kGpsdLineMax)) {
    const auto message = parse_gpsd(line);
    EXPECT_TRUE(message) << as_text(line);
    if (message && std::holds_alternative<T>(*message)) all.push_back(std::get<T>(*message));
  }
  return all;
}

std::int64_t days(const GnssDate& date) {
  using namespace std::chrono;
  return sys_days(year_month_day(year(date.year), month(static_cast<unsigned>(date.month)),
                                 day(static_cast<unsigned>(date.day))))
      .time_since_epoch()
      .count();
}

void expect_near(std::optional<double> got, std::optional<double> expected, double most,
                 const std::string& what) {
  if (!expected) return;  // gpsd does not state it.
  ASSERT_TRUE(got) << what;
  EXPECT_NEAR(*got, *expected, most) << what;
}

// What gpsd states of the same instant, to the digits that it states.
void expect_as_gpsd(const GnssEpoch& epoch, const GpsdTpv& tpv) {
  EXPECT_EQ(epoch.mode, tpv.mode) << tpv.time;
  EXPECT_EQ(epoch.quality, epoch_of(tpv).quality) << tpv.time;
  const auto deg = [](const std::optional<ExactAngle>& angle) {
    return angle ? std::optional(angle->deg()) : std::nullopt;
  };
  expect_near(deg(epoch.latitude), tpv.latitude_deg, 0.51e-9, tpv.time);
  expect_near(deg(epoch.longitude), tpv.longitude_deg, 0.51e-9, tpv.time);
  expect_near(epoch.altitude_msl_m, tpv.altitude_msl_m, 0.51e-4, tpv.time);
  expect_near(epoch.altitude_ellipsoid_m, tpv.altitude_ellipsoid_m, 0.51e-4, tpv.time);
  expect_near(epoch.speed_mps, tpv.speed_mps, 0.51e-3, tpv.time);
  expect_near(epoch.track_deg, tpv.track_deg, 0.51e-4, tpv.time);
  expect_near(epoch.correction_age_s, tpv.correction_age_s, 0.051, tpv.time);
}

// Pairs every epoch with the last TPV of its instant. `day_shift`: gpsd's error in days.
std::size_t expect_epochs_as_gpsd(const std::vector<GnssEpoch>& epochs, std::string_view chk,
                                  std::int64_t day_shift = 0) {
  std::map<std::pair<std::int64_t, std::int64_t>, GpsdTpv> by_time;
  for (const GpsdTpv& tpv : gpsd_messages<GpsdTpv>(chk)) {
    const GnssEpoch at = epoch_of(tpv);
    if (at.date && at.time_of_day_ns) by_time[{days(*at.date), *at.time_of_day_ns}] = tpv;
  }
  std::size_t compared = 0;
  for (const GnssEpoch& epoch : epochs) {
    if (!epoch.date || !epoch.time_of_day_ns) continue;
    const auto found = by_time.find({days(*epoch.date) + day_shift, *epoch.time_of_day_ns});
    if (found == by_time.end()) continue;
    expect_as_gpsd(epoch, found->second);
    by_time.erase(found);
    ++compared;
  }
  for (const auto& [time, tpv] : by_time) ADD_FAILURE() << "no epoch for " << tpv.time;
  return compared;
}

TEST(Gnss, RtkLogAgreesWithGpsd) {
  RECORDING_OR_SKIP(log, "gnss/nmea-rtk.log");
  RECORDING_OR_SKIP(chk, "gnss/nmea-rtk.log.chk");
  EXPECT_EQ(expect_epochs_as_gpsd(nmea_epochs(without_comments(log)), chk), 122U);
}

TEST(Gnss, RoundingTrapsAgreeWithGpsd) {
  RECORDING_OR_SKIP(log, "gnss/nmea-fuzzy-cases.log");
  RECORDING_OR_SKIP(chk, "gnss/nmea-fuzzy-cases.log.chk");
  EXPECT_EQ(expect_epochs_as_gpsd(nmea_epochs(without_comments(log)), chk), 14U);
}

TEST(Gnss, F9pLogAgreesWithGpsdInPositionAndErrorEstimates) {
  RECORDING_OR_SKIP(log, "gnss/ublox-zed-f9p-nmea.log");
  RECORDING_OR_SKIP(chk, "gnss/ublox-zed-f9p-nmea.log.chk");
  const auto epochs = nmea_epochs(without_comments(log));
  EXPECT_EQ(epochs.size(), 29U);
  EXPECT_EQ(expect_epochs_as_gpsd(epochs, chk), 29U);
  const auto gst = gpsd_messages<GpsdGst>(chk);
  ASSERT_EQ(gst.size(), 29U);
  for (std::size_t i = 0; i < gst.size(); ++i) {
    expect_near(epochs[i].sigma_north_m, gst[i].latitude_sigma_m, 1e-9, gst[i].time);
    expect_near(epochs[i].sigma_east_m, gst[i].longitude_sigma_m, 1e-9, gst[i].time);
    expect_near(epochs[i].sigma_up_m, gst[i].altitude_sigma_m, 1e-9, gst[i].time);
  }
}

TEST(Gnss, AgreesWithGpsdButForItsWeeks) {
  RECORDING_OR_SKIP(log, "gnss/gr8013-w.log");
  RECORDING_OR_SKIP(chk, "gnss/gr8013-w.log.chk");
  const auto epochs = nmea_epochs(without_comments(log));
  // gpsd took the receiver's true 2015 for a rollover and added 1024 weeks.
  EXPECT_EQ(expect_epochs_as_gpsd(epochs, chk, 1024 * 7), 3U);
  EXPECT_EQ(epochs.at(0).date, (GnssDate{2015, 6, 19}));
}

TEST(Gnss, HeadingLogAgreesWithGpsd) {
  RECORDING_OR_SKIP(log, "gnss/hemi.log");
  RECORDING_OR_SKIP(chk, "gnss/hemi.log.chk");
  std::vector<double> headings, expected;
  std::size_t modes_without_fix = 0, fixes = 0;
  for (const GnssEpoch& epoch : nmea_epochs(without_comments(log))) {
    if (epoch.heading_deg) headings.push_back(*epoch.heading_deg);
    modes_without_fix += epoch.mode == 1;
    fixes += epoch.usable();
  }
  for (const GpsdAtt& att : gpsd_messages<GpsdAtt>(chk)) expected.push_back(*att.heading_deg);
  EXPECT_EQ(headings, expected);
  EXPECT_EQ(headings, (std::vector<double>{274.07, 274.04, 274.12, 274.11}));
  EXPECT_GT(modes_without_fix, 100U);
  EXPECT_EQ(fixes, 21U);  // Sentences GGA with a quality above 0.
}

TEST(Gnss, PositionsOfLogsWithoutDatesAgreeWithGpsd) {
  for (const auto& [name, count] : {std::pair{"gnss/hemi.log", 6U}, {"gnss/tcp-torture.log", 3U}}) {
    RECORDING_OR_SKIP(log, name);
    RECORDING_OR_SKIP(chk, std::string(name) + ".chk");
    std::string stream = without_comments(log);
    std::erase(stream, '|');  // Where the segments end.
    const auto epochs = nmea_epochs(stream);
    // There gpsd's last word is RMC's, of four decimals of a minute.
    const double most_deg = count == 3 ? 0.51e-4 / 60 : 0.51e-9;
    std::size_t compared = 0;
    for (const GpsdTpv& tpv : gpsd_messages<GpsdTpv>(chk)) {
      if (!tpv.latitude_deg) continue;
      ++compared;
      EXPECT_TRUE(
          std::any_of(epochs.begin(), epochs.end(),
                      [&](const GnssEpoch& epoch) {
                        return epoch.usable() &&
                               std::abs(epoch.latitude->deg() - *tpv.latitude_deg) < most_deg &&
                               std::abs(epoch.longitude->deg() - *tpv.longitude_deg) < most_deg;
                      }))
          << name << ' ' << *tpv.latitude_deg;
    }
    EXPECT_EQ(compared, count);
  }
}

TEST(Gpsd, LinesOfOthersPassThroughByName) {
  RECORDING_OR_SKIP(log, "gnss/passthrough.log");
  std::vector<std::string> names;
  for (const auto& other : gpsd_messages<GpsdOther>(without_comments(log)))
    names.push_back(other.name);
  EXPECT_EQ(names, (std::vector<std::string>{"XXX", "YYY", "ZZZ"}));
}

TEST(Gnss, M8nMessagesAgreeWithGpsd) {
  RECORDING_OR_SKIP(log, "gnss/ublox-neo-m8n.log");
  RECORDING_OR_SKIP(chk, "gnss/ublox-neo-m8n.log.chk");
  UbxEpochs grouping;
  std::vector<GnssEpoch> epochs;
  const std::string stream = without_comments(log);
  for (const Bytes& frame : frames_in(as_bytes(stream), look_gnss, kGnssFrameMax))
    for (GnssEpoch& epoch : grouping.add(parse_ubx(frame))) epochs.push_back(epoch);
  if (const auto last = grouping.flush()) epochs.push_back(*last);
  ASSERT_EQ(epochs.size(), 24U);
  std::map<std::string, GpsdTpv> first_of;  // Later ones carry gpsd's own estimates.
  for (const GpsdTpv& tpv : gpsd_messages<GpsdTpv>(chk)) first_of.emplace(tpv.time, tpv);
  std::size_t compared = 0;
  for (const auto& [time, tpv] : first_of) {
    const GnssEpoch at = epoch_of(tpv);
    for (GnssEpoch epoch : epochs) {
      // gpsd states milliseconds.
      if (std::abs(*epoch.time_of_day_ns - *at.time_of_day_ns) > 500'000) continue;
      epoch.correction_age_s = tpv.correction_age_s;
      EXPECT_EQ(epoch.date, at.date);
      expect_as_gpsd(epoch, tpv);
      expect_near(epoch.horizontal_accuracy_m, tpv.eph_m, 0.51e-3, time);
      expect_near(epoch.vertical_accuracy_m, tpv.epv_m, 0.51e-3, time);
      expect_near(epoch.speed_accuracy_mps, tpv.eps_mps, 0.51e-2, time);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 24U);
}

TEST(Gnss, CorrectionsHaveTheTypesAndLengthsThatGpsdSays) {
  RECORDING_OR_SKIP(log, "gnss/rtcm3.log");
  const std::string stream = without_comments(log);
  std::vector<std::pair<int, std::size_t>> got;
  for (const Bytes& frame : frames_in(as_bytes(stream), look_gnss, kGnssFrameMax))
    got.emplace_back(*rtcm3_type(frame), frame.size() - 6);
  EXPECT_EQ(got, (std::vector<std::pair<int, std::size_t>>{{1029, 39}, {1005, 19}}));
}

TEST(Gnss, MixedStreamsComeApart) {
  RECORDING_OR_SKIP(mixed, "gnss/pygpsdata-MIXED-RTCM3.log");
  std::vector<std::string> names;
  const auto decoder = gnss_offline();
  Captured captured;
  captured.bytes = as_bytes(mixed);
  decoder->feed(captured, [&](const Message& m) { names.push_back(m.name); });
  EXPECT_EQ(names, (std::vector<std::string>{"GNGLL", "RTCM3 1005", "RTCM3 4072", "RTCM3 1077",
                                             "RTCM3 1087", "RTCM3 1097", "RTCM3 1127", "RTCM3 1230",
                                             "NAV-PVT", "GNRMC"}));
}

TEST(Gnss, EverythingInAMixedLogIsReadOrNamed) {
  RECORDING_OR_SKIP(mixed, "gnss/pygpsdata-MIXED2.log");
  std::map<std::string, int> names;
  const auto decoder = gnss_offline();
  Captured captured;
  captured.bytes = as_bytes(mixed);
  decoder->feed(captured, [&](const Message& m) { ++names[m.name]; });
  for (const char* name : {"NAV-PVT", "NAV-STATUS", "NAV-DOP", "NAV-COV", "NAV-EOE", "UBX 01 35"})
    EXPECT_EQ(names[name], 1) << name;
  ASSERT_EQ(decoder->skipped().size(), 1U);
  EXPECT_EQ(decoder->skipped().at("no start").bytes, 2U);  // An empty line.
}

TEST(Gnss, AStreamThatBreaksOffGivesWhatWasWhole) {
  RECORDING_OR_SKIP(broken, "gnss/pygpsdata-BADEOF1.log");
  const auto frames = frames_in(as_bytes(broken), look_gnss, kGnssFrameMax);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_TRUE(ubx_nav_pvt(parse_ubx(frames[1])));
}

TEST(Gnss, GpsdsSampleOfEveryKindIsRead) {
  RECORDING_OR_SKIP(log, "gnss/pygpsdata-NMEA.log");
  std::size_t sentences = 0;
  for (const Bytes& frame : frames_in(as_bytes(log), look_gnss, kGnssFrameMax)) {
    EXPECT_TRUE(parse_nmea(frame)) << as_text(frame);
    ++sentences;
  }
  EXPECT_EQ(sentences, static_cast<std::size_t>(std::count(log.begin(), log.end(), '$')));
}

TEST(Gnss, TornSegmentsAreJoined) {
  RECORDING_OR_SKIP(log, "gnss/tcp-torture.log");
  std::string stream = without_comments(log);
  std::vector<std::string> types;
  Resync resync(kGnssFrameMax);
  std::string_view rest = stream;
  while (!rest.empty()) {
    resync.feed(as_bytes(take_field(rest, '|')));
    while (const auto frame = resync.next(look_gnss)) types.push_back(parse_nmea(*frame)->type);
  }
  EXPECT_EQ(types, (std::vector<std::string>{"GGA", "GSA", "GSV", "GSV", "GSV", "RMC", "ZDA"}));
}

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
  EXPECT_EQ(decoder->skipped().at("no JSON object").times, 2U);
}

const Bytes kRtcm1005 = from_hex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98");

TEST(Rtcm3, TheStandardsExampleIsAFrame) {
  EXPECT_EQ(frames_in(kRtcm1005, look_gnss, kGnssFrameMax), std::vector<Bytes>{kRtcm1005});
  EXPECT_EQ(rtcm3_type(kRtcm1005), 1005);
  EXPECT_EQ(encode_rtcm3(ByteView(kRtcm1005).subspan(3, 19)), kRtcm1005);
}

TEST(Gnss, WholeFramesSurviveDamage) {
  const std::vector<Bytes> frames{
      encode_ubx(1, 7, pvt_bytes()),
      kRtcm1005,
      bytes_of(encode_nmea("GPHDT,274.07,T")),
      encode_ubx(0x0A, 4),
      bytes_of(encode_nmea("GNGLL,3203.94995,N,03446.42914,E,084158.00,A,D")),
      encode_rtcm3(from_hex("3ed0")),
      encode_ubx(5, 1, from_hex("068a"))};
  drivers_test::expect_whole_frames_survive(frames, look_gnss, kGnssFrameMax,
                                            from_hex("24 b5 d3 b562 0107 d303 62 2a 30"));
  const std::vector<Bytes> binary{frames[0], frames[1], frames[3], frames[5], frames[6]};
  drivers_test::expect_flips_cost_one_frame(binary, look_gnss, kGnssFrameMax);
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
