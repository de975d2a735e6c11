#include <algorithm>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "drivers/ouster_codec.hpp"

namespace drivers {
namespace {

namespace json = boost::json;

constexpr std::size_t kRowsMax = 256, kColumnsPerPacketMax = 64, kColumnsPerFrameMax = 8192;

// Reads keys that older firmware keeps at the top and newer in groups; keeps the first problem.
class Reader {
 public:
  explicit Reader(const json::object& root) : root_(root) {}

  const json::value* find(std::string_view group, std::string_view key) const {
    const json::value* in = root_.if_contains(json::string_view(group.data(), group.size()));
    if (group == "lidar_data_format" && in == nullptr) in = root_.if_contains("data_format");
    const json::object* object = in != nullptr ? in->if_object() : nullptr;
    const json::string_view name(key.data(), key.size());
    if (object != nullptr)
      if (const json::value* value = object->if_contains(name)) return value;
    return root_.if_contains(name);
  }

  std::size_t count(std::string_view group, std::string_view key, std::size_t most) {
    const json::value* value = find(group, key);
    const auto number = value != nullptr ? whole(*value) : -1;
    if (number < 0 || static_cast<std::size_t>(number) > most || number == 0)
      return blame(key, "must be a number from 1 to " + std::to_string(most)), 1;
    return static_cast<std::size_t>(number);
  }

  std::vector<double> numbers(std::string_view group, std::string_view key, std::size_t size) {
    std::vector<double> all;
    const json::value* value = find(group, key);
    const json::array* array = value != nullptr ? value->if_array() : nullptr;
    if (array != nullptr) append(*array, all);
    if (all.size() == size && array != nullptr) return all;
    blame(key, "must be a list of " + std::to_string(size) + " numbers");
    return std::vector<double>(size);
  }

  std::string text(std::string_view group, std::string_view key, std::string_view fallback) {
    const json::value* value = find(group, key);
    const json::string* text = value != nullptr ? value->if_string() : nullptr;
    return text != nullptr ? std::string(text->begin(), text->end()) : std::string(fallback);
  }

  double number(std::string_view group, std::string_view key) {
    const json::value* value = find(group, key);
    json::error_code error;
    const double number = value != nullptr ? value->to_number<double>(error) : 0;
    if (value == nullptr || error) blame(key, "must be a number");
    return number;
  }

  void blame(std::string_view key, const std::string& what) {
    if (problem.empty()) problem = "metadata: " + std::string(key) + ": " + what;
  }

  std::string problem;

 private:
  static std::int64_t whole(const json::value& value) {
    json::error_code error;
    const auto number = value.to_number<std::int64_t>(error);
    return error ? -1 : number;
  }
  // Beam angles may be a list of lists: one level is flattened.
  static void append(const json::array& array, std::vector<double>& all) {
    for (const json::value& item : array) {
      json::error_code error;
      const double number = item.to_number<double>(error);
      if (error) return all.clear();
      all.push_back(number);
    }
  }

  const json::object& root_;
};

OusterProfile profile_of(Reader& reader) {
  const std::string name = reader.text("lidar_data_format", "udp_profile_lidar", "LEGACY");
  constexpr std::pair<std::string_view, OusterProfile> kKnown[] = {
      {"LEGACY", OusterProfile::legacy},
      {"RNG19_RFL8_SIG16_NIR16", OusterProfile::single},
      {"RNG15_RFL8_NIR8", OusterProfile::low_rate},
      {"RNG19_RFL8_SIG16_NIR16_DUAL", OusterProfile::dual}};
  for (const auto& [known, profile] : kKnown)
    if (known == name) return profile;
  reader.blame("udp_profile_lidar", "\"" + name +
                                        "\" is not read; set LEGACY, RNG19_RFL8_SIG16_NIR16, "
                                        "RNG15_RFL8_NIR8 or RNG19_RFL8_SIG16_NIR16_DUAL");
  return {};
}

void read_format(Reader& in, OusterMetadata& m) {
  constexpr auto kFormat = "lidar_data_format";
  m.profile = profile_of(in);
  m.rows = in.count(kFormat, "pixels_per_column", kRowsMax);
  m.columns_per_packet = in.count(kFormat, "columns_per_packet", kColumnsPerPacketMax);
  m.columns_per_frame = in.count(kFormat, "columns_per_frame", kColumnsPerFrameMax);
  m.pixel_shift_by_row.clear();
  for (const double shift : in.numbers(kFormat, "pixel_shift_by_row", m.rows)) {
    if (!(std::abs(shift) <= static_cast<double>(kColumnsPerFrameMax)))
      return in.blame("pixel_shift_by_row", "is out of range");
    m.pixel_shift_by_row.push_back(static_cast<int>(shift));
  }
  const auto window = in.numbers(kFormat, "column_window", 2);
  for (std::size_t i = 0; i < 2; ++i) {
    if (!(window[i] >= 0 && window[i] < static_cast<double>(m.columns_per_frame)))
      return in.blame("column_window", "must lie within the columns of a frame");
    m.column_window[i] = static_cast<std::size_t>(window[i]);
  }
}

}  // namespace

std::string parse_ouster_metadata(std::string_view text, OusterMetadata& into) {
  json::error_code error;
  const json::value root = json::parse(json::string_view(text.data(), text.size()), error);
  if (error) return "metadata: no JSON: " + error.message();
  if (!root.is_object()) return "metadata: must be an object";
  Reader in(root.get_object());
  read_format(in, into);
  into.beam_altitude_deg = in.numbers("beam_intrinsics", "beam_altitude_angles", into.rows);
  into.beam_azimuth_deg = in.numbers("beam_intrinsics", "beam_azimuth_angles", into.rows);
  into.beam_origin_mm = in.number("beam_intrinsics", "lidar_origin_to_beam_origin_mm");
  const auto matrix = in.numbers("lidar_intrinsics", "lidar_to_sensor_transform", 16);
  std::copy_n(matrix.begin(), 16, into.lidar_to_sensor_mm.begin());
  into.model = in.text("sensor_info", "prod_line", "");
  into.serial_number = in.text("sensor_info", "prod_sn", "");
  into.firmware = in.text("sensor_info", "build_rev", "");
  into.lidar_mode = in.text("config_params", "lidar_mode", "");
  return in.problem;
}

}  // namespace drivers
