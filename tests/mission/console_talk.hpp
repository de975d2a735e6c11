// A robot that a console can talk to, and that keeps what it was told.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "mission/console.hpp"

namespace console_test {

using namespace std::chrono_literals;
using Kind = mission::ConsoleOrder::Kind;

inline std::string text_of(const mission::ConsoleOrder& order) {
  static constexpr std::string_view kNames[]{
      "stop",           "arm",         "take over", "drive", "go",      "scan",
      "pause",          "resume",      "skip",      "home",  "restart", "resume from start",
      "check password", "set password"};
  std::string text(kNames[static_cast<std::size_t>(order.kind)]);
  if (order.kind == Kind::go)
    text += fmt::format(" {} {}{}", order.pose.position_m.x(), order.pose.position_m.y(),
                        order.has_heading ? fmt::format(" {:.4f}", order.pose.heading_rad) : "");
  if (order.kind == Kind::drive)
    text += order.packet.dead_man ? fmt::format(" {} {}", order.packet.twist.forward_mps,
                                                order.packet.twist.turn_radps)
                                  : " stand";
  return text + (order.password.empty() ? "" : " '" + order.password + "'");
}

class FakeRobot final : public mission::ConsoleRobot {
 public:
  mission::ConsoleFacts facts() const override { return now; }
  std::vector<std::string> log(std::size_t lines) const override {
    return {happened.end() - static_cast<std::ptrdiff_t>(std::min(lines, happened.size())),
            happened.end()};
  }
  std::string obey(const mission::ConsoleOrder& order) override {
    orders.push_back(text_of(order));
    return order.kind == Kind::drive && order.packet.dead_man && !now.released ? "not armed" : "";
  }
  // What was ordered since the last call, a line each.
  std::string ordered() {
    std::string text;
    for (const std::string& order : orders) text += order + "\n";
    orders.clear();
    return text;
  }

  mission::ConsoleFacts now;
  std::vector<std::string> happened, orders;
};

struct Talk {
  explicit Talk(mission::ConsoleSession::Config config = {.may_set_first_password = true,
                                                          .first_number = 1000})
      : session(config, robot, limit, time) {
    robot.now.has_password = true;
    robot.now.released = true;
    robot.now.mode = mission::Mode::autonomous;
  }

  // What is shown for it, with plain ends of lines.
  std::string type(std::string_view text) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    return plain(session.receive({bytes, text.size()}, time));
  }
  void log_in() {
    type("login\rsecret\r");
    session.password_checked(true);
    robot.ordered();
  }
  std::string wait(hal::Duration span) {
    time += span;
    return plain(session.tick(time));
  }
  static std::string plain(std::string text) {
    std::erase(text, '\r');
    return text;
  }

  FakeRobot robot;
  mission::LoginLimit limit;
  hal::Time time{1h};
  mission::ConsoleSession session;
};

}  // namespace console_test
