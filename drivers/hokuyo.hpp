// Hokuyo scanners that speak SCIP 2.x (URG-04LX, UTM-30LX(-EW), UST-10/20/30LX) on a serial line or
// TCP port 10940: a profile scanner.
#pragma once

#include <optional>
#include <string>

#include "drivers/clock_fit.hpp"
#include "drivers/device.hpp"
#include "drivers/profile_stream.hpp"
#include "drivers/resync.hpp"
#include "drivers/scip_codec.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

struct HokuyoConfig {
  std::string model;  // How what it says it is must begin ("UST-20LX"); empty: any.
  bool intensities{};
  std::optional<int> step_first, step_last;  // Of the sector; nothing: all that it has.
  std::size_t profiles_max = 1024;           // That wait; then the oldest are lost and counted.
  double retry_s = 1;                        // From losing the scanner to trying again.
};

// Its clock counts whole milliseconds: it is asked before each start (not possible while it
// measures) and followed by the arrivals of scans, so stamps of the first beam are good to about a
// millisecond. Error codes in place of a distance are NaN in a profile: they say nothing.
class Hokuyo final : public hal::ProfileScanner, public Device {
 public:
  // The clock and the stream must outlive it.
  Hokuyo(HokuyoConfig config, hal::Clock& clock, hal::ByteStream& stream);
  ~Hokuyo() override;

  // Fail with errc::timed_out when the scanner is not there within 15 s.
  hal::Task<hal::Result<void>> start() override;
  hal::Task<hal::Result<void>> stop() override;
  // As SickLms's.
  hal::Task<hal::Result<hal::Profile>> next_profile() override;

  std::string_view model() const override { return "hokuyo"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  std::uint64_t profiles() const { return profiles_; }
  std::uint64_t lost() const { return lost_scans_ + queue_.dropped(); }
  double clock_jitter_s() const { return watch_.jitter_s(); }

 private:
  struct Answer {
    std::string status;
    Bytes frame;
    hal::Time asked{}, arrived{};
  };

  hal::Task<void> session();
  hal::Task<void> receive();
  hal::Task<void> converse();
  hal::Task<bool> wake_up();
  hal::Task<bool> identify();
  hal::Task<bool> set_clock();
  hal::Task<bool> begin();
  hal::Task<bool> end();
  hal::Task<void> serve();
  hal::Task<std::optional<Answer>> ask(std::string command, hal::Duration timeout);
  hal::Task<bool> insist(std::string command, hal::Duration timeout);

  void take(ByteView frame, hal::Time arrival);
  void take_scan(hal::Time arrival);
  void add_profile(hal::Time stamp, std::uint64_t lost);
  int step_first() const { return config_.step_first.value_or(parameters_.step_first); }
  int step_last() const { return config_.step_last.value_or(parameters_.step_last); }
  double period_s() const { return 60.0 / parameters_.speed_rpm; }

  const HokuyoConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;

  DeviceState state_ = DeviceState::off;
  Identity identity_;
  Troubles troubles_;
  ScipParameters parameters_;

  Resync resync_{kScipFrameMax};
  ScipReply reply_;
  ScipScan scan_;
  std::string asked_;  // Whose echo is waited for.
  std::optional<Answer> answer_;
  Signal answered_, changed_, switched_;
  bool wanted_{}, streaming_{};
  std::uint64_t bytes_{};
  std::uint64_t damaged_{};
  int clean_{};

  Unwrap unwrap_ms_{24};
  ClockFit fit_;
  // Where the clocks stood when it was asked: device milliseconds and our time.
  std::int64_t asked_ms_{};
  hal::Time asked_at_{};
  std::optional<std::int64_t> last_ms_;
  hal::Time last_scan_{};
  ScanWatch watch_{troubles_};
  ProfileQueue queue_{config_.profiles_max};
  std::uint64_t profiles_{}, lost_scans_{};
};

}  // namespace drivers
