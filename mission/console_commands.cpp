// The commands of the operator's console, one small function each behind one table.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>

#include "mission/console.hpp"
#include "mission/progress.hpp"
#include "mission/suggest.hpp"

namespace mission {

struct ConsoleSession::Command {
  std::string_view name, arguments;
  bool needs_login;
  std::string (ConsoleSession::*run)(const Words&);
  std::string_view help;     // One line,
  std::string_view details;  // and what else `help NAME` says.
  std::size_t words_max = 0;
};

namespace {

constexpr std::size_t kLogLines = 10, kLogLinesMax = 20;
constexpr double kFarthestM = 1e6, kTurnsDeg = 3600;

// A finite number within +-limit; nothing: it is none.
std::optional<double> number(std::string_view word, double limit) {
  double value{};
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = read.ec == std::errc{} && read.ptr == word.data() + word.size();
  if (!whole || !(std::abs(value) <= limit)) return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (;;) {
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    if (line.empty()) return words;
    const std::size_t end = std::min(line.find(' '), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

std::string pose_text(const ConsoleFacts& facts) {
  if (!facts.pose) return "not known";
  return fmt::format("({:.2f}, {:.2f}) m, heading {:.0f} deg, within {:.2f} m (1 sigma)",
                     facts.pose->position_m.x(), facts.pose->position_m.y(),
                     facts.pose->heading_rad * 180 / std::numbers::pi, facts.sigma_m);
}

std::string faults_text(const ConsoleFacts& facts) {
  if (facts.faults.empty()) return "none";
  return fmt::format("{}, the gravest is {}; `faults` lists them", facts.faults.size(),
                     entry_of(facts.faults.front().code).id);
}

std::string fault_text(const FaultEntry& fault) {
  return fmt::format("{}: {}\n  cause   {}\n  effect  {}\n  remedy  {}", fault.id,
                     name(fault.action), fault.cause, fault.effect, fault.remedy);
}

std::string known_or_meant(std::string_view typed, const std::vector<std::string>& known) {
  return did_you_mean(closest(typed, known));
}

}  // namespace

std::span<const ConsoleSession::Command> ConsoleSession::commands() {
  using S = ConsoleSession;
  static constexpr Command kCommands[]{
      {"status", "", false, &S::status, "mode, mission, pose and faults",
       "In one look: who may drive, how far the mission is, where the robot is."},
      {"why", "", false, &S::why, "why the robot stands, and what to do", ""},
      {"faults", "", false, &S::faults, "what is wrong now, the gravest first", ""},
      {"explain", "ID", false, &S::explain, "what a fault means, and its remedy",
       "ID is as `faults` shows it, its number or its name: `explain F012`.", 1},
      {"log", "[N]", false, &S::log, "what happened last",
       "The last N lines, 10 without a number, 20 at most.", 1},
      {"stop", "", false, &S::stop, "stand at once, until `arm`; needs no login", ""},
      {"disarm", "", false, &S::stop, "the same", ""},
      {"arm", "", true, &S::arm, "release the robot: it may move",
       "Tests the drive's own time-out first where that was not done: it creeps up to 2 cm."},
      {"teleop", "[numbered]", true, &S::teleop, "drive by keys held down",
       "w forward, x back, a left, d right; any other key stops, q leaves. Keys let go for 0.2 s "
       "stop the robot. The mission waits, until `resume`. numbered: for programs, which "
       "send keys as w17. with numbers that grow.",
       1},
      {"goto", "X Y [HEADING]", true, &S::go, "drive there by the roads, and wait",
       "Metres in the site's frame, degrees from east to north. The mission waits, until `resume`.",
       3},
      {"scan", "", true, &S::scan, "take a scan here, and wait",
       "It counts like one of the mission's. The mission waits, until `resume`."},
      {"pause", "", false, &S::pause, "let the mission wait where it is; needs no login",
       "A scan that has begun is finished first."},
      {"resume", "[from-start]", true, &S::resume, "let the mission go on, from where the robot is",
       "After you moved it, the stations left are put in a new order from there. from-start: the "
       "robot was carried, or drove without its disk, to where the run began, and stands there.",
       1},
      {"skip", "", true, &S::skip, "leave out the station that is next", ""},
      {"home", "", true, &S::home, "end the mission and drive home", ""},
      {"restart", "", true, &S::restart, "end this run here, and begin a new one",
       "The robot must stand where a run begins. What this one scanned stays in its folder."},
      {"login", "", false, &S::login, "ask for the password; motion needs it",
       "Five wrong ones lock it for a minute. Ten minutes without a key log you out."},
      {"logout", "", false, &S::logout, "forget that you are logged in", ""},
      {"set-password", "", false, &S::set_password, "set or change the password",
       "The first one is set at the serial line, or as root; there is none by default."},
      {"help", "[COMMAND]", false, &S::help, "this list, or more about one", "", 1},
      {"history", "", false, &S::history, "lines typed before; `!!` repeats the last", ""},
      {"quit", "", false, &S::quit, "log out, and leave", ""},
  };
  return kCommands;
}

const ConsoleSession::Command* ConsoleSession::find(std::string_view name) {
  if (name == "?") name = "help";
  for (const Command& command : commands())
    if (command.name == name) return &command;
  return nullptr;
}

std::string ConsoleSession::carry_out(const std::string& line, hal::Time now) {
  std::string typed = line;
  if (typed == "!!") {
    if (line_.history().empty()) return "nothing was typed before";
    typed = line_.history().back();
  }
  const Words words = words_of(typed);
  if (words.empty()) return "";
  line_.remember(typed);
  if (const Command* const command = find(words.front())) return run(*command, words, now);
  std::vector<std::string> known;
  for (const Command& command : commands()) known.emplace_back(command.name);
  return fmt::format("no command '{}'{}; `help` lists them", shortened(words.front(), 30),
                     known_or_meant(words.front(), known));
}

std::string ConsoleSession::run(const Command& command, const Words& words, hal::Time now) {
  now_ = now;
  if (std::string no = refusal(command); !no.empty()) return no;
  // More words do not keep a stop from stopping.
  if (words.size() - 1 > command.words_max && command.run != &ConsoleSession::stop)
    return fmt::format("too many words: {} {}", command.name, command.arguments);
  return (this->*command.run)(words);
}

std::string ConsoleSession::refusal(const Command& command) const {
  if (!command.needs_login || logged_in_) return {};
  if (!robot_.facts().has_password)
    return "no password was set yet: nothing may move the robot before `set-password`";
  return fmt::format("{} needs a login: `login`", command.name);
}

// --- What is.

std::string ConsoleSession::status(const Words&) {
  const ConsoleFacts facts = robot_.facts();
  std::string text = fmt::format(
      "mode     {}, {}\nmission  {}\norders   {}\npose     {}\nfaults   {}\nsession  {}",
      name(facts.mode), facts.released ? "armed" : "not armed",
      facts.mission.empty() ? "none" : facts.mission, facts.orders.empty() ? "none" : facts.orders,
      pose_text(facts), faults_text(facts), logged_in_ ? "logged in" : "not logged in");
  if (!facts.why.empty()) text += "\nstands   `why` tells the reason";
  return text;
}

std::string ConsoleSession::why(const Words&) {
  const ConsoleFacts facts = robot_.facts();
  if (!facts.why.empty()) return facts.why;
  if (!facts.released) return "nobody has armed it: `arm`";
  if (!facts.orders.empty()) return facts.orders;
  return facts.faults.empty() ? "nothing is wrong" : "nothing holds it; `faults` lists what is";
}

std::string ConsoleSession::faults(const Words&) {
  const ConsoleFacts facts = robot_.facts();
  if (facts.faults.empty()) return "none";
  std::string text;
  const std::size_t shown = std::min<std::size_t>(facts.faults.size(), kRows - 2);
  for (std::size_t i = 0; i < shown; ++i) {
    const FaultEntry& fault = entry_of(facts.faults[i].code);
    const std::string line = fmt::format(
        "{} {}: {}", fault.id, name(fault.action),
        facts.faults[i].detail.empty() ? fault.cause : std::string_view(facts.faults[i].detail));
    text += shortened(line, kColumns) + "\n";
  }
  if (facts.faults.size() > shown)
    text += fmt::format("and {} more\n", facts.faults.size() - shown);
  return text + "`explain ID` tells cause and remedy";
}

std::string ConsoleSession::explain(const Words& words) {
  if (words.size() < 2) return "explain which? `explain F012`";
  if (const FaultEntry* const fault = find_fault(words[1])) return fault_text(*fault);
  constexpr std::size_t kNumberLength = 5;  // "F012-"
  std::vector<std::string> known;
  for (const FaultEntry& fault : all_faults()) known.emplace_back(fault.id.substr(kNumberLength));
  return fmt::format("no fault '{}'{}", shortened(words[1], 30), known_or_meant(words[1], known));
}

std::string ConsoleSession::log(const Words& words) {
  std::size_t lines = kLogLines;
  if (words.size() > 1) {
    const auto asked = number(words[1], kLogLinesMax);
    if (!asked || *asked < 1) return fmt::format("log takes a number from 1 to {}", kLogLinesMax);
    lines = static_cast<std::size_t>(*asked);
  }
  std::string text;
  for (const std::string& line : robot_.log(lines)) text += shortened(line, kColumns) + "\n";
  return text.empty() ? "nothing happened yet" : text;
}

std::string ConsoleSession::help(const Words& words) {
  if (words.size() < 2) {
    std::string text;
    for (const Command& command : commands())
      text += fmt::format("{:<22}{}{}\n", fmt::format("{} {}", command.name, command.arguments),
                          command.help, command.needs_login ? " (login)" : "");
    return text;
  }
  const Command* const command = find(words[1]);
  if (command == nullptr) return fmt::format("no command '{}'", shortened(words[1], 30));
  return fmt::format("{} {}\n{}{}\n{}", command->name, command->arguments, command->help,
                     command->needs_login ? "; needs a login" : "", command->details);
}

std::string ConsoleSession::history(const Words&) {
  std::string text;
  for (const std::string& line : line_.history()) text += line + "\n";
  return text;
}

// --- Orders.

std::string ConsoleSession::simple(ConsoleOrder::Kind kind) {
  return robot_.obey({.kind = kind});
}

std::string ConsoleSession::stop(const Words&) {
  return simple(ConsoleOrder::Kind::stop);
}
std::string ConsoleSession::arm(const Words&) {
  return simple(ConsoleOrder::Kind::arm);
}
std::string ConsoleSession::scan(const Words&) {
  return simple(ConsoleOrder::Kind::scan);
}
std::string ConsoleSession::pause(const Words&) {
  return simple(ConsoleOrder::Kind::pause);
}
std::string ConsoleSession::resume(const Words& words) {
  if (words.size() > 1 && words[1] != "from-start") return "resume, or resume from-start";
  return simple(words.size() > 1 ? ConsoleOrder::Kind::resume_from_start
                                 : ConsoleOrder::Kind::resume);
}
std::string ConsoleSession::restart(const Words&) {
  return simple(ConsoleOrder::Kind::restart);
}
std::string ConsoleSession::skip(const Words&) {
  return simple(ConsoleOrder::Kind::skip);
}
std::string ConsoleSession::home(const Words&) {
  return simple(ConsoleOrder::Kind::home);
}

std::string ConsoleSession::teleop(const Words& words) {
  const bool numbered = numbers_keys_ || words.size() > 1;
  if (words.size() > 1 && words[1] != "numbered") return "teleop, or teleop numbered";
  if (!robot_.facts().released) return "the robot is not armed: `arm` first, then `teleop`";
  std::string said = simple(ConsoleOrder::Kind::take_over);
  teleop_ = numbered ? Teleop::numbered : Teleop::keys;
  key_ = moves_by_ = 0;
  said += said.empty() ? "" : "\n";
  if (numbered) return said + fmt::format("numbers after {}", last_number_);
  return said + "hold w forward, x back, a left, d right; any other key stops, q leaves";
}

std::string ConsoleSession::go(const Words& words) {
  const auto x_m = words.size() > 2 ? number(words[1], kFarthestM) : std::nullopt;
  const auto y_m = words.size() > 2 ? number(words[2], kFarthestM) : std::nullopt;
  if (!x_m || !y_m) return "goto takes two numbers, metres east and north: `goto 12.5 -3`";
  ConsoleOrder order{.kind = ConsoleOrder::Kind::go, .pose = {{*x_m, *y_m}, 0}};
  if (words.size() > 3) {
    const auto heading_deg = number(words[3], kTurnsDeg);
    if (!heading_deg) return "the heading is a number in degrees: `goto 12.5 -3 90`";
    order.pose.heading_rad = *heading_deg * std::numbers::pi / 180;
    order.has_heading = true;
  }
  return robot_.obey(order);
}

// --- Who you are.

std::string ConsoleSession::login(const Words&) {
  if (logged_in_) return "you are logged in";
  if (checking_) return "a password is being checked: wait a moment";
  if (!robot_.facts().has_password)
    return "no password was set yet: `set-password` first, at the serial line or as root";
  return begin_login(now_);
}

std::string ConsoleSession::begin_login(hal::Time now) {
  if (const auto locked = limit_.locked_for(now))
    return fmt::format("too many wrong passwords: wait {:.0f} s", hal::seconds(*locked));
  asks_ = Asks::password;
  line_.hide(true);
  return "";
}

std::string ConsoleSession::logout(const Words&) {
  const bool was = logged_in_;
  log_out();
  return was ? "logged out" : "you were not logged in";
}

std::string ConsoleSession::set_password(const Words&) {
  if (checking_) return "a password is being checked: wait a moment";
  const bool first = !robot_.facts().has_password;
  if (first && !config_.may_set_first_password)
    return "the first password is set at the serial line, or as root on this computer";
  if (!first && !logged_in_) return "set-password needs a login: `login`";
  asks_ = Asks::new_password;
  line_.hide(true);
  return "";
}

std::string ConsoleSession::quit(const Words&) {
  log_out();
  line_.forget();
  quits_ = true;
  return "bye";
}

}  // namespace mission
