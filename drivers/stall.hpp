// Tells a blocked way from a free one: wheels that stand though they are told to turn.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "hal/values.hpp"

namespace drivers {

class StallWatch {
 public:
  struct Limits {
    hal::Duration after = std::chrono::milliseconds(500);  // Longer than a drive needs to set off.
    double speed_min_mps = 0.03;   // Slower commands prove nothing: encoders count millimetres.
    double moved_share_max = 0.2;  // Of what was told: less is standing.
  };
  StallWatch() = default;
  explicit StallWatch(Limits limits) : limits_(limits) {}

  // What a side was told to do and what it did over `step`.
  void update(double told_mps, double rolled_m, hal::Duration step) {
    const bool told = std::abs(told_mps) >= limits_.speed_min_mps;
    const bool turned = told_mps * told_before_mps_ < 0;
    const bool stands =
        std::abs(rolled_m) < limits_.moved_share_max * std::abs(told_mps) * hal::seconds(step);
    told_before_mps_ = told_mps;
    if (!told || turned)
      standing_ = {};
    else  // A wheel that slips once is not yet free.
      standing_ = stands ? standing_ + step : std::max(hal::Duration(0), standing_ - 2 * step);
  }
  void reset() { standing_ = {}; }
  hal::Duration standing() const { return standing_; }  // Limits::after of it: blocked.

 private:
  Limits limits_;
  double told_before_mps_ = 0;
  hal::Duration standing_{};
};

// Whether two measurements of the same roll agree: the speed that a drive says and the travel that
// its counters show.
class Agreement {
 public:
  // Both of magnitudes, over `step`.
  void update(double speed_mps, double rolled_m, hal::Duration step) {
    if (step > kStepMax) {  // One speed does not stand for all that time.
      by_speed_m_ = by_counter_m_ = 0;
      return;
    }
    by_speed_m_ += speed_mps * hal::seconds(step);
    by_counter_m_ += rolled_m;
    if (std::max(by_speed_m_, by_counter_m_) < kSpan_m) return;
    disagree_ = std::abs(by_speed_m_ - by_counter_m_) > kShareMax * kSpan_m;
    by_speed_m_ = by_counter_m_ = 0;
  }
  bool disagree() const { return disagree_; }

 private:
  static constexpr hal::Duration kStepMax = std::chrono::milliseconds(100);
  static constexpr double kSpan_m = 0.5, kShareMax = 0.25;
  double by_speed_m_ = 0, by_counter_m_ = 0;
  bool disagree_ = false;
};

// One side of the robot.
struct SideWatch {
  StallWatch stall;
  Agreement agreement;

  void update(double told_mps, double speed_mps, double rolled_m, hal::Duration step) {
    stall.update(told_mps, rolled_m, step);
    agreement.update(std::abs(speed_mps), std::abs(rolled_m), step);
  }
};

// The way is blocked in the direction of a command; it stays so until something else is commanded.
class BlockedWay {
 public:
  void block(const hal::Twist& by) { by_ = by; }
  bool blocked() const { return by_.has_value(); }
  // Whether this command would push on. One that does not frees the way.
  bool refuses(const hal::Twist& twist) {
    if (!by_) return false;
    const double was = by_->forward_mps != 0 ? by_->forward_mps : by_->turn_radps;
    const double now = by_->forward_mps != 0 ? twist.forward_mps : twist.turn_radps;
    if (was * now > 0) return true;
    by_.reset();
    return false;
  }

 private:
  std::optional<hal::Twist> by_;
};

}  // namespace drivers
