// SICK LMS1xx and LMS5xx on a byte stream: a profile scanner.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/clock_fit.hpp"
#include "drivers/device.hpp"
#include "drivers/profile_stream.hpp"
#include "drivers/resync.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/sick_lms_startup.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

struct SickLmsConfig {
  LmsSettings settings;
  std::size_t profiles_max = 512;  // That wait to be taken; then the oldest are lost and counted.
  double retry_s = 1;              // From losing the scanner to trying again.
};

// Finds out the dialect, identifies the scanner, sets it up and reads its settings back. Beams that
// the scanner marks as dazzled, implausible or filtered are NaN in a profile: they say nothing.
// Stamps are the device's own time of the first beam in our clock; they settle within the first 3 s
// after start().
class SickLms final : public hal::ProfileScanner, public Device {
 public:
  // The clock and the stream must outlive it.
  SickLms(SickLmsConfig config, hal::Clock& clock, hal::ByteStream& stream);
  ~SickLms() override;

  // Fail with errc::timed_out when the scanner is not there within 10 s.
  hal::Task<hal::Result<void>> start() override;
  hal::Task<hal::Result<void>> stop() override;
  // Fails with errc::timed_out when none comes for 2 s, and with errc::operation_not_permitted
  // before start().
  hal::Task<hal::Result<hal::Profile>> next_profile() override;

  std::string_view model() const override;
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  // Since the beginning.
  struct Counts {
    std::uint64_t profiles{}, lost{}, repeated{}, out_of_order{}, unreadable{}, sessions{};
  };
  Counts counts() const;
  double clock_jitter_s() const {
    return watch_.jitter_s();
  }  // Of arrivals, over the last second or so.
  double clock_skew() const { return fit_.skew(); }

 private:
  struct Answer {
    bool accepted{};
    Bytes frame;
    std::string refusal;
    ColaMessage message() const { return *parse_cola(frame); }
  };

  hal::Task<void> session();
  hal::Task<void> receive();
  hal::Task<void> converse();
  hal::Task<bool> find_dialect();
  hal::Task<bool> set_up();
  hal::Task<bool> identify();
  hal::Task<bool> read_back();
  hal::Task<void> serve();
  hal::Task<bool> subscribe(bool on);
  hal::Task<std::optional<Answer>> ask(const LmsStep& step);
  hal::Task<bool> insist(const LmsStep& step);

  void take(ByteView frame, hal::Time arrival);
  void take_scan(const ColaMessage& message, hal::Time arrival);
  bool is_new(hal::Time arrival);
  void judge_damage();
  void judge_status();
  bool as_set_up(const LmsChannel& channel) const;
  void add_profile(const LmsChannel& channel, hal::Time stamp, std::uint64_t lost);
  void forget_clock();
  double period_s() const;

  const SickLmsConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;

  DeviceState state_ = DeviceState::off;
  Identity identity_;
  Troubles troubles_;

  Resync resync_{kColaFrameMax};
  ColaDialect dialect_ = ColaDialect::binary;
  const LmsStep* asked_{};
  std::optional<Answer> answer_;
  Signal answered_, changed_, switched_;
  bool wanted_{}, streaming_{}, set_up_lost_{}, interrupted_{};
  std::uint64_t bytes_{};

  LmsScan scan_;
  LmsSequence sequence_;
  Unwrap unwrap_us_;
  ClockFit fit_;
  std::optional<std::uint32_t> last_start_us_;
  hal::Time last_scan_{};  // Arrival of the last new one, or of the subscription.
  ScanWatch watch_{troubles_};
  int clean_{};  // Scans in a row without damaged bytes.
  std::uint64_t damaged_{};
  std::array<std::uint8_t, 2> status_{};
  std::vector<const Fault*> status_faults_;
  ProfileQueue queue_{config_.profiles_max};
  Counts counts_;
};

}  // namespace drivers
