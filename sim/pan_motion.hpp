// How a pan axis turns: evenly, with ramps, and exactly computable for any time.
#pragma once

#include <array>

#include "hal/values.hpp"

namespace sim {

// From a position and a speed to a target. Units are the caller's (steps); time is ours.
class PanMotion {
 public:
  PanMotion() = default;  // Stands at 0.
  PanMotion(hal::Time begin, double at, double speed, double target, double speed_max,
            double acceleration);
  // Stands there.
  static PanMotion standing(double at);
  // Slows down from a motion's state to a stop as fast as it may.
  static PanMotion stopping(hal::Time begin, double at, double speed, double acceleration);

  double at(hal::Time time) const;
  double speed(hal::Time time) const;
  double target() const { return target_; }
  hal::Time end() const { return end_; }

 private:
  struct Part {
    double duration_s{}, acceleration{};
  };
  struct State {
    double at{}, speed{};
  };
  State state(hal::Time time) const;
  void set_out(double speed, double speed_max, double acceleration);
  void close();

  hal::Time begin_{}, end_{};
  double start_{}, start_speed_{}, target_{};
  std::array<Part, 3> parts_{};  // Speed up (or down), cruise, slow down.
};

}  // namespace sim
