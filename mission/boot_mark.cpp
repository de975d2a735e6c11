#include "mission/boot_mark.hpp"

#include <array>
#include <utility>

namespace mission {
namespace {

constexpr std::array<std::pair<BootMark::State, std::string_view>, 4> kStates{
    {{BootMark::State::running, "running"},
     {BootMark::State::hung, "hung"},
     {BootMark::State::held, "held"},
     {BootMark::State::ended, "ended"}}};

constexpr std::array<std::pair<NextStart, std::string_view>, 3> kNextStarts{
    {{NextStart::as_usual, "as usual\n"},
     {NextStart::anew, "anew\n"},
     {NextStart::from_start, "from start\n"}}};

}  // namespace

std::string text_of(NextStart next) {
  for (const auto& [each, text] : kNextStarts)
    if (each == next) return std::string(text);
  return "";
}

NextStart next_start_of(std::string_view text) {
  for (const auto& [next, each] : kNextStarts)
    if (each == text) return next;
  return NextStart::as_usual;
}

std::string text_of(const BootMark& mark) {
  for (const auto& [state, word] : kStates)
    if (state == mark.state) return std::string(word) + " " + mark.boot_id + "\n";
  return "";
}

std::optional<BootMark> mark_of(std::string_view text) {
  for (const auto& [state, word] : kStates) {
    BootMark mark;
    mark.state = state;
    if (!text.starts_with(word)) continue;
    const std::string_view rest = text.substr(word.size());
    if (rest.size() < 3 || rest.front() != ' ' || rest.back() != '\n') return std::nullopt;
    mark.boot_id = rest.substr(1, rest.size() - 2);
    if (mark.boot_id.find_first_of(" \t\n\r") != std::string::npos) return std::nullopt;
    return mark;
  }
  return std::nullopt;
}

Boot boot_after(const std::optional<BootMark>& last, std::string_view boot_id,
                std::string_view stopped_with) {
  if (!last) return Boot::power_cut;
  if (last->state == BootMark::State::ended || last->state == BootMark::State::held)
    return Boot::clean;
  if (last->boot_id != boot_id) return Boot::power_cut;
  const bool watchdog = stopped_with.starts_with("watchdog");
  if (watchdog || last->state == BootMark::State::hung) return Boot::watchdog_restart;
  return stopped_with.ends_with(" KILL") ? Boot::power_cut : Boot::crash;
}

}  // namespace mission
