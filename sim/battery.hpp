// The robot's battery: charge that standing and driving use up.
#pragma once

#include <optional>

#include "sim/world.hpp"

namespace sim {

struct BatteryConfig {
  double capacity_ah = 30;
  double full_v = 29.2, empty_v = 22;  // Linear between them.
  double standing_w = 60;              // Computer, scanner, radio.
  double moving_w = 300;               // On top of that, while the wheels turn.
  double charge_percent = 100;         // At the start.
  double temperature_c = 25;
};

// Counts whenever it is asked: between two questions the robot counts as doing what it did at the
// first.
class Battery {
 public:
  Battery(const BatteryConfig& config, const World& world) : config_(config), world_(world) {}

  void update(hal::Time now) {
    if (!updated_) updated_ = now;  // Its time begins with the first question.
    if (now < *updated_) return;
    used_ah_ += current_a() * hal::seconds(now - *updated_) / 3600;
    if (used_ah_ > start_ah()) used_ah_ = start_ah();
    moving_ = world_.moving();
    updated_ = now;
  }

  double current_a() const {  // Taken out; positive.
    return (config_.standing_w + (moving_ ? config_.moving_w : 0)) / voltage_v();
  }
  double voltage_v() const {
    return config_.empty_v + (config_.full_v - config_.empty_v) * charge_percent() / 100;
  }
  double charge_percent() const { return (start_ah() - used_ah_) / config_.capacity_ah * 100; }
  double consumed_ah() const {  // From full.
    return config_.capacity_ah - start_ah() + used_ah_;
  }
  double temperature_c() const { return config_.temperature_c; }
  double time_to_go_s() const { return (start_ah() - used_ah_) / current_a() * 3600; }

 private:
  double start_ah() const { return config_.capacity_ah * config_.charge_percent / 100; }

  BatteryConfig config_;
  const World& world_;
  std::optional<hal::Time> updated_;
  double used_ah_ = 0;
  bool moving_ = false;
};

}  // namespace sim
