// Serves operators' consoles, several at once. A console that reads slowly, or not at all, loses
// what does not fit: it never holds up anything, and nothing grows.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hal/clock.hpp"
#include "hal/compute.hpp"
#include "hal/links.hpp"
#include "mission/console.hpp"
#include "mission/password.hpp"

namespace mission {

class ConsoleHub {
 public:
  static constexpr std::size_t kOutputMax = 16384;  // Bytes that wait for one console.
  static constexpr std::size_t kLogMax = 200;       // Lines kept; then the oldest goes.
  // After each piece of input: nobody who floods a console takes the event loop for themselves.
  static constexpr std::size_t kPieceMax = 128;
  static constexpr hal::Duration kPause = std::chrono::milliseconds(2);
  static constexpr hal::Duration kTick = std::chrono::milliseconds(50);

  struct Config {
    std::filesystem::path password;  // See PasswordFile.
    // Where a session's numbered keys begin: not to be foreseen, at least 1.
    std::function<std::uint32_t()> first_number;
  };
  // All must outlive it. `compute` checks passwords, which takes a while.
  ConsoleHub(Config config, hal::Clock& clock, ConsoleRobot& robot, hal::Compute& compute);
  ~ConsoleHub();

  enum class Link {
    line,        // Goes on for ever: each time that it was lost a new session begins.
    connection,  // Ends with it, and with `quit`.
  };
  struct Who {
    Link link{};
    bool may_set_first_password{};
  };
  // Any number at once: whoever accepts them bounds them. Ends as Link says, or by cancellation.
  hal::Task<void> serve(hal::ByteStream& stream, Who who);

  // Something happened: for the log, and for everybody who sits at a console.
  void tell(const std::string& what);
  std::vector<std::string> log(std::size_t lines) const;
  std::size_t sessions() const { return seats_.size(); }

 private:
  class Seat;
  hal::Task<void> sit(Seat& seat);
  hal::Task<void> keep_company(Seat& seat);
  hal::Task<void> read(Seat& seat);
  hal::Task<void> write(Seat& seat);
  hal::Task<void> tick(Seat& seat);
  hal::Task<void> do_jobs(Seat& seat);

  const Config config_;
  hal::Clock& clock_;
  ConsoleRobot& robot_;
  hal::Compute& compute_;
  PasswordFile passwords_;     // Only in `compute_`.
  bool has_password_ = false;  // As it is now.
  LoginLimit limit_;
  std::vector<Seat*> seats_;
  std::deque<std::string> log_;
};

// For ConsoleHub::Config::first_number.
std::uint32_t unforeseeable_number();

}  // namespace mission
