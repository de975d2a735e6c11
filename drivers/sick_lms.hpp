// SICK LMS1xx and LMS5xx on a byte stream: a profile scanner.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/clock_fit.hpp"
#include "drivers/profile_loop.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/sick_lms_startup.hpp"

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
class SickLms final : public ProfileLoop {
 public:
  // The clock and the stream must outlive it.
  SickLms(SickLmsConfig config, hal::Clock& clock, hal::ByteStream& stream);
  ~SickLms() override;

  hal::Task<hal::Result<void>> stop() override;
  std::string_view model() const override;
  hal::Task<void> run() override;

  // Since the beginning.
  struct Counts {
    std::uint64_t profiles{}, lost{}, repeated{}, out_of_order{}, unreadable{}, sessions{};
  };
  Counts counts() const;
  double clock_skew() const { return fit_.skew(); }

 private:
  struct Answer {
    bool accepted{};
    Bytes frame;
    std::string refusal;
    ColaMessage message() const { return *parse_cola(frame); }
  };

  void begin_session() override;
  hal::Task<bool> set_up() override;
  void clear_set_up_troubles() override;
  hal::Task<bool> is_alive() override;
  hal::Task<bool> stream(bool on) override;
  hal::Task<bool> revive() override;
  bool must_be_set_up_again() const override { return set_up_lost_; }
  void end_session() override { interrupted_ = interrupted_ || streaming_; }
  void take(ByteView frame, hal::Time arrival) override;
  double period_s() const override;

  hal::Task<bool> find_dialect();
  hal::Task<bool> apply_settings();
  hal::Task<bool> identify();
  hal::Task<bool> read_back();
  hal::Task<std::optional<Answer>> ask(const LmsStep& step);
  hal::Task<bool> insist(const LmsStep& step);

  void take_scan(const ColaMessage& message, hal::Time arrival);
  bool is_new(hal::Time arrival);
  void judge_damage();
  void judge_status();
  bool as_set_up(const LmsChannel& channel) const;
  void add_profile(const LmsChannel& channel, hal::Time stamp, std::uint64_t lost);
  void forget_clock();

  const SickLmsConfig config_;
  ColaDialect dialect_ = ColaDialect::binary;
  const LmsStep* asked_{};
  std::optional<Answer> answer_;
  bool set_up_lost_{}, interrupted_{};

  LmsScan scan_;
  LmsSequence sequence_;
  Unwrap unwrap_us_;
  ClockFit fit_;
  std::optional<std::uint32_t> last_start_us_;
  int clean_{};  // Scans in a row without damaged bytes.
  std::uint64_t damaged_{};
  std::array<std::uint8_t, 2> status_{};
  std::vector<const Fault*> status_faults_;
  Counts counts_;
};

}  // namespace drivers
