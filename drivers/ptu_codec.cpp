#include "drivers/ptu_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "drivers/offline_stream.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

bool blank(char c) {
  return c == ' ' || c == '\r' || c == '\n' || c == '\t';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

// What stands before the '*' of a reset's answer, which need not end its line.
bool is_reset(std::string_view text) {
  return text == "!T!T!P!P" || text == "!T!T" || text == "!P!P";
}

// Counts "!P" and "!T" and takes them out.
std::string without_limits(std::string_view text, PtuAnswer& answer) {
  std::string rest;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char next = i + 1 < text.size() ? text[i + 1] : '\0';
    if (text[i] == '!' && (next == 'P' || next == 'T')) {
      ++(next == 'P' ? answer.pan_limits : answer.tilt_limits);
      ++i;
    } else {
      rest += text[i];
    }
  }
  return rest;
}

// Text in front of the number is words: "Current Pan position is -2500".
std::vector<double> numbers_in(std::string_view text) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find_first_of(" ,", at), text.size());
    if (const auto number = whole_real(text.substr(at, end - at))) numbers.push_back(*number);
    at = end + 1;
  }
  return numbers;
}

constexpr Fault kRefused{0, "refused", "the unit says why", "read its text"};
constexpr Fault kIllegal{0, "illegal command", "not a command of this model",
                         "check the model and its firmware"};
constexpr Fault kLimit{0, "beyond a limit", "the position or speed is beyond what is allowed",
                       "choose one within PN..PX and PL..PU"};

constexpr double kStepTurn_arcsec = 360.0 * 3600.0;

class Offline : public OfflineStream {
 public:
  Offline() : OfflineStream(look_ptu, kPtuLineMax) {}

  void feed(const Captured& captured, const std::function<void(Message)>& out) override {
    if (captured.from_device) return OfflineStream::feed(captured, out);
    Message message{"request", captured.t_s, false, {}};
    Fields(message).add("text", trimmed(as_text(captured.bytes)));
    out(std::move(message));
  }

 private:
  std::string_view say(ByteView frame, Message& message) override {
    const PtuAnswer answer = parse_ptu(frame);
    message.name = answer.ok ? "answer" : "refusal";
    Fields fields(message);
    fields.add("text", answer.text);
    if (!answer.echo.empty()) fields.add("echo", answer.echo);
    if (answer.pan_limits > 0) fields.add("pan_limits", answer.pan_limits);
    if (answer.tilt_limits > 0) fields.add("tilt_limits", answer.tilt_limits);
    const auto numbers = ptu_numbers(answer);
    if (!numbers.empty()) fields.add("numbers", numbers);
    if (const Fault* fault = ptu_fault(answer)) fields.faults(std::array{fault});
    return {};
  }
};

}  // namespace

Look look_ptu(ByteView front) {
  std::size_t at = 0;
  while (at < front.size() && blank(static_cast<char>(front[at]))) ++at;  // Some begin with one.
  const std::size_t begin = at;
  for (; at < front.size() && front[at] != '\n'; ++at) {
    const std::uint8_t c = front[at];
    if (c != '\r' && (c < 0x20 || c > 0x7E)) return Look::none("not text", at + 1);
    if (c == '*' && is_reset(as_text(front.subspan(begin, at - begin)))) return Look::frame(at + 1);
  }
  if (at == front.size()) return Look::more();
  // The echo of a request alone, or text of the start: not an answer.
  const bool answer = as_text(front.first(at)).find_first_of("*!") != std::string_view::npos;
  return answer ? Look::frame(at + 1) : Look::none("no answer", at + 1);
}

PtuAnswer parse_ptu(ByteView frame) {
  PtuAnswer answer;
  const std::string text = without_limits(as_text(frame), answer);
  const auto mark = text.find_first_of("*!");
  if (mark == std::string::npos) {  // Limits only.
    answer.text = trimmed(text);
    return answer;
  }
  answer.ok = text[mark] == '*';
  answer.echo = trimmed(std::string_view(text).substr(0, mark));
  answer.text = trimmed(std::string_view(text).substr(mark + 1));
  return answer;
}

std::vector<double> ptu_numbers(const PtuAnswer& answer) {
  return answer.ok ? numbers_in(answer.text) : std::vector<double>{};
}

std::optional<std::int64_t> ptu_integer(const PtuAnswer& answer) {
  const auto numbers = ptu_numbers(answer);
  if (numbers.size() != 1 || numbers[0] != std::nearbyint(numbers[0])) return std::nullopt;
  if (!(std::abs(numbers[0]) < 1e15)) return std::nullopt;
  return static_cast<std::int64_t>(numbers[0]);
}

Bytes ptu_query(std::string_view command) {
  Bytes bytes(command.begin(), command.end());
  bytes.push_back(' ');
  return bytes;
}

Bytes ptu_command(std::string_view command, std::int64_t value) {
  return ptu_query(std::string(command) + std::to_string(value));
}

double PtuAxis::angle_rad(std::int64_t steps) const {
  const double turns = static_cast<double>(steps) * arcsec_per_step / kStepTurn_arcsec;
  return (counter_clockwise ? 2 : -2) * std::numbers::pi * turns;
}

std::int64_t PtuAxis::steps(double angle_rad) const {
  const double turns = angle_rad / (2 * std::numbers::pi);
  return std::llround((counter_clockwise ? turns : -turns) * kStepTurn_arcsec / arcsec_per_step);
}

std::optional<PtuHealth> ptu_health(const PtuAnswer& answer) {
  const auto numbers = ptu_numbers(answer);
  if (numbers.size() != 4) return std::nullopt;
  const auto celsius = [&](std::size_t i) { return (numbers[i] - 32) * 5 / 9; };
  return PtuHealth{numbers[0], celsius(1), celsius(2), celsius(3)};
}

Bytes ptu_hail() {
  return ptu_query(" PR");
}

bool ptu_hailed(const PtuAnswer& answer) {
  return (answer.echo.empty() || answer.echo.ends_with("PR")) && ptu_step_arcsec(answer);
}

std::optional<double> ptu_step_arcsec(const PtuAnswer& answer) {
  const auto numbers = ptu_numbers(answer);
  if (numbers.size() != 1 || !(numbers[0] > 0.1 && numbers[0] < 3600)) return std::nullopt;
  return numbers[0];
}

const Fault* ptu_fault(const PtuAnswer& answer) {
  if (answer.ok || answer.text.empty()) return nullptr;
  if (answer.text.find("Illegal") != std::string::npos) return &kIllegal;
  return answer.text.find("allowable") != std::string::npos ? &kLimit : &kRefused;
}

std::vector<PtuStep> ptu_startup() {
  std::vector<PtuStep> steps;
  const std::pair<std::string_view, std::string_view> commands[] = {
      {"end half a command", ""}, {"echo off", "ED"},         {"short answers", "FT"},
      {"move at once", "I"},      {"position control", "CI"}, {"pan resolution", "PR"},
      {"tilt resolution", "TR"},  {"least pan", "PN"},        {"greatest pan", "PX"},
      {"least tilt", "TN"},       {"greatest tilt", "TX"},    {"greatest pan speed", "PU"},
      {"least pan speed", "PL"}};
  for (const auto& [purpose, command] : commands)
    steps.push_back({purpose, ptu_query(command), command == "PU" || command == "PL" ? 2.0 : 0.5});
  return steps;
}

std::unique_ptr<OfflineDecoder> ptu_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
