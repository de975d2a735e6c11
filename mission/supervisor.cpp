#include "mission/supervisor.hpp"

namespace mission {
namespace {

// The start of the program is no answer to a stop: whoever started it may not have seen it.
Answer answer_to(const SupervisorState& state, Conditions conditions, Event event) {
  if (event == Event::start && (state.begun || state.latched != 0)) return Answer::not_enough;
  if ((conditions.bits() & latch::kStops) != 0) return Answer::not_yet;
  return conditions.has(Condition::proven) ? Answer::released : Answer::not_proven;
}

}  // namespace

SupervisorState booted(Boot how) {
  static constexpr std::uint16_t kLatches[]{0, latch::kWatchdogRestart, latch::kCrash,
                                            latch::kPowerCut};
  SupervisorState state;
  state.latched = kLatches[static_cast<std::size_t>(how)];
  return state;
}

Mode decide(Conditions conditions, bool latched, bool released) {
  const bool loaded = conditions.has(Condition::mission_loaded);
  if (latched || (conditions.bits() & latch::kStops) != 0) return Mode::stopped;
  if (!released) return loaded ? Mode::holding : Mode::idle;
  if (conditions.has(Condition::operator_alive)) return Mode::teleop;
  constexpr std::uint16_t kHolds = static_cast<std::uint16_t>(Condition::pose_uncertain) |
                                   static_cast<std::uint16_t>(Condition::range_stale) |
                                   static_cast<std::uint16_t>(Condition::hold_fault);
  if ((conditions.bits() & kHolds) != 0) return Mode::holding;
  if (!loaded) return Mode::idle;
  return conditions.has(Condition::battery_reserve) ? Mode::returning : Mode::autonomous;
}

Decision supervise(SupervisorState& state, Conditions conditions, Event event) {
  state.latched |= conditions.bits() & latch::kStops;
  Answer answer = Answer::none;
  if (event == Event::start || event == Event::release) {
    answer = answer_to(state, conditions, event);
    if (answer == Answer::released) state = {.latched = 0, .released = true, .begun = true};
  }
  if (event == Event::hold) state.begun = true;  // The start was before what they want now.
  if (state.latched != 0 || event == Event::hold) state.released = false;
  return {decide(conditions, state.latched != 0, state.released), answer};
}

std::string_view name(Mode mode) {
  static constexpr std::string_view kModeNames[]{"idle",    "autonomous", "returning",
                                                 "holding", "teleop",     "stopped"};
  return kModeNames[static_cast<std::size_t>(mode)];
}

std::string_view name(Answer answer) {
  static constexpr std::string_view kAnswers[]{
      "nobody asked", "released", "a stop is still there",
      "the drive's own time-out or the e-stop loop is not proven", "only a person can release it"};
  return kAnswers[static_cast<std::size_t>(answer)];
}

}  // namespace mission
