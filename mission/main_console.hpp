// The consoles of a robot: what they say and order, and where operators sit. Like main.cpp it may
// know everything.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"
#include "mission/boot_mark.hpp"
#include "mission/console_hub.hpp"
#include "mission/gated_drive.hpp"
#include "mission/main_robot.hpp"
#include "mission/survey.hpp"

namespace mission {

using LinkTroubles = std::function<std::vector<drivers::Trouble>(std::string_view role)>;

// Everything that is wrong now, the gravest first, each once.
std::vector<FaultNow> faults_now(const RobotDrivers& drivers, const LinkTroubles& link_troubles,
                                 const GatedDrive& gate, const DiskWatch& disk);

// A robot with its mission, as consoles see it.
class RobotConsole final : public ConsoleRobot {
 public:
  struct Parts {
    GatedDrive& gate;
    Survey& survey;
    const RobotDrivers& drivers;
    LinkTroubles link_troubles;  // May be empty.
    // Ends the program in order, and has it begin again so. Empty: nobody would start it again.
    std::function<void(NextStart)> start_again = {};
  };
  // All must outlive it.
  explicit RobotConsole(Parts parts) : parts_(std::move(parts)) {}

  ConsoleFacts facts() const override;
  // The hub has it.
  std::vector<std::string> log(std::size_t) const override { return {}; }
  std::string obey(const ConsoleOrder& order) override;

 private:
  std::string arm();
  std::string start_again(NextStart next);
  std::string drive(OperatorPacket packet);
  std::string order(SurveyOrders::Order order);

  Parts parts_;
  std::uint32_t sequence_ = 0;  // Of the latest packet to the gate, of all consoles together.
};

// A serial line and a UNIX socket, as the robot file names them.
class ConsolePlaces {
 public:
  static constexpr int kConnectionsMax = 8;  // One more is told so, and closed.

  // Clock and hub must outlive run().
  ConsolePlaces(ConsoleConfig config, const boost::asio::any_io_executor& executor,
                hal::Clock& clock, ConsoleHub& hub);
  ~ConsolePlaces();

  // Ends only by cancellation. A place that cannot be opened is told, and tried again.
  hal::Task<void> run();

 private:
  struct Socket;
  hal::Task<void> serve_line();
  hal::Task<void> serve_socket();

  const ConsoleConfig config_;
  boost::asio::any_io_executor executor_;
  hal::Clock& clock_;
  ConsoleHub& hub_;
  std::unique_ptr<Socket> socket_;
};

// Both, for as long as a program runs on an event loop: begins at once.
class Consoles {
 public:
  // Hears what happens; the parts, io and clock must outlive it.
  Consoles(const ConsoleConfig& config, RobotConsole::Parts parts, boost::asio::io_context& io,
           hal::Clock& clock, hal::Compute& compute);
  ~Consoles() { end(); }
  Consoles(const Consoles&) = delete;
  Consoles& operator=(const Consoles&) = delete;

  ConsoleHub& hub() { return hub_; }
  // Closes all of them, and returns when that is done. Called again: nothing.
  void end();

 private:
  boost::asio::io_context& io_;
  RobotConsole robot_;
  ConsoleHub hub_;
  ConsolePlaces places_;
  boost::asio::cancellation_signal cancel_;
  bool closing_ = false, over_ = false;
};

}  // namespace mission
