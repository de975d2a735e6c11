#include "tests/dst/rig/operator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <fstream>
#include <functional>
#include <utility>

#include "mission/gate.hpp"
#include "tests/mission/console_person.hpp"

namespace dst {
namespace {

using namespace std::chrono_literals;
using support::Dice;

constexpr hal::Duration kKeyRepeats = 50ms;
constexpr hal::Duration kReads = 100ms;
// Long after whatever was typed somebody sees to it that the mission goes on.
constexpr hal::Duration kHelpsAfter = 20s, kHelpsAgain = 30s;

void pass_on(std::exception_ptr error) {
  if (error) std::rethrow_exception(error);
}

// As often as they stand here.
constexpr std::string_view kLines[]{"status",
                                    "why",
                                    "faults",
                                    "explain F012",
                                    "explain",
                                    "log 5",
                                    "log x",
                                    "help",
                                    "help go",
                                    "history",
                                    "!!",
                                    "pause",
                                    "pause",
                                    "resume",
                                    "resume",
                                    "resume",
                                    "skip",
                                    "scan",
                                    "scan",
                                    "home",
                                    "goto 3 4",
                                    "stop",
                                    "stop",
                                    "disarm",
                                    "arm",
                                    "arm",
                                    "arm",
                                    "goto 1 2 90",
                                    "goto 1e9 1",
                                    "goto",
                                    "logout",
                                    "quit",
                                    "login\rwrong",
                                    "set-password\rshort",
                                    "teleop sideways",
                                    "stop it, now",
                                    "stpo",
                                    ""};

std::string draw_line(Dice& dice) {
  std::string line(kLines[static_cast<std::size_t>(dice.below(std::size(kLines)))]);
  if (line == "goto 3 4") {
    const double y_m = dice.uniform(-2, 18), x_m = dice.uniform(-2, 18);
    line = fmt::format("goto {:.2f} {:.2f}", x_m, y_m);
  }
  return line + "\r";
}

std::string draw_garbage(Dice& dice) {
  std::string bytes;
  for (int left = 1 + dice.below(40); left > 0; --left) bytes += static_cast<char>(dice.below(256));
  if (dice.below(2) == 0) bytes += '\r';
  return bytes;
}

std::string draw_half_line(Dice& dice) {
  const std::string line = draw_line(dice);
  return line.substr(0, line.size() - 1 - static_cast<std::size_t>(dice.below(3)) % line.size());
}

// A key held down, some of whose repeats are lost; let go of, or left as it is.
void draw_drive(Dice& dice, hal::Duration at, std::vector<Operator::Typed>& typed) {
  constexpr std::string_view kKeys = "wwwxadq5";
  typed.push_back({at, dice.below(5) == 0 ? "teleop numbered\r" : "teleop\r"});
  at += 300ms;
  for (int keys = 1 + dice.below(3); keys > 0; --keys) {
    const char key = kKeys[static_cast<std::size_t>(dice.below(kKeys.size()))];
    const hal::Duration end = at + hal::from_seconds(dice.uniform(0.1, 4));
    for (; at < end; at += kKeyRepeats) {
      if (dice.below(20) == 0) at += hal::from_seconds(dice.uniform(0.05, 0.6));
      typed.push_back({at, std::string(1, key)});
    }
  }
  static constexpr std::string_view kEnds[]{"q", "q", "q", "s", "\x03", ""};
  typed.push_back({at, std::string(kEnds[static_cast<std::size_t>(dice.below(std::size(kEnds)))])});
}

std::string login(std::string_view password = kPassword) {
  return fmt::format("login\r{}\r", password);
}

void draw_sitting(Dice& dice, Operator& who, hal::Duration at) {
  const int kind = dice.below(20);
  if (kind < 11) return who.typed.push_back({at, draw_line(dice)});
  if (kind < 13) return who.typed.push_back({at, draw_garbage(dice)});
  if (kind < 15) return who.typed.push_back({at, draw_half_line(dice)});
  if (kind < 17 && who.knows_password) return who.typed.push_back({at, login()});
  draw_drive(dice, at, who.typed);
}

// Gives the console another password, and mostly logs in with it.
void draw_new_password(Dice& dice, double within_s, std::vector<Operator::Typed>& typed) {
  const hal::Duration at = hal::from_seconds(dice.uniform(0, within_s));
  typed.push_back({at, login()});
  typed.push_back({at + 1s, fmt::format("set-password\r{0}\r{0}\r", kNewPassword)});
  if (dice.below(4) != 0)
    typed.push_back({at + 6s + hal::from_seconds(dice.uniform(0, 20)), login(kNewPassword)});
}

// What the console has the robot do, as the judge hears it.
class Overheard final : public mission::ConsoleRobot {
 public:
  // `look`: at what became of the password, before the judge hears of an order.
  Overheard(mission::ConsoleRobot& robot, Judge& judge, std::function<void()> look)
      : robot_(robot), judge_(judge), look_(std::move(look)) {}
  mission::ConsoleFacts facts() const override { return robot_.facts(); }
  std::vector<std::string> log(std::size_t lines) const override { return robot_.log(lines); }
  std::string obey(const mission::ConsoleOrder& order) override {
    look_();
    judge_.on_order(order);
    return robot_.obey(order);
  }

 private:
  mission::ConsoleRobot& robot_;
  Judge& judge_;
  std::function<void()> look_;
};

std::filesystem::path make_password(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "console-password";
  std::ofstream(file) << kPasswordHash;
  return file;
}

}  // namespace

Operator draw_operator(Dice& dice, double within_s) {
  Operator who;
  who.knows_password = dice.below(4) != 0;
  if (who.knows_password && dice.below(3) != 0)
    who.typed.push_back({hal::from_seconds(dice.uniform(0, 20)), login()});
  for (int left = 3 + dice.below(15); left > 0; --left)
    draw_sitting(dice, who, hal::from_seconds(dice.uniform(0, within_s)));
  std::ranges::stable_sort(who.typed, {}, &Operator::Typed::at);
  if (dice.below(2) == 0) {
    who.disturbed = {.delay = hal::from_seconds(dice.uniform(0, 0.3)),
                     .jitter = {},
                     .loss = dice.uniform(0, 0.3),
                     .corruption = dice.uniform(0, 0.3),
                     .duplication = dice.uniform(0, 0.3),
                     .reordering = dice.uniform(0, 0.3),
                     .chunk_max = static_cast<std::size_t>(dice.below(4)),
                     .cut_after = {}};
    who.disturbed_from = hal::from_seconds(dice.uniform(0, within_s));
    who.disturbed_during = hal::from_seconds(dice.uniform(1, 60));
  }
  if (dice.below(4) == 0) {
    who.cut_from = hal::from_seconds(dice.uniform(0, within_s));
    who.cut_during = hal::from_seconds(dice.uniform(0.05, 20));
  }
  if (who.knows_password && dice.below(3) == 0) {
    draw_new_password(dice, within_s, who.typed);
    std::ranges::stable_sort(who.typed, {}, &Operator::Typed::at);
  }
  return who;
}

struct OperatorAtConsole::Console {
  Console(const Parts& parts, const std::filesystem::path& folder)
      : judge(parts.judge),
        robot({parts.survey.gate(), parts.survey.survey(), parts.drivers, {}}),
        overheard(robot, judge, [this] { look_at_password(); }),
        hub({.password = make_password(folder), .first_number = [] { return 1000U; }}, parts.clock,
            overheard, parts.compute),
        person(parts.executor, parts.clock, hub, console_test::kAtTheLine) {}

  // Once it was set only the new one logs anybody in, and whoever was logged in is so no more.
  void look_at_password() {
    if (password_set) return;
    for (const std::string& line : hub.log(mission::ConsoleHub::kLogMax))
      password_set |= line.ends_with("the password was set");
    if (password_set) judge.on_password_set();
  }
  std::string_view password() const { return password_set ? kNewPassword : kPassword; }

  Judge& judge;
  bool password_set = false;
  mission::RobotConsole robot;
  Overheard overheard;
  mission::ConsoleHub hub;
  console_test::Person person;
  Hash shown;
};

OperatorAtConsole::OperatorAtConsole(const Operator& who, Parts parts,
                                     const std::filesystem::path& folder)
    : who_(who), parts_(parts), console_(std::make_unique<Console>(parts, folder)) {
  parts_.survey.survey().orders().tell_to([this](const std::string& what) { tell(what); });
}

OperatorAtConsole::~OperatorAtConsole() {
  parts_.survey.survey().orders().tell_to({});
}

void OperatorAtConsole::tell(const std::string& what) {
  console_->hub.tell(what);
}

std::uint64_t OperatorAtConsole::hash() const {
  return console_->shown.value();
}

void OperatorAtConsole::begin() {
  boost::asio::co_spawn(parts_.executor, types(), pass_on);
  boost::asio::co_spawn(parts_.executor, line(), pass_on);
  boost::asio::co_spawn(parts_.executor, reads(), pass_on);
  boost::asio::co_spawn(parts_.executor, helps(), pass_on);
}

bool OperatorAtConsole::password_set() const {
  console_->look_at_password();
  return console_->password_set;
}

// What would make a login, whoever sent it.
void OperatorAtConsole::type(const std::string& bytes) {
  console_->look_at_password();
  if (bytes.find(console_->password()) != std::string::npos) parts_.judge.on_password();
  console_->person.type(bytes);
}

hal::Task<void> OperatorAtConsole::types() {
  for (const Operator::Typed& typed : who_.typed) {
    co_await parts_.clock.sleep_until(hal::Time(typed.at));
    type(typed.bytes);
  }
}

hal::Task<void> OperatorAtConsole::line() {
  struct Turn {
    hal::Duration at{};
    bool cuts{}, begins{};
  };
  std::vector<Turn> turns;
  if (who_.disturbed_during > hal::Duration{}) {
    turns.push_back({who_.disturbed_from, false, true});
    turns.push_back({who_.disturbed_from + who_.disturbed_during, false, false});
  }
  if (who_.cut_from) {
    turns.push_back({*who_.cut_from, true, true});
    turns.push_back({*who_.cut_from + who_.cut_during, true, false});
  }
  std::ranges::stable_sort(turns, {}, &Turn::at);
  sim::StreamWire& wire = console_->person.wire();
  for (const Turn& turn : turns) {
    co_await parts_.clock.sleep_until(hal::Time(turn.at));
    if (!turn.cuts)
      wire.set_faults(turn.begins ? who_.disturbed : sim::LinkFaults{});
    else if (turn.begins)
      wire.cut();
    else
      wire.mend();
  }
}

hal::Task<void> OperatorAtConsole::reads() {
  for (;;) {
    co_await parts_.clock.sleep_for(kReads);
    for (const char byte : console_->person.shown()) console_->shown.add(byte);
  }
}

// Whatever was typed and however, somebody who knows the password can have the mission go on.
hal::Task<void> OperatorAtConsole::helps() {
  const hal::Duration last = who_.typed.empty() ? hal::Duration{} : who_.typed.back().at;
  const hal::Duration whole = std::max(who_.disturbed_from + who_.disturbed_during,
                                       who_.cut_from.value_or(0s) + who_.cut_during);
  co_await parts_.clock.sleep_until(hal::Time(std::max(last, whole) + kHelpsAfter));
  for (;;) {
    if (parts_.survey.survey().orders().waits()) {
      type("\x03\x03\r");
      co_await parts_.clock.sleep_for(1s);
      console_->look_at_password();
      type(login(console_->password()));
      co_await parts_.clock.sleep_for(1s);
      type("resume\r");
    }
    co_await parts_.clock.sleep_for(kHelpsAgain);
  }
}

}  // namespace dst
