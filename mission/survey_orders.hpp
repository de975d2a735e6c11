// What a person orders of a survey while it runs. The survey looks at it between its steps, and is
// interrupted in them. For one event loop.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/clock.hpp"
#include "hal/wake.hpp"

namespace mission {

class SurveyOrders {
 public:
  enum class Kind { pause, resume, skip, home, take_over, go, scan };
  struct Order {
    Kind kind{};
    hal::Pose2 goal = {};      // Of go.
    bool has_heading = false;  // Else it arrives as it comes.
    hal::Time given_at = {};
  };
  static constexpr std::size_t kGivenMax = 64;  // Orders that no step looked at; later ones wait.

  explicit SurveyOrders(hal::Clock& clock) : clock_(clock) {}

  // A person's. Says what becomes of it. Whatever moves the robot otherwise than the mission would
  // (take_over, go, scan) lets the mission wait until Kind::resume.
  std::string give(Order order);
  // How the mission waits, or what for; empty: it does not.
  std::string text() const;
  // Who else is to hear what becomes of orders.
  void tell_to(std::function<void(const std::string&)> tell) { tell_ = std::move(tell); }

  // The survey's. While it does not run there is nothing to order.
  void begin(bool has_robot);
  void end() { running_ = false; }
  void tell(const std::string& what) const;
  std::vector<Order> take_given();  // For its log.
  std::optional<Order> take_errand();
  void errand_over() { on_errand_ = false; }
  bool take_skip() { return std::exchange(skip_, false); }
  bool take_moved() { return std::exchange(moved_, false); }  // A person moved the robot.
  bool take_home();
  // It goes home of itself, and nobody has to order that any more. A person may still take over.
  void goes_home(std::string why);
  bool waits() const { return waits_; }
  // A pause lets a scan be finished.
  void scanning(bool scans) { scanning_ = scans; }
  bool is_scanning() const { return scanning_; }
  // From the beginning of a step: what is ordered from now on interrupts it.
  void begin_step() { interrupted_ = false; }
  hal::Task<void> until_interrupted();
  hal::Task<void> until_given() { return changed_.wait(); }

 private:
  std::string pause();
  std::string resume();
  std::string skip();
  std::string home();
  std::string take_over();
  std::string send(const Order& errand);
  void interrupt();

  hal::Clock& clock_;
  std::function<void(const std::string&)> tell_;
  hal::Wake changed_;
  bool running_ = false, has_robot_ = false;
  bool waits_ = false, skip_ = false, home_ = false, goes_home_ = false, moved_ = false;
  bool scanning_ = false, on_errand_ = false, interrupted_ = false;
  std::string home_why_ = "sent home by the operator";
  std::optional<Order> errand_;
  std::vector<Order> given_;
};
std::string_view name(SurveyOrders::Kind kind);

}  // namespace mission
