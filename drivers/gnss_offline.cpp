// Receivers' streams and gpsd's lines for people.
#include <utility>

#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_codec.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/offline_stream.hpp"
#include "drivers/text.hpp"
#include "drivers/ubx_codec.hpp"

namespace drivers {
namespace {

void add_angle(Fields& f, const std::string& name, const std::optional<ExactAngle>& angle) {
  if (angle) f.add(name, angle->deg());
}
void add_time(Fields& f, const std::optional<std::int64_t>& time_ns) {
  if (time_ns) f.add("time_of_day_s", static_cast<double>(*time_ns) / 1e9);
}
void add_date(Fields& f, const std::optional<GnssDate>& date) {
  if (date) f.add("year", date->year).add("month", date->month).add("day", date->day);
}
void add_letter(Fields& f, const std::string& name, char letter) {
  if (letter != 0) f.add(name, std::string(1, letter));
}

void say(Fields& f, const NmeaGga& v) {
  add_time(f, v.time_of_day_ns);
  add_angle(f, "latitude_deg", v.latitude);
  add_angle(f, "longitude_deg", v.longitude);
  f.maybe("quality", v.quality).maybe("satellites", v.satellites).maybe("hdop", v.hdop);
  f.maybe("altitude_msl_m", v.altitude_msl_m).maybe("geoid_separation_m", v.geoid_separation_m);
  f.maybe("correction_age_s", v.correction_age_s).maybe("station", v.station);
}
void say(Fields& f, const NmeaRmc& v) {
  add_time(f, v.time_of_day_ns);
  add_date(f, v.date);
  f.add("valid", v.valid);
  add_angle(f, "latitude_deg", v.latitude);
  add_angle(f, "longitude_deg", v.longitude);
  f.maybe("speed_knots", v.speed_knots).maybe("track_deg", v.track_deg);
  f.maybe("magnetic_variation_deg", v.magnetic_variation_deg);
  add_letter(f, "mode", v.mode);
  add_letter(f, "navigation_status", v.navigation_status);
}
void say(Fields& f, const NmeaGll& v) {
  add_time(f, v.time_of_day_ns);
  f.add("valid", v.valid);
  add_angle(f, "latitude_deg", v.latitude);
  add_angle(f, "longitude_deg", v.longitude);
  add_letter(f, "mode", v.mode);
}
void say(Fields& f, const NmeaGst& v) {
  add_time(f, v.time_of_day_ns);
  f.maybe("rms", v.rms).maybe("semi_major_m", v.semi_major_m);
  f.maybe("semi_minor_m", v.semi_minor_m).maybe("orientation_deg", v.orientation_deg);
  f.maybe("latitude_sigma_m", v.latitude_sigma_m).maybe("longitude_sigma_m", v.longitude_sigma_m);
  f.maybe("altitude_sigma_m", v.altitude_sigma_m);
}
void say(Fields& f, const NmeaVtg& v) {
  f.maybe("track_deg", v.track_deg).maybe("magnetic_track_deg", v.magnetic_track_deg);
  f.maybe("speed_knots", v.speed_knots).maybe("speed_kmph", v.speed_kmph);
  add_letter(f, "mode", v.mode);
}
void say(Fields& f, const NmeaGsa& v) {
  add_letter(f, "selection", v.selection);
  f.maybe("fix", v.fix).add("satellites", v.satellites);
  f.maybe("pdop", v.pdop).maybe("hdop", v.hdop).maybe("vdop", v.vdop).maybe("system", v.system);
}
void say(Fields& f, const NmeaGsv& v) {
  f.maybe("sentence", v.sentence).maybe("sentences", v.sentences).maybe("in_view", v.in_view);
  for (const auto& satellite : v.satellites)
    f.add("satellite", satellite.id)
        .maybe("elevation_deg", satellite.elevation_deg)
        .maybe("azimuth_deg", satellite.azimuth_deg)
        .maybe("signal_dbhz", satellite.signal_dbhz);
}
void say(Fields& f, const NmeaHdt& v) {
  f.maybe("heading_deg", v.heading_deg);
}
void say(Fields& f, const NmeaZda& v) {
  add_time(f, v.time_of_day_ns);
  add_date(f, v.date);
}
void say(Fields& f, const NmeaOther& v) {
  for (const std::string& field : v.fields) f.add("field", field);
}

void say(Fields& f, const UbxNavPvt& v) {
  f.add("itow_ms", v.itow_ms).add("year", v.year).add("month", v.month).add("day", v.day);
  f.add("hour", v.hour).add("minute", v.minute).add("second", v.second).add("nano", v.nano);
  f.add("time_valid", v.time_valid).add("time_accuracy_ns", v.time_accuracy_ns);
  f.add("fix_type", v.fix_type).add("fix_ok", v.fix_ok).add("differential", v.differential);
  f.add("carrier", static_cast<unsigned>(v.carrier)).add("satellites", v.satellites);
  f.add("longitude_1e7deg", v.longitude_1e7deg).add("latitude_1e7deg", v.latitude_1e7deg);
  f.add("height_mm", v.height_mm).add("height_msl_mm", v.height_msl_mm);
  f.add("horizontal_accuracy_mm", v.horizontal_accuracy_mm);
  f.add("vertical_accuracy_mm", v.vertical_accuracy_mm);
  f.add("north_mmps", v.north_mmps).add("east_mmps", v.east_mmps).add("down_mmps", v.down_mmps);
  f.add("ground_speed_mmps", v.ground_speed_mmps);
  f.add("motion_heading_1e5deg", v.motion_heading_1e5deg);
  f.add("speed_accuracy_mmps", v.speed_accuracy_mmps).add("pdop_centi", v.pdop_centi);
  f.faults(ubx_faults(v));
}
void say(Fields& f, const UbxNavHpposllh& v) {
  f.add("itow_ms", v.itow_ms).add("invalid", v.invalid);
  f.add("longitude_1e9deg", v.longitude_1e9deg).add("latitude_1e9deg", v.latitude_1e9deg);
  f.add("height_01mm", v.height_01mm).add("height_msl_01mm", v.height_msl_01mm);
  f.add("horizontal_accuracy_01mm", v.horizontal_accuracy_01mm);
  f.add("vertical_accuracy_01mm", v.vertical_accuracy_01mm);
}
void say(Fields& f, const UbxNavRelposned& v) {
  f.add("itow_ms", v.itow_ms).add("station", v.station).add("north_01mm", v.north_01mm);
  f.add("east_01mm", v.east_01mm).add("down_01mm", v.down_01mm).add("length_01mm", v.length_01mm);
  f.add("heading_1e5deg", v.heading_1e5deg).add("heading_valid", v.heading_valid);
  f.add("carrier", static_cast<unsigned>(v.carrier)).add("position_valid", v.position_valid);
}
void say(Fields& f, const UbxNavStatus& v) {
  f.add("itow_ms", v.itow_ms).add("fix_type", v.fix_type).add("flags", v.flags);
  f.add("first_fix_ms", v.first_fix_ms).add("uptime_ms", v.uptime_ms).faults(ubx_faults(v));
}
void say(Fields& f, const UbxNavDop& v) {
  f.add("itow_ms", v.itow_ms).add("geometric_centi", v.geometric).add("position_centi", v.position);
  f.add("time_centi", v.time).add("vertical_centi", v.vertical);
  f.add("horizontal_centi", v.horizontal).add("northing_centi", v.northing);
  f.add("easting_centi", v.easting);
}
void say(Fields& f, const UbxNavCov& v) {
  f.add("itow_ms", v.itow_ms).add("position_valid", v.position_valid);
  f.add("velocity_valid", v.velocity_valid).add("position_m2", v.position_m2);
  f.add("velocity_m2ps2", v.velocity_m2ps2);
}
void say(Fields& f, const UbxNavEoe& v) {
  f.add("itow_ms", v.itow_ms);
}
void say(Fields& f, const UbxMonVer& v) {
  f.add("software", v.software).add("hardware", v.hardware);
  for (const std::string& extension : v.extensions) f.add("extension", extension);
}
void say(Fields& f, const UbxMonRf& v) {
  for (const auto& block : v.blocks)
    f.add("block", block.id)
        .add("jamming", block.jamming)
        .add("antenna", block.antenna)
        .add("noise", block.noise)
        .add("gain", block.gain)
        .faults(ubx_faults(block));
}
void say(Fields& f, const UbxRxmRtcm& v) {
  f.add("type", v.type).add("station", v.station).add("crc_failed", v.crc_failed);
  f.add("used", v.used).faults(ubx_faults(v));
}
void say(Fields& f, const UbxAck& v) {
  f.add("accepted", v.accepted).add("class", v.cls).add("id", v.id);
}

void say(Fields&, const GpsdOther&) {}
void say(Fields& f, const GpsdTpv& v) {
  f.add("time", v.time).add("mode", v.mode).maybe("status", v.status);
  f.maybe("latitude_deg", v.latitude_deg).maybe("longitude_deg", v.longitude_deg);
  f.maybe("altitude_ellipsoid_m", v.altitude_ellipsoid_m).maybe("altitude_msl_m", v.altitude_msl_m);
  f.maybe("track_deg", v.track_deg).maybe("speed_mps", v.speed_mps).maybe("climb_mps", v.climb_mps);
  f.maybe("epx_m", v.epx_m).maybe("epy_m", v.epy_m).maybe("epv_m", v.epv_m).maybe("eph_m", v.eph_m);
  f.maybe("correction_age_s", v.correction_age_s);
}
void say(Fields& f, const GpsdSky& v) {
  f.add("time", v.time).maybe("hdop", v.hdop).maybe("vdop", v.vdop).maybe("pdop", v.pdop);
  f.maybe("seen", v.seen).maybe("used", v.used);
  std::vector<double> used;
  for (const auto& satellite : v.satellites)
    if (satellite.used) used.push_back(satellite.prn);
  f.add("used_prn", used);
}
void say(Fields& f, const GpsdGst& v) {
  f.add("time", v.time).maybe("rms", v.rms).maybe("latitude_sigma_m", v.latitude_sigma_m);
  f.maybe("longitude_sigma_m", v.longitude_sigma_m).maybe("altitude_sigma_m", v.altitude_sigma_m);
}
void say(Fields& f, const GpsdAtt& v) {
  f.add("time", v.time).maybe("heading_deg", v.heading_deg).maybe("pitch_deg", v.pitch_deg);
  f.maybe("roll_deg", v.roll_deg).maybe("yaw_deg", v.yaw_deg);
}
void say(Fields& f, const GpsdVersion& v) {
  f.add("release", v.release).maybe("protocol_major", v.protocol_major);
  f.maybe("protocol_minor", v.protocol_minor);
}
void say(Fields& f, const GpsdError& v) {
  f.add("message", v.message);
}

void say(Fields& f, const GpsdDevices& v) {
  for (const GpsdDevice& device : v.devices)
    f.add("path", device.path).add("driver", device.driver).add("active", device.active);
}

template <class T>
bool try_ubx(Message& out, const std::string& name, const std::optional<T>& value) {
  if (!value) return false;
  out.name = name;
  Fields fields(out);
  say(fields, *value);
  return true;
}

void say_ubx(Message& out, ByteView frame) {
  const UbxMessage m = parse_ubx(frame);
  if (try_ubx(out, "NAV-PVT", ubx_nav_pvt(m)) ||
      try_ubx(out, "NAV-HPPOSLLH", ubx_nav_hpposllh(m)) ||
      try_ubx(out, "NAV-RELPOSNED", ubx_nav_relposned(m)) ||
      try_ubx(out, "NAV-STATUS", ubx_nav_status(m)) || try_ubx(out, "NAV-DOP", ubx_nav_dop(m)) ||
      try_ubx(out, "NAV-COV", ubx_nav_cov(m)) || try_ubx(out, "NAV-EOE", ubx_nav_eoe(m)) ||
      try_ubx(out, "MON-VER", ubx_mon_ver(m)) || try_ubx(out, "MON-RF", ubx_mon_rf(m)) ||
      try_ubx(out, "RXM-RTCM", ubx_rxm_rtcm(m)) ||
      try_ubx(out, m.id == 1 ? "ACK-ACK" : "ACK-NAK", ubx_ack(m)))
    return;
  out.name = "UBX " + hex_text(Bytes{m.cls}) + " " + hex_text(Bytes{m.id});
  Fields(out).add("payload", hex_text(m.payload));
}

void say_rtcm3(Message& out, ByteView frame) {
  const auto type = rtcm3_type(frame);
  out.name = type ? "RTCM3 " + std::to_string(*type) : "RTCM3";
  Fields(out).add("size", frame.size());
}

std::string_view say_nmea(Message& out, ByteView frame) {
  const auto sentence = parse_nmea(frame);
  if (!sentence) return "NMEA field";
  out.name = sentence->talker + sentence->type;
  Fields fields(out);
  std::visit([&](const auto& value) { say(fields, value); }, sentence->value);
  return {};
}

class GnssOffline : public OfflineStream {
 public:
  GnssOffline() : OfflineStream(look_gnss, kGnssFrameMax) {}

 private:
  std::string_view say(ByteView frame, Message& message) override {
    const GnssKind kind = gnss_kind(frame);
    if (kind == GnssKind::nmea) return say_nmea(message, frame);
    kind == GnssKind::ubx ? say_ubx(message, frame) : say_rtcm3(message, frame);
    return {};
  }
};

std::string_view say_gpsd(Message& out, ByteView line) {
  constexpr const char* kNames[] = {"", "TPV", "SKY", "GST", "ATT", "VERSION", "ERROR", "DEVICES"};
  const auto parsed = parse_gpsd(line);
  if (!parsed) return "no class";
  const auto* other = std::get_if<GpsdOther>(&*parsed);
  out.name = other != nullptr ? other->name : kNames[parsed->index()];
  Fields fields(out);
  std::visit([&](const auto& value) { say(fields, value); }, *parsed);
  return {};
}

class GpsdOffline : public OfflineStream {
 public:
  GpsdOffline() : OfflineStream(look_gpsd, kGpsdLineMax) {}

 private:
  std::string_view say(ByteView line, Message& message) override { return say_gpsd(message, line); }
};

}  // namespace

std::unique_ptr<OfflineDecoder> gnss_offline() {
  return std::make_unique<GnssOffline>();
}
std::unique_ptr<OfflineDecoder> gpsd_offline() {
  return std::make_unique<GpsdOffline>();
}

}  // namespace drivers
