// One operator's session on a plain terminal of 80 x 24: commands in, answers and orders out. Works
// without a mission, a planner or a network. Pure: bytes and times in, bytes out; what it orders
// goes through ConsoleRobot.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mission/console_line.hpp"
#include "mission/console_login.hpp"
#include "mission/faults.hpp"
#include "mission/gate.hpp"

namespace mission {

// A fault that is there now; `detail` says where, in the device's words.
struct FaultNow {
  FaultCode code{};
  std::string detail;
};

// What a session can say of the robot.
struct ConsoleFacts {
  Mode mode = Mode::stopped;
  bool released{};
  bool has_password{};
  std::string why;      // Why it stands, and what to do; empty: nothing is wrong.
  std::string mission;  // How far it is; empty: there is none.
  std::string orders;   // What an operator has ordered of it; empty: nothing.
  std::optional<hal::Pose2> pose;
  double sigma_m{};              // Of the pose, along its worse axis.
  std::vector<FaultNow> faults;  // The gravest first.
};

struct ConsoleOrder {
  enum class Kind : std::uint8_t {
    stop,       // Stand now, until armed again. Anybody may.
    arm,        // A person's release.
    take_over,  // The operator is about to drive: the mission lets go of the robot.
    drive,      // A dead-man key: `packet`, whose sequence the robot gives.
    go,         // To `pose`.
    scan,
    pause,
    resume,
    skip,
    home,
    restart,            // The program ends, and begins a new run,
    resume_from_start,  // or goes on with this one by a robot that stands at its start.
    check_password,     // Answered later by ConsoleSession::password_checked.
    set_password,       // Answered later by ConsoleSession::password_set.
  };
  Kind kind{};
  hal::Pose2 pose = {};
  bool has_heading = false;  // Else any will do.
  OperatorPacket packet = {};
  std::string password = {};
};

// The robot as a console sees it.
class ConsoleRobot {
 public:
  virtual ~ConsoleRobot() = default;
  virtual ConsoleFacts facts() const = 0;
  // What happened last, the newest last, at most `lines` of it.
  virtual std::vector<std::string> log(std::size_t lines) const = 0;
  // Does it, or has it done; returns what is to be said about it.
  virtual std::string obey(const ConsoleOrder& order) = 0;
};

// What the dead-man keys make the robot do; nothing: the key stops it.
std::optional<hal::Twist> teleop_twist(char key);

class ConsoleSession {
 public:
  static constexpr hal::Duration kIdleLogout = std::chrono::minutes(10);
  static constexpr int kColumns = 79;  // One short of 80: no terminal wraps it.
  static constexpr int kRows = 22;     // Of one answer, so that its command stays in sight.
  // A numbered key counts when its number is newer than all before, but not by more than this: what
  // was recorded in another session counts for nothing.
  static constexpr std::uint32_t kNumbersAhead = 64;
  // From a program that will number its keys: then `teleop` means `teleop numbered`.
  static constexpr std::uint8_t kNumbersKeys = 0x05;

  struct Config {
    // May set the first password: whoever is at the serial line, or root on the socket.
    bool may_set_first_password{};
    // Numbered keys count from here: no other session may begin there, before or after a restart.
    std::uint32_t first_number{};
  };
  // Robot and limit must outlive it.
  ConsoleSession(Config config, ConsoleRobot& robot, LoginLimit& limit, hal::Time now);

  // Each returns what is to be shown.
  std::string greeting() const;
  std::string receive(std::span<const std::uint8_t> bytes, hal::Time now);
  std::string tick(hal::Time now);                       // Often: logs out who has gone.
  std::string notice(std::string_view what);             // Something happened.
  std::string password_checked(bool is_right);           // Answers to orders.
  std::string password_set(const std::string& problem);  // Empty: it is.
  // The link was lost, or the password changed: nobody is logged in any more.
  void log_out();

  bool logged_in() const { return logged_in_; }
  bool drives() const { return teleop_ != Teleop::off; }
  bool quits() const { return quits_; }  // `quit`: a socket is closed.

 private:
  struct Command;
  enum class Asks : std::uint8_t { nothing, password, new_password, again };
  enum class Teleop : std::uint8_t { off, keys, numbered };
  using Words = std::vector<std::string_view>;

  static std::span<const Command> commands();
  static const Command* find(std::string_view name);

  void take_line(ConsoleLine::Entered entered, hal::Time now, std::string& out);
  std::string carry_out(const std::string& line, hal::Time now);
  std::string run(const Command& command, const Words& words, hal::Time now);
  std::string refusal(const Command& command) const;
  std::string prompt() const;

  std::string status(const Words& words);
  std::string why(const Words& words);
  std::string faults(const Words& words);
  std::string explain(const Words& words);
  std::string log(const Words& words);
  std::string help(const Words& words);
  std::string history(const Words& words);
  std::string stop(const Words& words);
  std::string arm(const Words& words);
  std::string teleop(const Words& words);
  std::string go(const Words& words);
  std::string scan(const Words& words);
  std::string pause(const Words& words);
  std::string resume(const Words& words);
  std::string skip(const Words& words);
  std::string home(const Words& words);
  std::string restart(const Words& words);
  std::string login(const Words& words);
  std::string logout(const Words& words);
  std::string set_password(const Words& words);
  std::string quit(const Words& words);

  std::string simple(ConsoleOrder::Kind kind);
  std::string answer(Asks asks, const std::string& text, hal::Time now);
  std::string begin_login(hal::Time now);

  void take_key(char key, std::string& out);
  void take_numbered(char key, std::string& out);
  void drive(char key, std::string& out);
  void leave_teleop(std::string& out);
  void stand();

  const Config config_;
  ConsoleRobot& robot_;
  LoginLimit& limit_;
  ConsoleLine line_;
  Asks asks_ = Asks::nothing;
  bool logged_in_ = false, checking_ = false, quits_ = false, numbers_keys_ = false;
  std::string new_password_;
  hal::Time now_, heard_at_;
  Teleop teleop_ = Teleop::off;
  std::uint32_t last_number_;
  char key_ = 0;  // Of a numbered key whose number is arriving.
  std::uint64_t number_ = 0;
  char moves_by_ = 0;  // The key that drives the robot now; 0: none.
};

}  // namespace mission
