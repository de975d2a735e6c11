#include "tests/dst/rig/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "tests/dst/rig/operator.hpp"
#include "tests/support/random_site.hpp"

namespace dst {
namespace {

using sim::UnitFault;
using support::Dice;

constexpr std::uint64_t kScenarioDraw = 0x5eed;  // Another stream than that of the yard.
constexpr std::uint64_t kComputerDraw = 0xc0de;  // Nor that of the devices.
constexpr std::uint64_t kConsoleDraw = 0x50e5;   // Nor those.
constexpr double kWithin_s = 150;                // Most missions last longer.
constexpr double kLate_max_s = 300;
constexpr hal::Duration kLongest = std::chrono::minutes(2);
constexpr int kDaysOf56Years = 20'454;

// From a flicker to two minutes, as many short ones as long ones; seldom for ever.
hal::Duration draw_during(Dice& dice) {
  if (dice.uniform(0, 1) < 0.04) return kForEver;
  return hal::from_seconds(0.02 * std::pow(6000.0, dice.uniform(0, 1)));
}

hal::Duration draw_time(Dice& dice) {
  return hal::from_seconds(dice.uniform(0, kWithin_s));
}

std::string draw_role(Dice& dice) {
  return std::string(kRoles[static_cast<std::size_t>(dice.below(std::size(kRoles)))]);
}

sim::FaultSetting draw_setting(Dice& dice) {
  const auto fault = static_cast<UnitFault>(1 + dice.below(8));
  const double share = dice.uniform(0, 1);
  switch (fault) {
    case UnitFault::wrong:
      return {fault, dice.below(2) == 0 ? 0.5 : -0.9 + 1.9 * share + (share == 0.9 / 1.9)};
    case UnitFault::slow:
      return {fault, 1.5 + 8 * share};
    case UnitFault::delayed:
      return {fault, 0.02 + 2 * share * share};
    case UnitFault::intermittent:
      return {fault, 0.1 + 10 * share * share};
    default:
      return {fault, 0};
  }
}

// One fault of a device at a time. Inputs that contradict themselves, and what comes and goes, hold
// a robot for as long as it lasts: by design nothing but a person ends that.
void add_fault(Scenario& scenario, DeviceFault fault) {
  const bool inputs = fault.role == "board" || fault.role == "safety";
  const bool comes_and_goes = fault.setting.fault == UnitFault::intermittent;
  if (fault.during == kForEver && (inputs || comes_and_goes)) fault.during = kLongest;
  const bool taken = std::ranges::any_of(scenario.faults, [&](const DeviceFault& other) {
    return other.role == fault.role && fault.from <= other.from + other.during &&
           other.from <= fault.from + fault.during;
  });
  if (!taken) scenario.faults.push_back(std::move(fault));
}

// Devices that are switched on one after the other, long after the program was started.
void draw_arrivals(Dice& dice, Scenario& scenario) {
  for (const std::string_view role : kRoles)
    if (dice.below(2) == 0)
      add_fault(scenario, {std::string(role),
                           {UnitFault::off, 0},
                           {},
                           hal::from_seconds(dice.uniform(0, kLate_max_s))});
}

void draw_presses(Dice& dice, Scenario& scenario) {
  const int count = dice.below(3);
  for (int i = 0; i < count; ++i) {
    const auto what = static_cast<Press>(dice.below(5));
    const bool again = std::ranges::any_of(
        scenario.presses, [&](const Pressed& pressed) { return pressed.what == what; });
    if (!again) scenario.presses.push_back({what, draw_time(dice), draw_during(dice) % kForEver});
  }
}

// What befalls the computer itself.
void draw_computer(Dice& dice, Scenario& scenario) {
  for (int left = dice.below(3); left > 0; --left) {
    const double share = dice.uniform(-1, 1);  // Seconds to decades, there and back.
    const double by_s = std::copysign(std::pow(1.8e9, std::abs(share)), share);
    scenario.clock_jumps.push_back(
        {draw_time(dice), std::chrono::seconds(static_cast<long>(std::lround(by_s)))});
  }
  if (dice.below(6) == 0)
    scenario.disk =
        DiskTrouble{static_cast<DiskFault>(dice.below(4)), draw_time(dice), draw_during(dice),
                    scenario.seed % 2 == 1};  // Without a throw: older seeds stay what they are.
  if (dice.below(3) == 0) scenario.power_cut = PowerCut{draw_time(dice), dice.below(200)};
  if (scenario.power_cut && dice.below(2) == 0)
    scenario.cut_again = PowerCut{hal::from_seconds(dice.uniform(0, 90)), dice.below(200)};
}

// As one would write it down.
std::string shown(const std::string& bytes) {
  std::string text;
  for (const char byte : bytes)
    text += byte >= ' ' && byte < 0x7F ? std::string(1, byte)
                                       : fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
  return text;
}

}  // namespace

std::string_view name(DiskFault fault) {
  static constexpr std::string_view kNames[]{"is full", "fails", "writes in parts",
                                             "flushes slowly"};
  return kNames[static_cast<std::size_t>(fault)];
}

std::string_view name(Press press) {
  static constexpr std::string_view kNames[]{"base e-stop", "board e-stop", "safety e-stop",
                                             "bumper", "transmitter"};
  return kNames[static_cast<std::size_t>(press)];
}

Scenario draw_scenario(std::uint64_t seed) {
  Dice dice(seed ^ kScenarioDraw << 32);
  Scenario scenario{.seed = seed,
                    .faults = {},
                    .cuts = {},
                    .presses = {},
                    .jumps = {},
                    .clock_jumps = {},
                    .disk = {},
                    .power_cut = {},
                    .cut_again = {},
                    .at_console = {},
                    .releases_after = hal::from_seconds(dice.uniform(1, 60)),
                    .by_button = dice.below(2) == 0};
  if (dice.below(4) == 0) draw_arrivals(dice, scenario);
  for (int left = 1 + dice.below(4); left > 0; --left) {
    DeviceFault fault{
        .role = draw_role(dice), .setting = draw_setting(dice), .from = {}, .during = {}};
    fault.from = draw_time(dice);
    fault.during = draw_during(dice);
    add_fault(scenario, std::move(fault));
  }
  for (int left = dice.below(3); left > 0; --left) {
    LinkCut cut{.role = draw_role(dice), .after = 0, .from = {}, .during = {}};
    cut.after = static_cast<std::uint64_t>(dice.below(2000));
    cut.from = draw_time(dice);
    cut.during = draw_during(dice);
    scenario.cuts.push_back(std::move(cut));
  }
  draw_presses(dice, scenario);
  if (dice.below(3) == 0)
    scenario.jumps.push_back(
        {draw_time(dice), dice.below(2) == 0 ? kDaysOf56Years : -kDaysOf56Years});
  Dice computer(seed ^ kComputerDraw << 32);
  draw_computer(computer, scenario);
  Dice console(seed ^ kConsoleDraw << 32);
  if (console.below(3) == 0) scenario.at_console = draw_operator(console, kWithin_s);
  return scenario;
}

std::string text(const Scenario& scenario) {
  std::multimap<hal::Duration, std::string> lines;
  const auto add = [&](hal::Duration from, hal::Duration during, const std::string& what) {
    lines.emplace(
        from, fmt::format("  {:8.3f} s  {} {}\n", hal::seconds(from), what,
                          during >= kForEver ? std::string("for ever")
                                             : fmt::format("for {:.3f} s", hal::seconds(during))));
  };
  for (const DeviceFault& fault : scenario.faults)
    add(fault.from, fault.during, fault.role + " " + sim::to_text(fault.setting));
  for (const LinkCut& cut : scenario.cuts)
    add(cut.from, cut.during, fmt::format("link of {} cut after {} more", cut.role, cut.after));
  for (const Pressed& pressed : scenario.presses)
    add(pressed.from, pressed.during, std::string(name(pressed.what)) + " pressed");
  for (const DateJump& jump : scenario.jumps)
    lines.emplace(jump.from, fmt::format("  {:8.3f} s  the satellites' date jumps by {} days\n",
                                         hal::seconds(jump.from), jump.days));
  for (const ClockJump& jump : scenario.clock_jumps)
    lines.emplace(jump.from, fmt::format("  {:8.3f} s  the computer's clock jumps by {} s\n",
                                         hal::seconds(jump.from), jump.by.count()));
  if (const auto& disk = scenario.disk)
    add(disk->from, disk->during,
        "the disk " + std::string(name(disk->fault)) +
            (disk->sends_home ? ", which sends the robot home" : ""));
  if (const auto& cut = scenario.power_cut)
    lines.emplace(cut->from, fmt::format("  {:8.3f} s  and {} steps: the power is cut\n",
                                         hal::seconds(cut->from), cut->steps));
  if (const auto& cut = scenario.cut_again)
    lines.emplace(
        kForEver,
        fmt::format("  {:8.3f} s  and {} steps after it is gone on with: it is cut again\n",
                    hal::seconds(cut->from), cut->steps));
  if (const auto& who = scenario.at_console) {
    for (const Operator::Typed& typed : who->typed)
      lines.emplace(typed.at, fmt::format("  {:8.3f} s  typed: {}\n", hal::seconds(typed.at),
                                          shown(typed.bytes)));
    if (who->disturbed_during > hal::Duration{})
      add(who->disturbed_from, who->disturbed_during, "the console's line is disturbed");
    if (who->cut_from) add(*who->cut_from, who->cut_during, "the console's line is cut");
  }
  std::string all =
      fmt::format("  a person releases the robot after {:.1f} s by {}\n",
                  hal::seconds(scenario.releases_after), scenario.by_button ? "button" : "console");
  for (const auto& [from, line] : lines) all += line;
  return all;
}

}  // namespace dst
