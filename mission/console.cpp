#include "mission/console.hpp"

#include <fmt/format.h>

#include <utility>

#include "mission/console_text.hpp"

namespace mission {
namespace {

constexpr std::size_t kPasswordLengthMin = 8;

struct DeadManKey {
  char key;
  hal::Twist twist;  // The gate limits it further.
  std::string_view word;
};
// `s`, in their middle, stops, so that no letter of "stop" moves anything.
constexpr DeadManKey kDeadManKeys[]{
    {'w', {0.3, 0}, "forward"},
    {'x', {-0.2, 0}, "back"},
    {'a', {0, 0.4}, "left"},
    {'d', {0, -0.4}, "right"},
};

const DeadManKey* dead_man_key(char key) {
  for (const DeadManKey& each : kDeadManKeys)
    if (each.key == key) return &each;
  return nullptr;
}

constexpr char kInterruptKey = 0x03, kLeave = 'q', kNumberEnd = '.';

// How long the gate heeds a key; afterwards it is shown to have ended.
constexpr hal::Duration kKeyCounts = GateConfig{}.teleop_max;

std::string_view word(ConsoleLine::Fault fault) {
  return fault == ConsoleLine::Fault::too_long ? "line too long: at most 160 characters"
                                               : "line damaged: it held bytes that are no text";
}

}  // namespace

std::optional<hal::Twist> teleop_twist(char key) {
  const DeadManKey* const found = dead_man_key(key);
  return found ? std::optional(found->twist) : std::nullopt;
}

ConsoleSession::ConsoleSession(Config config, ConsoleRobot& robot, LoginLimit& limit, hal::Time now)
    : config_(config),
      robot_(robot),
      limit_(limit),
      now_(now),
      heard_at_(now),
      last_number_(config.first_number) {}

std::string ConsoleSession::greeting() const {
  return console_text("\nVantage. `help` lists the commands; `stop` always stops the robot.") +
         prompt();
}

std::string ConsoleSession::prompt() const {
  if (quits_ || drives()) return "";
  switch (asks_) {
    case Asks::password:
      return "password: ";
    case Asks::new_password:
      return "new password: ";
    case Asks::again:
      return "again: ";
    case Asks::nothing:
      break;
  }
  return logged_in_ ? "vantage# " : "vantage> ";
}

std::string ConsoleSession::receive(std::span<const std::uint8_t> bytes, hal::Time now) {
  std::string out = tick(now);
  if (!bytes.empty()) heard_at_ = now;
  for (const std::uint8_t byte : bytes) {
    if (quits_) break;
    if (byte == kNumbersKeys)
      numbers_keys_ = true;
    else if (drives())
      take_key(static_cast<char>(byte), out);
    else if (auto entered = line_.take(byte, out))
      take_line(std::move(*entered), now, out);
  }
  return out;
}

void ConsoleSession::take_line(ConsoleLine::Entered entered, hal::Time now, std::string& out) {
  const Asks asks = std::exchange(asks_, Asks::nothing);
  line_.hide(false);
  std::string said;
  if (entered.fault != ConsoleLine::Fault::none) {
    // Noise beside a stop does not keep it from stopping.
    const bool stops = entered.text.find("stop") != std::string::npos;
    said = fmt::format("{}; {}", word(entered.fault), stops ? stop({}) : "nothing was done");
  } else if (asks != Asks::nothing) {
    said = answer(asks, entered.text, now);
  } else {
    said = carry_out(entered.text, now);
  }
  out += console_text(said) + prompt();
}

std::string ConsoleSession::answer(Asks asks, const std::string& text, hal::Time now) {
  if (asks == Asks::password) {
    if (text.empty()) return "not logged in";
    if (const auto locked = limit_.locked_for(now))
      return fmt::format("too many wrong passwords: wait {:.0f} s", hal::seconds(*locked));
    limit_.begin_try(now);
    checking_ = true;
    ConsoleOrder order{.kind = ConsoleOrder::Kind::check_password};
    order.password = text;
    return robot_.obey(order);
  }
  if (asks == Asks::new_password) {
    if (text.size() < kPasswordLengthMin)
      return fmt::format("too short: at least {} characters; nothing was changed",
                         kPasswordLengthMin);
    new_password_ = text;
    asks_ = Asks::again;
    line_.hide(true);
    return "";
  }
  const std::string first = std::exchange(new_password_, {});
  if (first != text) return "the two differ; nothing was changed";
  if (!logged_in_ && robot_.facts().has_password)
    return "somebody else has set one meanwhile; nothing was changed";
  checking_ = true;
  ConsoleOrder order{.kind = ConsoleOrder::Kind::set_password};
  order.password = text;
  return robot_.obey(order);
}

std::string ConsoleSession::password_checked(bool is_right) {
  checking_ = false;
  logged_in_ = is_right;
  if (!is_right)
    return notice(limit_.tries_left() > 0
                      ? fmt::format("wrong password; {} more may be tried", limit_.tries_left())
                      : fmt::format("wrong password; nobody may try for {:.0f} s",
                                    hal::seconds(LoginLimit::kLocked)));
  limit_.was_right();
  return notice("logged in");
}

std::string ConsoleSession::password_set(const std::string& problem) {
  checking_ = false;
  return notice(problem.empty() ? "the password is set: `login` with it" : problem);
}

void ConsoleSession::log_out() {
  if (drives()) stand();
  teleop_ = Teleop::off;
  logged_in_ = false;
  asks_ = Asks::nothing;
  new_password_.clear();
  line_.hide(false);
  line_.clear();
}

std::string ConsoleSession::tick(hal::Time now) {
  now_ = now;
  std::string out;
  if (moves_by_ != 0 && now - heard_at_ > kKeyCounts) {
    moves_by_ = 0;
    out += console_text("stands");
  }
  const bool away = now - heard_at_ >= kIdleLogout;
  if (!away || (!logged_in_ && asks_ == Asks::nothing)) return out;
  log_out();
  return out + notice("logged out: nothing was typed for 10 minutes");
}

// What is being typed is shown anew below it.
std::string ConsoleSession::notice(std::string_view what) {
  std::string out = drives() ? "" : "\r\n";
  out += console_text(fmt::format("* {}", what)) + prompt();
  out += line_.shown();
  return out;
}

// --- Driving by hand. Every key is one packet of the gate; the robot gives it its sequence.

void ConsoleSession::take_key(char key, std::string& out) {
  if (teleop_ == Teleop::numbered && dead_man_key(key) == nullptr)
    take_numbered(key, out);
  else if (teleop_ == Teleop::numbered)
    key_ = key, number_ = 0;
  else
    drive(key, out);
}

// "w17.": the key, its number and its end. Whatever is neither stops the robot.
void ConsoleSession::take_numbered(char key, std::string& out) {
  if (key >= '0' && key <= '9' && key_ != 0 && number_ <= UINT32_MAX) {
    number_ = 10 * number_ + static_cast<std::uint64_t>(key - '0');
    return;
  }
  const char pressed = std::exchange(key_, '\0');
  if (key != kNumberEnd || pressed == 0) {
    drive(key, out);
    return;
  }
  const bool counts = number_ > last_number_ && number_ - last_number_ <= kNumbersAhead;
  if (!counts) return;  // Repeated, replayed or damaged.
  last_number_ = static_cast<std::uint32_t>(number_);
  drive(pressed, out);
}

void ConsoleSession::drive(char key, std::string& out) {
  const DeadManKey* const pressed = dead_man_key(key);
  if (pressed == nullptr) {
    stand();
    if (std::exchange(moves_by_, '\0') != 0) out += console_text("stands");
    if (key == kLeave || key == kInterruptKey) leave_teleop(out);
    return;
  }
  ConsoleOrder order{.kind = ConsoleOrder::Kind::drive};
  order.packet.dead_man = true;
  order.packet.twist = pressed->twist;
  const std::string problem = robot_.obey(order);
  if (!problem.empty()) {
    out += console_text(problem);
    leave_teleop(out);
  } else if (std::exchange(moves_by_, key) != key) {
    out += console_text(pressed->word);
  }
}

void ConsoleSession::stand() {
  ConsoleOrder order{.kind = ConsoleOrder::Kind::drive};
  (void)robot_.obey(order);  // Standing is never refused.
}

void ConsoleSession::leave_teleop(std::string& out) {
  teleop_ = Teleop::off;
  moves_by_ = 0;
  key_ = 0;
  line_.clear();
  out +=
      console_text("you no longer drive; `resume` hands the robot back to its mission") + prompt();
}

}  // namespace mission
