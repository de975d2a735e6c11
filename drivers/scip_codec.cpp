#include "drivers/scip_codec.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>

#include "drivers/offline_stream.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

bool printable(std::uint8_t byte) {
  return byte >= 0x20 && byte <= 0x7E;
}
bool starts_echo(std::uint8_t byte) {
  return (byte >= 'A' && byte <= 'Z') || byte == '%';
}

bool status_line(std::string_view line) {
  return line.size() == 3 && scip_checksum(line.substr(0, 2)) == line[2];
}

// Commands whose replies are read, with what follows the letters. Echoes carry no checksum: what
// is none of these is a cut line with the next one run into it.
bool known_echo(std::string_view line) {
  constexpr std::pair<std::string_view, std::size_t> kCommands[] = {
      {"VV", 0},  {"PP", 0},  {"II", 0},  {"BM", 0},  {"QT", 0},  {"RS", 0},      {"RT", 0},
      {"RB", 0},  {"TM0", 0}, {"TM1", 0}, {"TM2", 0}, {"%ST", 0}, {"SCIP2.0", 0}, {"DL", 0},
      {"CR", 2},  {"SS", 6},  {"GD", 10}, {"GS", 10}, {"GE", 10}, {"HD", 10},     {"HE", 10},
      {"MD", 13}, {"MS", 13}, {"ME", 13}, {"ND", 13}, {"NE", 13}};
  return std::any_of(std::begin(kCommands), std::end(kCommands), [&](const auto& command) {
    const auto& [letters, digits] = command;
    return line.starts_with(letters) && line.size() == letters.size() + digits &&
           std::all_of(line.begin() + static_cast<std::ptrdiff_t>(letters.size()), line.end(),
                       [](char c) { return c >= '0' && c <= '9'; });
  });
}

// Statuses by code; ranges are resolved by scip_fault().
struct CodeFault {
  std::string_view code;
  Fault fault;
};
constexpr CodeFault kCodes[] = {
    {"01", {0, "parameter error", "start step", "choose a step within the device's"}},
    {"02", {0, "parameter error", "end step", "choose a step within the device's"}},
    {"03", {0, "parameter error", "grouping", "choose a grouping of 0 to 99"}},
    {"04", {0, "parameter error", "end beyond the last step", "choose a smaller end step"}},
    {"05", {0, "parameter error", "end before start", "choose an end after the start"}},
    {"06", {0, "parameter error", "interval", "choose an interval of 0 to 9"}},
    {"07", {0, "parameter error", "number of scans", "choose 0 to 99"}},
    {"10", {0, "laser off", "the laser is not lit", "send BM first"}},
    {"98", {0, "resumed", "measuring went on after a fault", "none: watch how often"}},
    {"0A", {0, "cut request", "bytes were lost", "send it again"}},
    {"0B", {0, "buffer too small", "the request is too long", "send it again"}},
    {"0C", {0, "too few characters", "bytes were lost", "send it again"}},
    {"0D", {0, "too few characters", "bytes were lost", "send it again"}},
    {"0E", {0, "undefined command", "SCIP 1.1, or adjusting time", "send SCIP2.0, then TM2"}},
    {"0F", {0, "not supported", "this model has no such command", "do without"}}};
constexpr CodeFault kLaser[] = {
    {"01", {0, "laser malfunction", "the laser cannot be lit", "restart it, then replace it"}}};
constexpr Fault kChecking{0, "processing stopped", "it verifies an error", "wait; then restart it"};
constexpr Fault kHardware{0, "hardware fault", "laser or motor", "restart it, then replace it"};
constexpr Fault kUnknown{0, "unknown status", "not in the protocol", "restart the device"};

const Fault* find_code(std::span<const CodeFault> table, std::string_view code) {
  for (const CodeFault& entry : table)
    if (entry.code == code) return &entry.fault;
  return nullptr;
}

// "MD" ssss eeee gg i nn, "GD" ssss eeee gg.
std::string_view read_echo(std::string_view echo, ScipScan& into) {
  const bool stream = echo[0] == 'M', group_only = echo[0] == 'G';
  if ((!stream && !group_only) || echo.size() < (stream ? 15U : 12U)) return "not a scan";
  const auto number = [&](std::size_t at, std::size_t size) {
    return whole_number<int>(echo.substr(at, size)).value_or(-1);
  };
  into.step_first = number(2, 4);
  into.step_last = number(6, 4);
  into.group = std::max(number(10, 2), 1);
  into.remaining.reset();
  if (stream) into.remaining = number(13, 2);
  if (into.step_first < 0 || into.step_last < into.step_first || into.remaining == -1)
    return "echo cannot be read";
  return {};
}

// Values of `width` characters run on over the lines. Calls each(value).
template <class Each>
std::string_view read_values(std::span<const std::string_view> lines, std::size_t width,
                             Each&& each) {
  std::uint32_t value = 0;
  std::size_t have = 0;
  for (const std::string_view line : lines) {
    if (line.size() > 64) return "line too long";
    for (const char c : line) {
      const auto bits = static_cast<std::uint8_t>(c - 0x30);
      if (bits > 63) return "character cannot be";
      value = value << 6 | bits;
      if (++have < width) continue;
      each(value);
      value = 0;
      have = 0;
    }
  }
  return have == 0 ? std::string_view{} : "value cut";
}

// Whether the reply that begins here has what its command promises, line by line.
std::string_view check_lines(std::span<const std::string_view> raw) {
  for (const std::string_view line : raw)
    if (line.size() < 2 || scip_checksum(line.substr(0, line.size() - 1)) != line.back())
      return "checksum";
  return {};
}

class Offline : public OfflineStream {
 public:
  Offline() : OfflineStream(look_scip, kScipFrameMax) {}

 private:
  std::string_view say(ByteView frame, Message& message) override {
    if (const auto why = parse_scip(frame, reply_); !why.empty()) return why;
    message.name = reply_.echo.substr(0, 2);
    Fields fields(message);
    fields.add("echo", reply_.echo).add("status", reply_.status);
    if (decode_scip_scan(reply_, scan_).empty())
      say_scan(fields);
    else if (const auto info = scip_info(reply_))
      for (const auto& [key, value] : *info) fields.add(key, value);
    if (const Fault* fault = scip_fault(reply_)) fields.faults(std::array{fault});
    return {};
  }

  void say_scan(Fields& fields) const {
    fields.add("time_ms", scan_.time_ms)
        .add("step_first", scan_.step_first)
        .add("step_last", scan_.step_last)
        .add("group", scan_.group)
        .add("distances_mm", scan_.distances_mm);
    if (scan_.intensities) fields.add("intensities_raw", scan_.intensities_raw);
  }

  ScipReply reply_;
  ScipScan scan_;
};

}  // namespace

char scip_checksum(std::string_view line) {
  // "KEY:value;" is summed without its last character.
  if (line.ends_with(';') && line.find(':') != std::string_view::npos) line.remove_suffix(1);
  unsigned sum = 0;
  for (const char c : line) sum += static_cast<std::uint8_t>(c);
  return static_cast<char>((sum & 0x3F) + 0x30);
}

Look look_scip(ByteView front) {
  if (!starts_echo(front[0])) {
    const auto next = std::find_if(front.begin(), front.end(), starts_echo);
    return Look::none("no echo", static_cast<std::size_t>(next - front.begin()));
  }
  std::size_t lines = 0, begin = 0;
  for (std::size_t at = 0; at < front.size(); ++at) {
    if (front[at] != '\n') {
      if (!printable(front[at])) return Look::none("not text", at);
      if (at - begin > 80) return Look::none("line too long");
      continue;
    }
    const std::string_view line = as_text(front.subspan(begin, at - begin));
    if (lines == 0 && !known_echo(line)) return Look::none("no echo");
    if (lines == 1 && !status_line(line)) return Look::none("no status", begin);
    if (lines > 1 && line.empty()) return Look::frame(at + 1);
    if (lines > 1 && !check_lines(std::array{line}).empty()) return Look::none("checksum", begin);
    ++lines;
    begin = at + 1;
  }
  return Look::more();
}

std::string_view parse_scip(ByteView frame, ScipReply& into) {
  std::string_view rest = as_text(frame);
  into.echo = take_field(rest, '\n');
  const std::string_view status = take_field(rest, '\n');
  if (into.echo.size() < 2 || !status_line(status)) return "no status";
  into.status = status.substr(0, 2);
  into.lines.clear();
  while (!rest.empty() && rest != "\n") into.lines.push_back(take_field(rest, '\n'));
  if (const auto why = check_lines(into.lines); !why.empty()) return why;
  for (auto& line : into.lines) line.remove_suffix(1);
  return {};
}

std::optional<ScipInfo> scip_info(const ScipReply& reply) {
  ScipInfo info;
  for (std::string_view line : reply.lines) {
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || colon == 0 || !line.ends_with(';')) return std::nullopt;
    info.emplace_back(line.substr(0, colon), line.substr(colon + 1, line.size() - colon - 2));
  }
  return info;
}

std::string scip_parameters(const ScipInfo& info, ScipParameters& into) {
  const auto find = [&](std::string_view key) -> const std::string* {
    for (const auto& [known, value] : info)
      if (known == key) return &value;
    return nullptr;
  };
  const std::pair<std::string_view, int*> numbers[] = {
      {"DMIN", &into.range_min_mm}, {"DMAX", &into.range_max_mm}, {"ARES", &into.steps_per_turn},
      {"AMIN", &into.step_first},   {"AMAX", &into.step_last},    {"AFRT", &into.step_front},
      {"SCAN", &into.speed_rpm}};
  for (const auto& [key, number] : numbers) {
    const std::string* value = find(key);
    const auto parsed = value != nullptr ? whole_number<int>(*value) : std::nullopt;
    if (!parsed || *parsed < 0) return std::string(key) + " is missing or no number";
    *number = *parsed;
  }
  if (const std::string* model = find("MODL")) into.model = *model;
  if (into.steps_per_turn == 0 || into.speed_rpm == 0 || into.step_last < into.step_first)
    return "ARES, SCAN or AMAX cannot be";
  return {};
}

std::string_view decode_scip_scan(const ScipReply& reply, ScipScan& into) {
  const bool stream = reply.echo[0] == 'M';
  if (reply.status != (stream ? "99" : "00") || reply.lines.size() < 2) return "no data";
  if (const auto why = read_echo(reply.echo, into); !why.empty()) return why;
  const char kind = reply.echo[1];
  if (kind != 'D' && kind != 'S' && kind != 'E') return "not a scan";
  const auto time = reply.lines[0].size() == 4 ? scip_decode(reply.lines[0]) : std::nullopt;
  if (!time) return "no time stamp";
  into.time_ms = *time;
  into.intensities = kind == 'E';
  into.distances_mm.clear();
  into.intensities_raw.clear();
  bool intensity = false;
  const auto why =
      read_values(std::span(reply.lines).subspan(1), kind == 'S' ? 2 : 3, [&](std::uint32_t value) {
        (intensity ? into.intensities_raw : into.distances_mm).push_back(value);
        intensity = into.intensities && !intensity;
      });
  if (!why.empty()) return why;
  const int beams = (into.step_last - into.step_first) / into.group + 1;
  const auto expected = static_cast<std::size_t>(beams);
  if (into.distances_mm.size() != expected) return "number of beams";
  if (into.intensities && into.intensities_raw.size() != expected) return "number of beams";
  return {};
}

std::optional<std::uint32_t> scip_time_ms(const ScipReply& reply) {
  if (reply.echo != "TM1" || reply.status != "00") return std::nullopt;
  if (reply.lines.size() != 1 || reply.lines[0].size() != 4) return std::nullopt;
  return scip_decode(reply.lines[0]);
}

double scip_angle_rad(const ScipParameters& parameters, const ScipScan& scan, std::size_t beam) {
  const auto step = scan.step_first + static_cast<std::int64_t>(beam) * scan.group;
  return 2 * std::numbers::pi * static_cast<double>(step - parameters.step_front) /
         parameters.steps_per_turn;
}

bool scip_is_range(const ScipParameters& parameters, std::uint32_t distance_mm) {
  return distance_mm >= static_cast<std::uint32_t>(parameters.range_min_mm) &&
         distance_mm <= static_cast<std::uint32_t>(parameters.range_max_mm);
}

const Fault* scip_urg_distance(std::uint32_t distance_mm) {
  static constexpr Fault kNothing{0, "out of range", "nothing near enough", "none"};
  static constexpr Fault kWeak{1, "low confidence", "too little light comes back", "none"};
  static constexpr Fault kOther{6, "other", "the scanner does not say", "none"};
  static constexpr Fault kNotMeasured{7, "not measured", "outside the measured steps", "none"};
  static constexpr Fault kReflection{16, "strong reflection", "a mirror or bare metal", "none"};
  if (distance_mm == 0) return &kNothing;
  if (distance_mm <= 5) return &kWeak;
  if (distance_mm == 6) return &kOther;
  if (distance_mm == 7) return &kNotMeasured;
  return distance_mm >= 16 && distance_mm <= 19 ? &kReflection : nullptr;
}

std::optional<std::uint32_t> scip_decode(std::string_view characters) {
  std::uint32_t value = 0;
  for (const char c : characters) {
    const auto bits = static_cast<std::uint8_t>(c - 0x30);
    if (bits > 63) return std::nullopt;
    value = value << 6 | bits;
  }
  return value;
}

Bytes scip_request(std::string_view command) {
  Bytes bytes(command.begin(), command.end());
  bytes.push_back('\n');
  return bytes;
}

Bytes scip_stream_request(bool intensities, int step_first, int step_last, int group, int skip,
                          int scans) {
  char text[32];
  std::snprintf(text, sizeof text, "%s%04d%04d%02d%01d%02d", intensities ? "ME" : "MD",
                std::clamp(step_first, 0, 9999), std::clamp(step_last, 0, 9999),
                std::clamp(group, 0, 99), std::clamp(skip, 0, 9), std::clamp(scans, 0, 99));
  return scip_request(text);
}

const Fault* scip_fault(const ScipReply& reply) {
  const std::string_view code = reply.status;
  if (code == "00" || code == "99") return nullptr;
  // BM has its own; the others say 02 and 03 where nothing was to be done.
  if (reply.echo.starts_with("BM")) return code == "02" ? nullptr : find_code(kLaser, code);
  if (reply.echo.starts_with("RB") && code == "01") return nullptr;  // Once more, to be sure.
  if (reply.echo.starts_with("SS") && (code == "02" || code == "03")) return nullptr;
  if (const Fault* fault = find_code(kCodes, code)) return fault;
  const int number = whole_number<int>(code).value_or(-1);
  if (number >= 21 && number <= 49) return &kChecking;
  return number >= 50 && number <= 97 ? &kHardware : &kUnknown;
}

std::unique_ptr<OfflineDecoder> scip_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
