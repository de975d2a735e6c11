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

using drivers_test::frames_in;

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

}  // namespace
}  // namespace drivers
