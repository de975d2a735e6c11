// What comes over a console's line is outside bytes: whatever they are, nothing moves the robot
// that was not logged in and armed, what is shown fits a plain terminal, and nothing grows.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "mission/console.hpp"

namespace {

using mission::ConsoleOrder;
using Kind = ConsoleOrder::Kind;

void require(bool holds) {
  if (!holds) std::abort();
}

class Robot final : public mission::ConsoleRobot {
 public:
  mission::ConsoleFacts facts() const override {
    mission::ConsoleFacts facts;
    facts.released = released;
    facts.has_password = has_password;
    facts.faults = {{mission::FaultCode::drive_silent, "\x01\xFF far too long a detail of it all"}};
    return facts;
  }
  std::vector<std::string> log(std::size_t lines) const override {
    require(lines >= 1 && lines <= 20);
    return {std::string(300, 'x'), "\x1B[2J"};
  }
  std::string obey(const ConsoleOrder& order) override {
    const bool stands = order.kind == Kind::stop || order.kind == Kind::pause ||
                        (order.kind == Kind::drive && !order.packet.dead_man);
    const bool of_passwords =
        order.kind == Kind::check_password || order.kind == Kind::set_password;
    require(stands || of_passwords || logged_in);
    require(std::isfinite(order.pose.position_m.x()) && std::isfinite(order.pose.heading_rad));
    require(std::isfinite(order.packet.twist.forward_mps));
    if (order.kind == Kind::drive && order.packet.dead_man) require(has_taken_over);
    if (order.kind == Kind::take_over) require(released), has_taken_over = true;
    if (of_passwords) require(!checks), checks = true;
    require(order.password.size() <= mission::ConsoleLine::kCharactersMax);
    return released ? "" : "not armed";
  }

  bool released = false, has_password = true, logged_in = false, checks = false;
  bool has_taken_over = false;
};

// Of the answers: what people type comes back as they type it.
void check_shown(const std::string& shown) {
  require(shown.size() <= 200'000);
  for (const char c : shown) require(c == '\r' || c == '\n' || c == '\b' || (c >= ' ' && c <= '~'));
}

}  // namespace

// First byte: what is so. Then pieces, each after a byte that says what happens before it, and how
// long it is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Robot robot;
  robot.released = (data[0] & 1) != 0;
  robot.has_password = (data[0] & 2) != 0;
  mission::LoginLimit limit;
  hal::Time now(std::chrono::seconds(1));
  mission::ConsoleSession session(
      {.may_set_first_password = (data[0] & 4) != 0, .first_number = 1000}, robot, limit, now);
  for (std::size_t at = 1; at < size;) {
    const std::uint8_t what = data[at++];
    const std::size_t length = std::min<std::size_t>(what >> 2, size - at);
    if (robot.checks && (what & 1) != 0) {
      robot.checks = false;
      robot.logged_in = (what & 2) != 0;
      check_shown(session.password_checked(robot.logged_in));
    } else if ((what & 3) == 2) {
      now += std::chrono::seconds(length * length);
      check_shown(session.tick(now));
      check_shown(session.notice("something happened"));
    }
    check_shown(session.receive({data + at, length}, now));
    robot.logged_in = robot.logged_in && session.logged_in();
    require(session.logged_in() == robot.logged_in);
    at += length;
  }
  session.log_out();
  require(!session.logged_in() && !session.drives());
  return 0;
}
