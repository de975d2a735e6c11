#include "drivers/sick_lms_startup.hpp"

#include <algorithm>
#include <array>

#include "drivers/sick_lms_codec.hpp"

namespace drivers {
namespace {

using As = ColaValue::As;

struct Pair {
  std::int32_t frequency_centihz, resolution_1e4deg;
};
constexpr Pair kLms1xx[] = {{2500, 2500}, {2500, 5000}, {5000, 5000}};
constexpr Pair kLms5xx[] = {{2500, 1667}, {2500, 2500},  {2500, 3333}, {2500, 5000},
                            {3500, 2500}, {3500, 5000},  {5000, 3333}, {5000, 5000},
                            {7500, 5000}, {7500, 10000}, {10000, 6667}};

// Numbers in an answer stand as in a request.
Bytes body_of(ColaDialect dialect, std::initializer_list<ColaValue> values) {
  const Bytes frame = encode_cola(dialect, "sAN", "x", values);
  const auto message = parse_cola(frame);
  return {message->body.begin(), message->body.end()};
}

class Dialogue {
 public:
  explicit Dialogue(ColaDialect dialect) : dialect_(dialect) {}

  LmsStep& ask(std::string_view purpose, std::string_view command, std::string_view name,
               std::initializer_list<ColaValue> values = {}) {
    LmsStep step;
    step.purpose = purpose;
    step.request = encode_cola(dialect_, command, name, values);
    step.command = command == "sMN"   ? "sAN"
                   : command == "sEN" ? "sEA"
                   : command == "sWN" ? "sWA"
                                      : "sRA";
    step.name = name;
    return steps.emplace_back(std::move(step));
  }
  void expect(std::uint8_t value) { steps.back().body = body_of(dialect_, {{As::u8, value}}); }

  std::vector<LmsStep> steps;

 private:
  ColaDialect dialect_;
};

void identify(Dialogue& talk) {
  for (const auto name : {"FirmwareVersion", "SCdevicestate", "ODoprh", "ODpwrc", "LocationName"})
    talk.ask("who is there", "sRN", name).may_fail = true;
}

void configure(Dialogue& talk, const LmsSettings& s) {
  talk.ask("set the scan", "sMN", "mLMPsetscancfg",
           {{As::i32, s.frequency_centihz},
            {As::i16, 1},
            {As::i32, s.resolution_1e4deg},
            {As::i32, s.start_1e4deg},
            {As::i32, s.stop_1e4deg}})
      .timeout_s = 5;
  talk.expect(0);
  talk.ask("set the sector", "sWN", "LMPoutputRange",
           {{As::u16, 1},
            {As::u32, s.resolution_1e4deg},
            {As::u32, s.start_1e4deg},
            {As::u32, s.stop_1e4deg}});
  talk.ask("choose the data", "sWN", "LMDscandatacfg",
           {{As::hex2, 1},
            {As::hex2, 0},
            {As::u8, s.remission},
            {As::u8, s.remission},
            {As::u8, 0},
            {As::hex2, 0},
            {As::hex2, 0},
            {As::u8, 0},
            {As::u8, 0},
            {As::u8, 0},
            {As::u8, 1},
            {As::i16, s.every_nth_scan}});
  if (s.lms5xx) talk.ask("first echo only", "sWN", "FREchoFilter", {{As::u8, 0}});
}

constexpr std::int32_t kAngleTolerance_1e4deg = 10;  // An LMS111 says -449997 for -450000.

std::string differs(std::string_view what, std::int64_t is, std::int64_t wanted,
                    std::int64_t tolerance) {
  if (std::abs(is - wanted) <= tolerance) return "";
  return std::string(what) + " is " + std::to_string(is) + ", not " + std::to_string(wanted);
}

std::string scan_problem(const LmsSettings& s, ColaReader in) {
  const std::int64_t frequency = in.u32();
  in.i16();
  const std::int64_t resolution = in.u32();
  if (!in.ok()) return "";  // Firmware that says the frequency only.
  const auto problem = differs("frequency (0.01 Hz)", frequency, s.frequency_centihz, 0);
  return problem.empty() ? differs("resolution (1e-4 deg)", resolution, s.resolution_1e4deg, 1)
                         : problem;
}

std::string sector_problem(const LmsSettings& s, ColaReader in) {
  in.u16();
  const std::int64_t resolution = in.u32(), start = in.i32(), stop = in.i32();
  if (!in.ok()) return "the sector cannot be read";
  auto problem = differs("resolution (1e-4 deg)", resolution, s.resolution_1e4deg, 1);
  if (problem.empty())
    problem = differs("sector start (1e-4 deg)", start, s.start_1e4deg, kAngleTolerance_1e4deg);
  if (problem.empty())
    problem = differs("sector stop (1e-4 deg)", stop, s.stop_1e4deg, kAngleTolerance_1e4deg);
  return problem;
}

std::string data_problem(const LmsSettings& s, ColaReader in) {
  const std::int64_t channels = in.u8();
  in.u8();
  const std::int64_t remission = in.u8();
  for (int i = 0; i < 8; ++i) in.u8();
  const std::int64_t every = in.u16();
  if (!in.ok()) return "the data settings cannot be read";
  auto problem = differs("data channels", channels, 1, 0);
  if (problem.empty()) problem = differs("remission", remission, s.remission, 0);
  if (problem.empty()) problem = differs("every n-th scan", every, s.every_nth_scan, 0);
  return problem;
}

}  // namespace

std::string lms_settings_problem(const LmsSettings& s) {
  const std::span<const Pair> pairs = s.lms5xx ? std::span<const Pair>(kLms5xx) : kLms1xx;
  const bool known = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& pair) {
    return pair.frequency_centihz == s.frequency_centihz &&
           std::abs(pair.resolution_1e4deg - s.resolution_1e4deg) <= 1;
  });
  if (!known) {
    std::string problem = "no such frequency and resolution; in 0.01 Hz and 1e-4 deg there are";
    for (const Pair& pair : pairs)
      problem += ' ' + std::to_string(pair.frequency_centihz) + '/' +
                 std::to_string(pair.resolution_1e4deg);
    return problem;
  }
  const std::int32_t first = s.lms5xx ? -50000 : -450000, last = s.lms5xx ? 1850000 : 2250000;
  if (s.start_1e4deg < first || s.stop_1e4deg > last || s.start_1e4deg >= s.stop_1e4deg)
    return "the sector must lie within " + std::to_string(first) + " .. " + std::to_string(last) +
           " (1e-4 deg)";
  return s.every_nth_scan == 0 ? "every_nth_scan must be at least 1" : "";
}

std::vector<LmsStep> lms_startup(ColaDialect dialect, const LmsSettings& settings) {
  Dialogue talk(dialect);
  talk.ask("log in", "sMN", "SetAccessMode", {{As::u8, 3}, {As::hex32, settings.password}});
  talk.expect(1);
  talk.ask("choose the dialect", "sWN", "EIHstCola", {{As::u8, dialect == ColaDialect::binary}});
  identify(talk);
  talk.ask("stop measuring", "sMN", "LMCstopmeas").timeout_s = 5;
  talk.expect(0);
  configure(talk, settings);
  talk.ask("start measuring", "sMN", "LMCstartmeas").timeout_s = 5;
  talk.expect(0);
  talk.ask("log out and run", "sMN", "Run");
  talk.expect(1);
  talk.ask("subscribe to scans", "sEN", "LMDscandata", {{As::u8, 1}});
  talk.expect(1);
  return std::move(talk.steps);
}

std::vector<LmsStep> lms_stop(ColaDialect dialect) {
  Dialogue talk(dialect);
  talk.ask("unsubscribe", "sEN", "LMDscandata", {{As::u8, 0}});
  talk.expect(0);
  return std::move(talk.steps);
}

LmsStep lms_hello(ColaDialect dialect) {
  Dialogue talk(dialect);
  talk.ask("say that it is there", "sRN", "SCdevicestate").timeout_s = 1;
  return std::move(talk.steps.front());
}

LmsStep lms_model(ColaDialect dialect) {
  Dialogue talk(dialect);
  talk.ask("say its model", "sRN", "DeviceIdent").may_fail = true;
  return std::move(talk.steps.front());
}

std::vector<LmsStep> lms_read_back(ColaDialect dialect) {
  Dialogue talk(dialect);
  for (const auto name : {"LMPscancfg", "LMPoutputRange", "LMDscandatacfg"})
    talk.ask("say its settings", "sRN", name).may_fail = true;
  return std::move(talk.steps);
}

std::string lms_read_back_problem(const LmsSettings& settings, const ColaMessage& message) {
  if (message.name == "LMPscancfg") return scan_problem(settings, ColaReader(message));
  if (message.name == "LMPoutputRange") return sector_problem(settings, ColaReader(message));
  if (message.name == "LMDscandatacfg") return data_problem(settings, ColaReader(message));
  return "";
}

std::string lms_text(const ColaMessage& message) {
  ColaReader in(message);
  const std::size_t size = in.u16();
  std::string text(in.characters(size));
  return in.ok() ? text : "";
}

LmsAnswer lms_judge(const LmsStep& step, const ColaMessage& message) {
  if (message.command == "sFA") return LmsAnswer::refused;
  if (message.command != step.command || message.name != step.name) return LmsAnswer::unrelated;
  // The answer's first value decides; echoed settings may follow it.
  ColaReader got(message);
  if (step.body.empty()) return LmsAnswer::accepted;
  ColaMessage wanted = message;
  wanted.body = step.body;
  ColaReader want(wanted);
  const auto value = got.u8();
  return got.ok() && value == want.u8() ? LmsAnswer::accepted : LmsAnswer::refused;
}

std::string lms_refusal(const LmsStep& step, const ColaMessage& message) {
  std::string text = "scanner refused to " + std::string(step.purpose);
  const Fault* fault = nullptr;
  if (const auto code = cola_error(message))
    fault = fault_of(cola_errors(), *code);
  else if (step.name == "mLMPsetscancfg")
    fault = fault_of(lms_scan_config_errors(), ColaReader(message).u8());
  else if (step.name == "LMCstartmeas")
    fault = fault_of(lms_start_errors(), ColaReader(message).u8());
  if (fault == nullptr) return text;
  return text + ": " + std::string(fault->name) + " (" + std::string(fault->cause) +
         "): " + std::string(fault->remedy);
}

}  // namespace drivers
