#include "drivers/vn100_startup.hpp"

#include <algorithm>

#include "drivers/text.hpp"

namespace drivers {
namespace {

constexpr int kLineRates_hz[] = {1, 2, 4, 5, 10, 20, 25, 40, 50, 100, 200};
constexpr int kLine_bytes = 122;  // "$VNYMR,...*hh\r\n" with every field at its width.
constexpr int kPacket_bytes = 4 + 8 + 12 + 12 + 12 + 2 + 2;
constexpr std::uint16_t kCommon = 1U << 0 | 1U << 3 | 1U << 5 | 1U << 8 | 1U << 12;

template <class Range>
bool has(const Range& range, int value) {
  return std::find(std::begin(range), std::end(range), value) != std::end(range);
}

std::vector<std::string> fields_of(std::string_view text) {
  std::vector<std::string> fields;
  while (!text.empty()) fields.emplace_back(take_field(text, ','));
  return fields;
}

std::string_view bare(std::string_view text) {
  while (text.size() > 1 && text[0] == '0') text.remove_prefix(1);
  return text;
}

// A setting: written, echoed, and read back.
void set(std::vector<Vn100Step>& steps, std::string_view purpose, const std::string& values) {
  steps.push_back({purpose, "VNWRG," + values, "VNWRG", fields_of(values), 0});
  const std::string reg = values.substr(0, values.find(','));
  steps.push_back({purpose, "VNRRG," + reg, "VNRRG", fields_of(values), 0});
}

std::string text_of(const Bytes& request) {  // "$VNWRG,75,...*XX\r\n"
  const std::string_view text = as_text(request);
  constexpr std::size_t kHead = std::string_view("$VNWRG,").size();
  return std::string(text.substr(kHead, text.rfind('*') - kHead));
}

}  // namespace

Vn100Output vn100_output(const Vn100Settings& settings) {
  return {1, 800 / settings.rate_hz, kCommon, 0, 0};
}

std::string vn100_settings_problem(const Vn100Settings& s) {
  if (!has(kVn100Bauds, s.baud)) return "no such bit rate: " + std::to_string(s.baud);
  if (s.ascii && !has(kLineRates_hz, s.rate_hz))
    return "lines come at 1, 2, 4, 5, 10, 20, 25, 40, 50, 100 or 200 Hz";
  if (!s.ascii && (s.rate_hz < 1 || s.rate_hz > 400 || 800 % s.rate_hz != 0))
    return "packets come at a whole part of 800 Hz, at most 400";
  const int bits_per_s = 10 * s.rate_hz * (s.ascii ? kLine_bytes : kPacket_bytes);
  if (bits_per_s > s.baud / 10 * 8)
    return std::to_string(s.rate_hz) + " Hz do not fit into " + std::to_string(s.baud) +
           " baud: lower the rate or raise the bit rate";
  return {};
}

std::vector<Vn100Step> vn100_steps(const Vn100Settings& s) {
  std::vector<Vn100Step> steps{{"pause its output", "VNASY,0", "VNASY", {"0"}, 0},
                               {"ask for its model", "VNRRG,1", "VNRRG", {"1"}, 1},
                               {"ask for its serial number", "VNRRG,3", "VNRRG", {"3"}, 3},
                               {"ask for its firmware", "VNRRG,4", "VNRRG", {"4"}, 4}};
  set(steps, "choose the lines", s.ascii ? "6,14" : "6,0");
  if (s.ascii) set(steps, "set the rate of lines", "7," + std::to_string(s.rate_hz));
  Vn100Output output = vn100_output(s);
  if (s.ascii) output.port = 0;
  set(steps, "choose the packet", text_of(vn100_output_request(75, output)));
  steps.push_back({"resume its output", "VNASY,1", "VNASY", {"1"}, 0});
  return steps;
}

Vn100Answer vn100_judge(const Vn100Step& step, const Vn100Line& line) {
  if (line.type == "VNERR") return Vn100Answer::refused;
  if (line.type != step.type || line.fields.empty()) return Vn100Answer::unrelated;
  if (bare(line.fields[0]) != bare(step.fields[0])) return Vn100Answer::unrelated;
  if (line.fields.size() < step.fields.size()) return Vn100Answer::other_value;
  for (std::size_t i = 1; i < step.fields.size(); ++i)
    if (bare(line.fields[i]) != bare(step.fields[i])) return Vn100Answer::other_value;
  return Vn100Answer::accepted;
}

std::string vn100_refusal(const Vn100Step& step, const Vn100Line& line) {
  std::string text = "to " + std::string(step.purpose) + " ($" + step.request + ")";
  const Fault* fault = vn100_error(line);
  if (fault == nullptr) return text;
  return text + ": " + std::string(fault->name) + ": " + std::string(fault->cause) + ": " +
         std::string(fault->remedy);
}

}  // namespace drivers
