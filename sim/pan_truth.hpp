// Where a pan axis really stands, for what sits on it.
#pragma once

#include <cstdint>

#include "hal/values.hpp"

namespace sim {

class PanTruth {
 public:
  virtual ~PanTruth() = default;
  // Counter-clockwise from the x axis of S. Times from the last change on; for later ones as the
  // motion goes on if nothing changes it.
  virtual double angle_rad(hal::Time time) const = 0;
  // Counts what changed the motion: answers for later times given before are out of date.
  virtual std::uint64_t changes() const = 0;
};

class FixedPan final : public PanTruth {
 public:
  explicit FixedPan(double angle_rad = 0) : angle_rad_(angle_rad) {}
  double angle_rad(hal::Time) const override { return angle_rad_; }
  std::uint64_t changes() const override { return 0; }

 private:
  double angle_rad_;
};

}  // namespace sim
