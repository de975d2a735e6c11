#include "drivers/vn100_codec.hpp"

#include <algorithm>
#include <bit>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr std::uint8_t kSync = 0xFA;
constexpr std::size_t kPacketMax = 600;

// By how many bytes follow, for four at a time.
using CrcTables = std::array<std::array<std::uint16_t, 256>, 4>;
constexpr CrcTables make_crc16() {
  CrcTables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1;
    tables[0][byte] = static_cast<std::uint16_t>(crc);
  }
  for (std::size_t after = 1; after < 4; ++after)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint16_t crc = tables[after - 1][byte];
      tables[after][byte] = static_cast<std::uint16_t>(crc << 8 ^ tables[0][crc >> 8]);
    }
  return tables;
}
constexpr auto kCrc16 = make_crc16();

// Reads fields in their order; all of them are known to be there.
class Packed {
 public:
  explicit Packed(ByteView bytes) : rest_(bytes) {}

  template <class T>
  T take() {
    const T value = little<T>(rest_, 0);
    rest_ = rest_.subspan(sizeof(T));
    return value;
  }
  template <std::size_t kSize>
  std::array<float, kSize> floats() {
    std::array<float, kSize> values;
    for (float& value : values) value = take<float>();
    return values;
  }
  void skip(std::size_t size) { rest_ = rest_.subspan(size); }

 private:
  ByteView rest_;
};

using S = Vn100Sample;
struct FieldSpec {
  std::size_t size;
  void (*read)(Packed&, S&);  // Null: passed over.
};

template <auto kMember>
void read_vector(Packed& in, S& s) {
  s.*kMember = in.floats<3>();
}
template <auto kMember, class T>
void read_number(Packed& in, S& s) {
  s.*kMember = in.take<T>();
}
void read_raw_imu(Packed& in, S& s) {
  s.raw_accel_mps2 = in.floats<3>();
  s.raw_rate_radps = in.floats<3>();
}
void read_mag_pres(Packed& in, S& s) {
  s.magnetic_gauss = in.floats<3>();
  s.temperature_c = in.take<float>();
  s.pressure_kpa = in.take<float>();
}
void read_delta(Packed& in, S& s) {
  s.delta_time_s = in.take<float>();
  s.delta_theta_deg = in.floats<3>();
  s.delta_velocity_mps = in.floats<3>();
}
void read_delta_theta(Packed& in, S& s) {
  s.delta_time_s = in.take<float>();
  s.delta_theta_deg = in.floats<3>();
}
void read_quaternion(Packed& in, S& s) {
  s.quaternion = in.floats<4>();
}
void read_rotation(Packed& in, S& s) {
  s.rotation = in.floats<9>();
}

constexpr FieldSpec kCommon[] = {{8, read_number<&S::startup_ns, std::uint64_t>},
                                 {8, nullptr},  // GPS time: not of this device.
                                 {8, read_number<&S::sync_in_ns, std::uint64_t>},
                                 {12, read_vector<&S::yaw_pitch_roll_deg>},
                                 {16, read_quaternion},
                                 {12, read_vector<&S::rate_radps>},
                                 {24, nullptr},  // Position and velocity: not of this device.
                                 {12, nullptr},
                                 {12, read_vector<&S::accel_mps2>},
                                 {24, read_raw_imu},
                                 {20, read_mag_pres},
                                 {28, read_delta},
                                 {2, read_number<&S::vpe_status, std::uint16_t>},
                                 {4, read_number<&S::sync_in_count, std::uint32_t>},
                                 {8, nullptr}};
constexpr FieldSpec kImu[] = {{2, read_number<&S::imu_status, std::uint16_t>},
                              {12, read_vector<&S::raw_magnetic_gauss>},
                              {12, read_vector<&S::raw_accel_mps2>},
                              {12, read_vector<&S::raw_rate_radps>},
                              {4, read_number<&S::temperature_c, float>},
                              {4, read_number<&S::pressure_kpa, float>},
                              {16, read_delta_theta},
                              {12, read_vector<&S::delta_velocity_mps>},
                              {12, read_vector<&S::magnetic_gauss>},
                              {12, read_vector<&S::accel_mps2>},
                              {12, read_vector<&S::rate_radps>},
                              {2, read_number<&S::saturation, std::uint16_t>},
                              {40, nullptr}};
constexpr FieldSpec kAttitude[] = {{2, read_number<&S::vpe_status, std::uint16_t>},
                                   {12, read_vector<&S::yaw_pitch_roll_deg>},
                                   {16, read_quaternion},
                                   {36, read_rotation},
                                   {12, read_vector<&S::magnetic_ned_gauss>},
                                   {12, read_vector<&S::accel_ned_mps2>},
                                   {12, read_vector<&S::linear_body_mps2>},
                                   {12, read_vector<&S::linear_ned_mps2>},
                                   {12, read_vector<&S::yaw_pitch_roll_sigma_deg>}};

// By bit of the groups byte; empty: not of this device.
std::span<const FieldSpec> group_fields(int group) {
  if (group == 0) return kCommon;
  if (group == 2) return kImu;
  return group == 4 ? std::span<const FieldSpec>(kAttitude) : std::span<const FieldSpec>();
}

// Calls see(field) for every field that is set. False where one is not known.
template <class See>
bool for_each_field(ByteView frame, See&& see) {
  std::size_t at = 2;
  for (int group = 0; group < 8; ++group) {
    if ((frame[1] >> group & 1) == 0) continue;
    const auto fields = group_fields(group);
    std::uint32_t bits = little<std::uint16_t>(frame, at);
    at += 2;
    for (; bits != 0; bits &= bits - 1) {
      const auto field = static_cast<std::size_t>(std::countr_zero(bits));
      if (field >= fields.size()) return false;
      see(fields[field]);
    }
  }
  return true;
}

std::size_t header_size(std::uint8_t groups) {
  return 2 + 2 * static_cast<std::size_t>(std::popcount(groups));
}

Look look_binary(ByteView front) {
  if (front.size() < 2) return Look::more();
  if (front[1] == 0 || (front[1] & ~0x15) != 0) return Look::none("group not known");
  const std::size_t header = header_size(front[1]);
  if (front.size() < header) return Look::more();
  std::size_t size = header + 2;
  if (!for_each_field(front, [&](const FieldSpec& field) { size += field.size; }))
    return Look::none("field not known");
  if (size > kPacketMax) return Look::none("length");
  if (front.size() < size) return Look::more();
  return crc16_ccitt(front.subspan(1, size - 1)) == 0 ? Look::frame(size) : Look::none("CRC");
}

bool is_hex(std::uint8_t c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F') || (c >= 'a' && c <= 'f');
}

// Lines end in a checksum of two digits or, where register 30 says so, a CRC of four.
Look look_line(ByteView front) {
  const auto star = std::find_if(front.begin() + 1, front.end(), [](std::uint8_t byte) {
    return byte < 0x20 || byte > 0x7E || byte == '$' || byte == '*';
  });
  if (star != front.end() && *star != '*') return look_gnss(front);
  const auto at = static_cast<std::size_t>(star - front.begin());
  std::size_t digits = 0;
  while (digits < 4 && at + 1 + digits < front.size() && is_hex(front[at + 1 + digits])) ++digits;
  if (star != front.end() && digits < 4 && at + 1 + digits == front.size()) return Look::more();
  if (digits < 4) return look_gnss(front);
  const auto said = whole_number<std::uint16_t>(as_text(front.subspan(at + 1, 4)), 16);
  if (said != crc16_ccitt(front.subspan(1, at - 1))) return Look::none("line CRC");
  const ByteView rest = front.subspan(at + 5);
  if (rest.empty() || (rest.size() == 1 && rest[0] == '\r')) return Look::more();
  const std::size_t end = rest[0] == '\n' ? 1 : rest[0] == '\r' && rest[1] == '\n' ? 2 : 0;
  return Look::frame(at + 5 + end);
}

constexpr Fault kErrors[] = {
    {1, "hard fault", "the device's processor stopped", "it restarts: configure it again"},
    {2, "serial buffer overflow", "requests come too fast", "wait for each answer"},
    {3, "invalid checksum", "a request was damaged", "send it again, check the line"},
    {4, "invalid command", "the firmware has no such command", "check the firmware"},
    {5, "not enough parameters", "a value is missing", "send all values"},
    {6, "too many parameters", "a value too many", "send fewer values"},
    {7, "invalid parameter", "a value is not allowed", "correct the setting"},
    {8, "invalid register", "the firmware has no such register", "check the firmware"},
    {9, "unauthorised access", "the register is protected", "do not write it"},
    {10, "watchdog reset", "the device restarted itself", "configure it again"},
    {11, "output buffer overflow", "more is sent than fits", "lower the rate, raise the baud rate"},
    {12, "insufficient baud rate", "the output does not fit",
     "lower the rate, raise the baud rate"},
    {255, "error buffer overflow", "too many errors to tell", "restart the device"}};

constexpr Fault kAttitudeQuality[] = {
    {2, "attitude bad", "shocks or disturbances", "wait at standstill"},
    {3, "attitude lost", "the filter does not follow", "wait at standstill, then restart it"}};
constexpr Fault kVpe[] = {
    {1U << 2, "gyroscope saturated", "turns faster than it measures", "mount it softer"},
    {1U << 3, "gyroscope recovering", "just after saturation", "wait"},
    {1U << 6, "magnetometer saturated", "a magnet is near", "move it away"},
    {1U << 9, "accelerometer saturated", "shocks harder than it measures", "mount it softer"},
    {1U << 11, "known magnetic disturbance", "it was told so", "tell it when it is over"},
    {1U << 12, "known acceleration disturbance", "it was told so", "tell it when it is over"}};
constexpr Fault kMagneticDisturbance{1, "magnetic disturbance", "iron or currents near",
                                     "do not trust the heading here"};
constexpr Fault kAccelDisturbance{1, "acceleration disturbance", "the robot accelerates or shakes",
                                  "wait at standstill"};

std::optional<Vn100Vector> three(const std::vector<std::string>& fields, std::size_t at) {
  Vn100Vector values;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = at + i < fields.size() ? whole_real(fields[at + i]) : std::nullopt;
    if (!value) return std::nullopt;
    values[i] = static_cast<float>(*value);
  }
  return values;
}

}  // namespace

std::uint16_t crc16_ccitt(ByteView bytes) {
  std::uint16_t crc = 0;
  std::size_t at = 0;
  for (; at + 4 <= bytes.size(); at += 4)
    crc = kCrc16[3][crc >> 8 ^ bytes[at]] ^ kCrc16[2][(crc & 0xFF) ^ bytes[at + 1]] ^
          kCrc16[1][bytes[at + 2]] ^ kCrc16[0][bytes[at + 3]];
  for (; at < bytes.size(); ++at)
    crc = static_cast<std::uint16_t>(crc << 8 ^ kCrc16[0][crc >> 8 ^ bytes[at]]);
  return crc;
}

Look look_vn100(ByteView front) {
  if (front[0] == kSync) return look_binary(front);
  if (front[0] == '$') return look_line(front);
  const auto next = std::find_if(front.begin(), front.end(),
                                 [](std::uint8_t byte) { return byte == kSync || byte == '$'; });
  return Look::none("no start", static_cast<std::size_t>(next - front.begin()));
}

Vn100Sample decode_vn100_binary(ByteView frame) {
  Vn100Sample sample;
  Packed in(frame.subspan(header_size(frame[1])));
  for_each_field(frame, [&](const FieldSpec& field) {
    field.read != nullptr ? field.read(in, sample) : in.skip(field.size);
  });
  return sample;
}

std::optional<Vn100Line> parse_vn100_line(ByteView frame) {
  std::string_view text = as_text(frame);
  text = text.substr(1, text.rfind('*') - 1);
  Vn100Line line;
  line.type = take_field(text, ',');
  if (!line.type.starts_with("VN")) return std::nullopt;
  while (!text.empty()) {
    const std::string_view field = take_field(text, ',');
    if (field.starts_with('T') && text.empty())
      line.time_ms = whole_number<std::uint32_t>(field.substr(1));
    else if (field.starts_with('S') && text.empty())
      line.status = whole_number<std::uint16_t>(field.substr(1), 16);
    else
      line.fields.emplace_back(field);
  }
  return line;
}

std::optional<Vn100Sample> vn100_sample(const Vn100Line& line) {
  const bool all = line.type == "VNYMR";
  if (!all && line.type != "VNYPR") return std::nullopt;
  if (line.fields.size() != (all ? 12U : 3U)) return std::nullopt;
  Vn100Sample sample;
  sample.yaw_pitch_roll_deg = three(line.fields, 0);
  if (!sample.yaw_pitch_roll_deg) return std::nullopt;
  if (!all) return sample;
  sample.magnetic_gauss = three(line.fields, 3);
  sample.accel_mps2 = three(line.fields, 6);
  sample.rate_radps = three(line.fields, 9);
  const bool whole = sample.magnetic_gauss && sample.accel_mps2 && sample.rate_radps;
  return whole ? std::optional(sample) : std::nullopt;
}

const Fault* vn100_error(const Vn100Line& line) {
  if (line.type != "VNERR" || line.fields.empty()) return nullptr;
  const auto code = whole_number<std::uint32_t>(line.fields[0], 16);
  return code ? fault_of(kErrors, *code) : nullptr;
}

std::vector<const Fault*> vn100_faults(std::uint16_t vpe) {
  std::vector<const Fault*> found;
  if (const Fault* fault = fault_of(kAttitudeQuality, vpe & 3U)) found.push_back(fault);
  for (const Fault* fault : faults_set(kVpe, vpe)) found.push_back(fault);
  if ((vpe >> 4 & 3) != 0) found.push_back(&kMagneticDisturbance);
  if ((vpe >> 7 & 3) != 0) found.push_back(&kAccelDisturbance);
  return found;
}

Bytes vn100_request(std::string_view text) {
  const std::string line = encode_nmea(text);
  return {line.begin(), line.end()};
}

Bytes vn100_output_request(int reg, const Vn100Output& output) {
  const auto hex = [](std::uint32_t value, int digits) {
    std::string text;
    for (int shift = 4 * digits - 4; shift >= 0; shift -= 4)
      text += "0123456789ABCDEF"[value >> shift & 15U];
    return text;
  };
  const std::uint16_t fields[] = {output.common, output.imu, output.attitude};
  std::uint32_t groups = 0;
  std::string words;
  for (int i = 0; i < 3; ++i) {
    if (fields[i] == 0) continue;
    groups |= 1U << (2 * i);
    words += "," + hex(fields[i], 4);
  }
  return vn100_request("VNWRG," + std::to_string(reg) + "," + std::to_string(output.port) + "," +
                       std::to_string(output.divisor) + "," + hex(groups, 2) + words);
}

std::vector<Bytes> vn100_startup(const Vn100Output& output) {
  std::vector<Bytes> requests;
  for (const auto text : {"VNASY,0", "VNRRG,01", "VNRRG,03", "VNRRG,04", "VNWRG,06,0"})
    requests.push_back(vn100_request(text));
  requests.push_back(vn100_output_request(75, output));
  requests.push_back(vn100_request("VNASY,1"));
  return requests;
}

}  // namespace drivers
