// Somebody at the robot's serial console: what they type is drawn from a seed, as is what their
// line does to it.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <string>
#include <vector>

#include "mission/main_console.hpp"
#include "sim/sim_clock.hpp"
#include "tests/dst/rig/judge.hpp"
#include "tests/dst/rig/scenario.hpp"
#include "tests/support/random_site.hpp"

namespace dst {

// The console's password, and a hash of it that is quickly checked: how slow that is on a robot is
// tested elsewhere. kNewPassword: what an operator may change it to.
inline constexpr std::string_view kPassword = "correct horse", kNewPassword = "battery staple";
inline constexpr std::string_view kPasswordHash =
    "$argon2id$v=19$m=8,t=1,p=1$4AEZZwyOVbKeATZ8BGTWuw$eK4hZ60JkfImnOE3Chcyv7opLayHV8c3BRlbKosb+"
    "a0\n";

Operator draw_operator(support::Dice& dice, double within_s);

// The shipped console on a serial line in memory, and who sits there.
class OperatorAtConsole {
 public:
  struct Parts {
    boost::asio::any_io_executor executor;
    sim::SimClock& clock;
    hal::Compute& compute;
    mission::GuardedSurvey& survey;
    const mission::RobotDrivers& drivers;
    Judge& judge;
  };
  // All must outlive it. `folder`: for the password's file.
  OperatorAtConsole(const Operator& who, Parts parts, const std::filesystem::path& folder);
  ~OperatorAtConsole();

  void begin();
  void tell(const std::string& what);
  std::uint64_t hash() const;  // Of all that was shown.
  bool password_set() const;   // kNewPassword counts.

 private:
  struct Console;
  hal::Task<void> types();
  hal::Task<void> line();
  hal::Task<void> reads();
  hal::Task<void> helps();
  void type(const std::string& bytes);

  const Operator& who_;
  Parts parts_;
  std::unique_ptr<Console> console_;
};

}  // namespace dst
