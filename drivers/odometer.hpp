// Travel from a device's running counters: right across their wrap, never lost, never invented.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "hal/values.hpp"

namespace drivers {

// Two 32-bit counters, one per side, that run on while nobody listens. One report that cannot be
// true is passed over; several that agree with each other say that the counters were set anew.
class Odometer {
 public:
  struct Config {
    double counts_per_m = 1000;
    double speed_max_mps = 3;
    hal::Duration coasting_max = std::chrono::seconds(2);  // Rolls no longer without commands.
  };
  explicit Odometer(const Config& config) : config_(config) {}

  // A report. False: it was passed over.
  bool update(std::int32_t left, std::int32_t right, hal::Time at) {
    const Counts now{left, right, at};
    if (!last_ || (candidate_ && follows(*candidate_, now) && ++agreeing_ >= kAgreeing)) {
      if (last_) ++restarts_;
      candidate_.reset();
      agreeing_ = 0;
      last_ = now;
      rolled_ = {};
      return true;
    }
    if (!follows(*last_, now)) {
      if (!candidate_ || !follows(*candidate_, now)) agreeing_ = 0;
      candidate_ = now;
      return false;
    }
    candidate_.reset();
    agreeing_ = 0;
    rolled_ = {difference(last_->left, left), difference(last_->right, right), at - last_->at};
    left_ += rolled_.left;
    right_ += rolled_.right;
    last_ = now;
    fresh_ = true;
    return true;
  }

  // The counters are somebody else's now: the next report only says where they stand.
  void restart() {
    last_.reset();
    candidate_.reset();
  }

  bool fresh() const { return fresh_; }  // Something to take.
  // Since it was last taken.
  hal::WheelTravel take() {
    const hal::WheelTravel travel{last_ ? last_->at : hal::Time{},
                                  static_cast<double>(left_) / config_.counts_per_m,
                                  static_cast<double>(right_) / config_.counts_per_m};
    left_ = right_ = 0;
    fresh_ = false;
    return travel;
  }

  // Of the latest report, and the time that it covers.
  double left_m() const { return static_cast<double>(rolled_.left) / config_.counts_per_m; }
  double right_m() const { return static_cast<double>(rolled_.right) / config_.counts_per_m; }
  hal::Duration step() const { return rolled_.step; }
  int restarts() const { return restarts_; }
  bool doubtful() const { return candidate_.has_value(); }

 private:
  static constexpr int kAgreeing = 5;
  struct Counts {
    std::int32_t left{}, right{};
    hal::Time at{};
  };
  struct Rolled {
    std::int64_t left{}, right{};
    hal::Duration step{};
  };

  static std::int64_t difference(std::int32_t before, std::int32_t now) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(now) -
                                     static_cast<std::uint32_t>(before));
  }
  bool follows(const Counts& before, const Counts& now) const {
    const auto elapsed = std::min(now.at - before.at, config_.coasting_max);
    const double most =
        (1.5 * config_.speed_max_mps * hal::seconds(elapsed) + 0.05) * config_.counts_per_m;
    return static_cast<double>(std::abs(difference(before.left, now.left))) <= most &&
           static_cast<double>(std::abs(difference(before.right, now.right))) <= most;
  }

  Config config_;
  std::optional<Counts> last_, candidate_;
  int agreeing_ = 0;
  std::int64_t left_ = 0, right_ = 0;
  Rolled rolled_;
  bool fresh_ = false;
  int restarts_ = 0;
};

}  // namespace drivers
