#include "drivers/gpsd_codec.hpp"

#include <algorithm>
#include <boost/json/monotonic_resource.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <cmath>

#include "drivers/nmea_codec.hpp"
#include "drivers/offline_fields.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

namespace json = boost::json;

// Null where the text is no JSON.
json::value parse_object(std::string_view text, json::monotonic_resource* resource) {
  json::error_code error;
  json::parse_options options;
  options.max_depth = 8;
  json::value value =
      json::parse(json::string_view(text.data(), text.size()), error, resource, options);
  return error ? json::value() : value;
}

class Keys {
 public:
  explicit Keys(const json::object& object) : object_(object) {}

  std::string text(std::string_view key) const {
    const json::value* value = find(key);
    const json::string* text = value != nullptr ? value->if_string() : nullptr;
    return text != nullptr ? std::string(text->begin(), text->end()) : std::string();
  }
  std::optional<double> real(std::string_view key) const {
    const json::value* value = find(key);
    if (value == nullptr || !value->is_number()) return std::nullopt;
    const double number = value->to_number<double>();
    return std::isfinite(number) ? std::optional(number) : std::nullopt;
  }
  std::optional<int> whole(std::string_view key) const {
    const json::value* value = find(key);
    if (value == nullptr) return std::nullopt;
    json::error_code error;
    const int number = value->to_number<int>(error);
    return error ? std::nullopt : std::optional(number);
  }
  bool yes(std::string_view key) const {
    const json::value* value = find(key);
    return value != nullptr && value->is_bool() && value->get_bool();
  }
  const json::value* find(std::string_view key) const {
    return object_.if_contains(json::string_view(key.data(), key.size()));
  }

 private:
  const json::object& object_;
};

GpsdTpv read_tpv(const Keys& in) {
  GpsdTpv tpv;
  tpv.device = in.text("device");
  tpv.time = in.text("time");
  tpv.mode = std::clamp(in.whole("mode").value_or(0), 0, 3);
  tpv.status = in.whole("status");
  const std::pair<std::string_view, std::optional<double>*> reals[] = {
      {"lat", &tpv.latitude_deg},
      {"lon", &tpv.longitude_deg},
      {"altHAE", &tpv.altitude_ellipsoid_m},
      {"altMSL", &tpv.altitude_msl_m},
      {"geoidSep", &tpv.geoid_separation_m},
      {"track", &tpv.track_deg},
      {"speed", &tpv.speed_mps},
      {"climb", &tpv.climb_mps},
      {"ept", &tpv.ept_s},
      {"epx", &tpv.epx_m},
      {"epy", &tpv.epy_m},
      {"epv", &tpv.epv_m},
      {"eph", &tpv.eph_m},
      {"sep", &tpv.sep_m},
      {"eps", &tpv.eps_mps},
      {"epc", &tpv.epc_mps},
      {"epd", &tpv.epd_deg},
      {"dgpsAge", &tpv.correction_age_s}};
  for (const auto& [key, value] : reals) *value = in.real(key);
  tpv.correction_station = in.whole("dgpsSta");
  tpv.leap_seconds = in.whole("leapseconds");
  return tpv;
}

GpsdSky::Satellite read_satellite(const Keys& in) {
  return {in.whole("PRN").value_or(0),
          in.whole("gnssid"),
          in.whole("svid"),
          in.real("el"),
          in.real("az"),
          in.real("ss"),
          in.yes("used")};
}

GpsdSky read_sky(const Keys& in) {
  GpsdSky sky;
  sky.device = in.text("device");
  sky.time = in.text("time");
  const std::pair<std::string_view, std::optional<double>*> reals[] = {
      {"xdop", &sky.xdop}, {"ydop", &sky.ydop}, {"vdop", &sky.vdop}, {"tdop", &sky.tdop},
      {"hdop", &sky.hdop}, {"gdop", &sky.gdop}, {"pdop", &sky.pdop}};
  for (const auto& [key, value] : reals) *value = in.real(key);
  sky.seen = in.whole("nSat");
  sky.used = in.whole("uSat");
  const json::value* list = in.find("satellites");
  if (list == nullptr || !list->is_array()) return sky;
  for (const json::value& item : list->get_array())
    if (item.is_object()) sky.satellites.push_back(read_satellite(Keys(item.get_object())));
  return sky;
}

GpsdDevices read_devices(const Keys& in) {
  GpsdDevices list;
  const json::value* items = in.find("devices");
  if (items == nullptr || !items->is_array()) return list;
  for (const json::value& item : items->get_array()) {
    if (!item.is_object()) continue;
    const Keys keys(item.get_object());
    list.devices.push_back(
        {keys.text("path"), keys.text("driver"), !keys.text("activated").empty()});
  }
  return list;
}

GpsdMessage read_message(const std::string& name, const Keys& in) {
  if (name == "TPV") return read_tpv(in);
  if (name == "SKY") return read_sky(in);
  if (name == "GST")
    return GpsdGst{in.text("device"), in.text("time"),  in.real("rms"),
                   in.real("major"),  in.real("minor"), in.real("orient"),
                   in.real("lat"),    in.real("lon"),   in.real("alt")};
  if (name == "ATT")
    return GpsdAtt{in.text("device"), in.text("time"), in.real("heading"),
                   in.real("pitch"),  in.real("roll"), in.real("yaw")};
  if (name == "VERSION")
    return GpsdVersion{in.text("release"), in.whole("proto_major"), in.whole("proto_minor")};
  if (name == "DEVICES") return read_devices(in);
  if (name == "ERROR") return GpsdError{in.text("message")};
  return GpsdOther{name};
}

GnssQuality quality_of(const GpsdTpv& tpv) {
  if (tpv.mode < 2) return GnssQuality::none;
  switch (tpv.status.value_or(1)) {
    case 2:
      return GnssQuality::differential;
    case 3:
      return GnssQuality::rtk_fixed;
    case 4:
      return GnssQuality::rtk_float;
    case 5:
    case 6:
      return GnssQuality::dead_reckoning;
    case 7:
      return GnssQuality::manual;
    case 8:
      return GnssQuality::simulated;
    default:
      return GnssQuality::single;
  }
}

// "2019-04-12T00:40:24.000Z"
void read_time(std::string_view iso, GnssEpoch& epoch) {
  if (iso.size() < 20 || iso[4] != '-' || iso[7] != '-' || iso[10] != 'T' || iso.back() != 'Z')
    return;
  const auto year = whole_number<int>(iso.substr(0, 4)),
             month = whole_number<int>(iso.substr(5, 2)), day = whole_number<int>(iso.substr(8, 2));
  std::string digits;
  for (const char c : iso.substr(11, iso.size() - 12))
    if (c != ':') digits += c;
  if (!year || !month || !day) return;
  epoch.date = GnssDate{*year, *month, *day};
  epoch.time_of_day_ns = nmea_time_ns(digits);
}

// Degrees that were written with 9 decimals.
std::optional<ExactAngle> exact(std::optional<double> degrees, double most) {
  if (!degrees || !(std::abs(*degrees) <= most)) return std::nullopt;
  return ExactAngle::from_1e9deg(std::llround(*degrees * 1e9));
}

std::optional<double> sigma(std::optional<double> p95) {
  return p95 ? std::optional(*p95 / 1.96) : std::nullopt;
}

}  // namespace

Look look_gpsd(ByteView front) {
  const auto line_end = std::find(front.begin(), front.end(), '\n');
  const auto size = static_cast<std::size_t>(line_end - front.begin());
  if (front[0] != '{') {
    const auto next = std::find(front.begin(), line_end, '{');
    const auto skip = static_cast<std::size_t>(next - front.begin());
    return Look::none("no JSON", std::min(skip == size ? size + 1 : skip, front.size()));
  }
  if (line_end == front.end()) return Look::more();
  unsigned char memory[8192];
  json::monotonic_resource resource(memory, sizeof memory);
  const std::string_view line = as_text(front.first(size));
  if (parse_object(line, &resource).is_object()) return Look::frame(size + 1);
  // A line that was cut, and the next one run into it.
  const auto inner = line.find("{\"class\":", 1);
  return Look::none("no JSON object", inner == std::string_view::npos ? size + 1 : inner);
}

std::optional<GpsdMessage> parse_gpsd(ByteView line) {
  unsigned char memory[8192];
  json::monotonic_resource resource(memory, sizeof memory);
  const json::value value = parse_object(as_text(line), &resource);
  if (!value.is_object()) return std::nullopt;
  const Keys keys(value.get_object());
  const std::string name = keys.text("class");
  return name.empty() ? std::nullopt : std::optional(read_message(name, keys));
}

GnssEpoch epoch_of(const GpsdTpv& tpv) {
  GnssEpoch epoch;
  epoch.mode = std::max(tpv.mode, 1);
  epoch.quality = quality_of(tpv);
  read_time(tpv.time, epoch);
  epoch.latitude = exact(tpv.latitude_deg, 90);
  epoch.longitude = exact(tpv.longitude_deg, 180);
  epoch.altitude_msl_m = tpv.altitude_msl_m;
  epoch.altitude_ellipsoid_m = tpv.altitude_ellipsoid_m;
  epoch.geoid_separation_m = tpv.geoid_separation_m;
  epoch.speed_mps = tpv.speed_mps;
  epoch.track_deg = tpv.track_deg;
  epoch.climb_mps = tpv.climb_mps;
  epoch.sigma_east_m = sigma(tpv.epx_m);
  epoch.sigma_north_m = sigma(tpv.epy_m);
  epoch.sigma_up_m = sigma(tpv.epv_m);
  epoch.horizontal_accuracy_m = tpv.eph_m;
  epoch.vertical_accuracy_m = tpv.epv_m;
  epoch.speed_accuracy_mps = tpv.eps_mps;
  epoch.correction_age_s = tpv.correction_age_s;
  epoch.correction_station = tpv.correction_station;
  return epoch;
}

}  // namespace drivers
