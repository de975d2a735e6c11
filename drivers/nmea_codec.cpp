#include "drivers/nmea_codec.hpp"

#include <algorithm>

#include "drivers/text.hpp"

namespace drivers {
namespace {

// Takes fields one after the other; a field that is there but cannot be read spoils the sentence.
class FieldReader {
 public:
  explicit FieldReader(std::string_view rest) : rest_(rest), more_(true) {}

  bool ok() const { return ok_; }
  bool more() const { return more_; }

  std::string_view next() {
    if (!more_) return {};
    more_ = rest_.find(',') != std::string_view::npos;
    return take_field(rest_, ',');
  }
  std::optional<double> real() {
    return read(next(), [](auto f) { return whole_real(f); });
  }
  std::optional<int> whole() {
    return read(next(), [](auto f) { return whole_number<int>(f); });
  }
  std::optional<int> hex() {
    return read(next(), [](auto f) { return whole_number<int>(f, 16); });
  }
  std::optional<std::int64_t> time() { return read(next(), nmea_time_ns); }
  char letter() {
    const auto field = next();
    return field.empty() ? '\0' : field[0];
  }
  std::optional<ExactAngle> angle(int degrees_max) {
    const auto text = next(), side = next();
    return read(text, [&](auto f) { return nmea_angle(f, side, degrees_max); });
  }
  // Real with its sign in the next field.
  std::optional<double> signed_by(char negative) {
    auto value = real();
    if (letter() == negative && value) value = -*value;
    return value;
  }
  std::optional<GnssDate> date() {
    const auto field = next();
    if (field.empty()) return std::nullopt;
    const auto number = field.size() == 6 ? whole_number<int>(field) : std::nullopt;
    if (!number || *number < 0) return fail(), std::nullopt;
    const int year = *number % 100;
    return checked({year + (year < 80 ? 2000 : 1900), *number / 100 % 100, *number / 10000});
  }
  std::optional<GnssDate> checked(GnssDate date) {
    if (date.month >= 1 && date.month <= 12 && date.day >= 1 && date.day <= 31) return date;
    return fail(), std::nullopt;
  }
  void fail() { ok_ = false; }

 private:
  template <class Parse>
  auto read(std::string_view field, Parse&& parse) -> decltype(parse(field)) {
    if (field.empty()) return std::nullopt;
    const auto value = parse(field);
    if (!value) ok_ = false;
    return value;
  }

  std::string_view rest_;
  bool more_, ok_ = true;
};

NmeaGga read_gga(FieldReader& in) {
  NmeaGga gga;
  gga.time_of_day_ns = in.time();
  gga.latitude = in.angle(90);
  gga.longitude = in.angle(180);
  gga.quality = in.whole();
  gga.satellites = in.whole();
  gga.hdop = in.real();
  gga.altitude_msl_m = in.real();
  in.next();  // "M"
  gga.geoid_separation_m = in.real();
  in.next();  // "M"
  gga.correction_age_s = in.real();
  gga.station = in.whole();
  if (gga.quality && (*gga.quality < 0 || *gga.quality > 8)) in.fail();
  return gga;
}

NmeaRmc read_rmc(FieldReader& in) {
  NmeaRmc rmc;
  rmc.time_of_day_ns = in.time();
  rmc.valid = in.letter() == 'A';
  rmc.latitude = in.angle(90);
  rmc.longitude = in.angle(180);
  rmc.speed_knots = in.real();
  rmc.track_deg = in.real();
  rmc.date = in.date();
  rmc.magnetic_variation_deg = in.signed_by('W');
  rmc.mode = in.letter();
  rmc.navigation_status = in.letter();
  return rmc;
}

NmeaGll read_gll(FieldReader& in) {
  NmeaGll gll;
  gll.latitude = in.angle(90);
  gll.longitude = in.angle(180);
  gll.time_of_day_ns = in.time();
  gll.valid = in.letter() == 'A';
  gll.mode = in.letter();
  return gll;
}

NmeaGst read_gst(FieldReader& in) {
  NmeaGst gst;
  gst.time_of_day_ns = in.time();
  for (auto* value : {&gst.rms, &gst.semi_major_m, &gst.semi_minor_m, &gst.orientation_deg,
                      &gst.latitude_sigma_m, &gst.longitude_sigma_m, &gst.altitude_sigma_m})
    *value = in.real();
  return gst;
}

NmeaVtg read_vtg(FieldReader& in) {
  NmeaVtg vtg;
  for (auto* value : {&vtg.track_deg, &vtg.magnetic_track_deg, &vtg.speed_knots, &vtg.speed_kmph}) {
    *value = in.real();
    in.next();  // "T", "M", "N", "K"
  }
  vtg.mode = in.letter();
  return vtg;
}

NmeaGsa read_gsa(FieldReader& in) {
  NmeaGsa gsa;
  gsa.selection = in.letter();
  gsa.fix = in.whole();
  for (int i = 0; i < 12; ++i)
    if (const auto id = in.whole()) gsa.satellites.push_back(*id);
  gsa.pdop = in.real();
  gsa.hdop = in.real();
  gsa.vdop = in.real();
  gsa.system = in.hex();
  return gsa;
}

NmeaGsv read_gsv(FieldReader& in) {
  NmeaGsv gsv;
  gsv.sentences = in.whole();
  gsv.sentence = in.whole();
  gsv.in_view = in.whole();
  for (int i = 0; i < 4 && in.more(); ++i) {
    const std::string_view id = in.next();
    if (!in.more()) break;  // It was the signal's number.
    const auto number = whole_number<int>(id);
    if (!number && !id.empty()) in.fail();
    NmeaGsv::Satellite satellite{number.value_or(0), in.whole(), in.whole(), in.whole()};
    if (number) gsv.satellites.push_back(satellite);
  }
  return gsv;
}

NmeaZda read_zda(FieldReader& in) {
  NmeaZda zda;
  zda.time_of_day_ns = in.time();
  const auto day = in.whole(), month = in.whole(), year = in.whole();
  if (day && month && year) zda.date = in.checked({*year, *month, *day});
  return zda;
}

NmeaOther read_other(FieldReader& in) {
  NmeaOther other;
  while (in.more()) other.fields.emplace_back(in.next());
  return other;
}

void read_value(NmeaSentence& sentence, FieldReader& in) {
  const std::string& type = sentence.type;
  if (sentence.talker == "P")
    sentence.value = read_other(in);
  else if (type == "GGA")
    sentence.value = read_gga(in);
  else if (type == "RMC")
    sentence.value = read_rmc(in);
  else if (type == "GLL")
    sentence.value = read_gll(in);
  else if (type == "GST")
    sentence.value = read_gst(in);
  else if (type == "VTG")
    sentence.value = read_vtg(in);
  else if (type == "GSA")
    sentence.value = read_gsa(in);
  else if (type == "GSV")
    sentence.value = read_gsv(in);
  else if (type == "HDT")
    sentence.value = NmeaHdt{in.real()};
  else if (type == "ZDA")
    sentence.value = read_zda(in);
  else
    sentence.value = read_other(in);
}

// Digits with a point somewhere as a whole number of 10^-9.
std::optional<std::int64_t> nano_decimal(std::string_view text) {
  const auto point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  std::string_view part = point == std::string_view::npos ? "" : text.substr(point + 1);
  const auto digits = [](std::string_view t) {
    return std::all_of(t.begin(), t.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  if (whole.empty() || whole.size() > 6 || !digits(whole) || !digits(part)) return std::nullopt;
  std::int64_t value = *whole_number<std::int64_t>(whole);
  for (std::size_t i = 0; i < 9; ++i) value = value * 10 + (i < part.size() ? part[i] - '0' : 0);
  return value;
}

constexpr std::int64_t kNano = 1'000'000'000;

}  // namespace

std::optional<ExactAngle> nmea_angle(std::string_view text, std::string_view side,
                                     int degrees_max) {
  const auto value = nano_decimal(text);  // dddmm.mmmm
  if (!value || side.size() != 1) return std::nullopt;
  const std::int64_t degrees = *value / (100 * kNano), minutes = *value % (100 * kNano);
  if (minutes >= 60 * kNano) return std::nullopt;
  const std::int64_t angle = degrees * 60 * kNano + minutes;
  if (angle > degrees_max * 60 * kNano) return std::nullopt;
  const bool latitude = degrees_max == 90;
  const char positive = latitude ? 'N' : 'E', negative = latitude ? 'S' : 'W';
  if (side[0] == positive) return ExactAngle{angle};
  return side[0] == negative ? std::optional(ExactAngle{-angle}) : std::nullopt;
}

std::optional<std::int64_t> nmea_time_ns(std::string_view text) {
  const auto value = nano_decimal(text);  // hhmmss.sss
  if (!value) return std::nullopt;
  const std::int64_t seconds = *value % (100 * kNano), hhmm = *value / (100 * kNano);
  if (seconds >= 61 * kNano || hhmm % 100 >= 60 || hhmm / 100 >= 24) return std::nullopt;
  return (hhmm / 100 * 3600 + hhmm % 100 * 60) * kNano + seconds;
}

std::optional<NmeaSentence> parse_nmea(ByteView frame) {
  std::string_view text = as_text(frame);
  text = text.substr(0, text.rfind('*'));
  if (text.size() < 6) return std::nullopt;
  text.remove_prefix(1);
  const std::string_view address = take_field(text, ',');
  NmeaSentence sentence;
  const std::size_t talker = address.starts_with('P') ? 1 : 2;
  if (address.size() < talker + 1) return std::nullopt;
  sentence.talker = address.substr(0, talker);
  sentence.type = address.substr(talker);
  FieldReader in(text);
  read_value(sentence, in);
  return in.ok() ? std::optional(std::move(sentence)) : std::nullopt;
}

std::string encode_nmea(std::string_view text) {
  std::uint8_t sum = 0;
  for (const char c : text) sum = static_cast<std::uint8_t>(sum ^ static_cast<std::uint8_t>(c));
  std::string sentence = "$" + std::string(text) + "*";
  sentence += "0123456789ABCDEF"[sum >> 4];
  sentence += "0123456789ABCDEF"[sum & 15];
  return sentence + "\r\n";
}

}  // namespace drivers
