// Hokuyo scanners that speak SCIP 2.x (URG-04LX, UTM-30LX(-EW), UST-10/20/30LX) on a serial line or
// TCP port 10940: a profile scanner.
#pragma once

#include <optional>
#include <string>

#include "drivers/clock_fit.hpp"
#include "drivers/profile_loop.hpp"
#include "drivers/scip_codec.hpp"

namespace drivers {

struct HokuyoConfig {
  std::string model;  // How what it says it is must begin ("UST-20LX"); empty: any.
  bool intensities{};
  std::optional<int> step_first, step_last;  // Of the sector; nothing: all that it has.
  int skip = 0;                              // Turns left out between two scans, 0 to 9.
  std::size_t profiles_max = 1024;           // That wait; then the oldest are lost and counted.
  double retry_s = 1;                        // From losing the scanner to trying again.
};

// Its clock counts whole milliseconds: it is asked before each start (not possible while it
// measures) and followed by the arrivals of scans, so stamps of the first beam are good to about a
// millisecond. Error codes in place of a distance are NaN in a profile: they say nothing.
class Hokuyo final : public ProfileLoop {
 public:
  // The clock and the stream must outlive it.
  Hokuyo(HokuyoConfig config, hal::Clock& clock, hal::ByteStream& stream);
  ~Hokuyo() override;

  std::string_view model() const override { return "hokuyo"; }

  std::uint64_t profiles() const { return profiles_; }
  std::uint64_t lost() const { return lost_scans_ + queue_.dropped(); }

 private:
  struct Answer {
    std::string status;
    Bytes frame;
    hal::Time asked{}, arrived{};
  };

  void begin_session() override;
  hal::Task<bool> set_up() override;
  void clear_set_up_troubles() override;
  hal::Task<bool> is_alive() override;
  hal::Task<bool> stream(bool on) override;
  void take(ByteView frame, hal::Time arrival) override;
  double turn_s() const { return 60.0 / parameters_.speed_rpm; }
  double period_s() const override { return turn_s() * (config_.skip + 1); }

  hal::Task<bool> wake_up();
  hal::Task<bool> identify();
  hal::Task<bool> set_clock();
  hal::Task<bool> begin();
  hal::Task<bool> end();
  hal::Task<std::optional<Answer>> ask(std::string command, hal::Duration timeout);
  hal::Task<bool> insist(std::string command, hal::Duration timeout);

  void take_scan(hal::Time arrival);
  void add_profile(hal::Time stamp, std::uint64_t lost);
  int step_first() const { return config_.step_first.value_or(parameters_.step_first); }
  int step_last() const { return config_.step_last.value_or(parameters_.step_last); }

  const HokuyoConfig config_;
  ScipParameters parameters_;

  ScipReply reply_;
  ScipScan scan_;
  std::string asked_;  // Whose echo is waited for.
  std::optional<Answer> answer_;
  std::uint64_t damaged_{};
  int clean_{};

  Unwrap unwrap_ms_{24};
  ClockFit fit_;
  // Where the clocks stood when it was asked: device milliseconds and our time.
  std::int64_t asked_ms_{};
  hal::Time asked_at_{};
  std::optional<std::int64_t> last_ms_;
  std::uint64_t profiles_{}, lost_scans_{};
};

}  // namespace drivers
