// Corrections from an NTRIP caster, for a receiver that takes RTCM 3.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>

#include "drivers/back_off.hpp"
#include "drivers/device.hpp"
#include "drivers/drop_link.hpp"
#include "drivers/gnss_demux.hpp"
#include "drivers/gnss_values.hpp"
#include "drivers/ntrip_codec.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "hal/wake.hpp"

namespace drivers {

struct NtripConfig {
  NtripRequest request;         // Without a problem: ntrip_request_problem().
  bool tells_position = false;  // The mountpoint is of a network that must know where we are.
  hal::Duration silence = std::chrono::seconds(10);  // Without a frame: it asks again.
  double period_s = 1;                               // From epoch to epoch of the base.
  double late_s = 5;                                 // Older ones are told.
  double base_distance_max_m = 100'000;              // Farther bases do not fix ambiguities.
};

// A mission goes on without corrections, so this counts as running while it tries; troubles() say
// why none come. Asks again after 1 s, then after twice as long, up to a minute. User and password
// are in no text that it gives.
class NtripClient final : public hal::ByteStream, public Device {
 public:
  static constexpr std::size_t kFramesMax = 64;

  NtripClient(NtripConfig config, hal::Clock& clock, hal::ByteStream& link, DropLink drop = {});

  // Where the receiver is: what a network is told, and what age and distance are reckoned by.
  void watch_position(std::function<GnssEpoch()> position) { position_ = std::move(position); }

  // Whole RTCM3 frames, as the caster sent them; waits while there are none. At most kFramesMax
  // wait; then the oldest is lost and counted.
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;
  // Fails: nothing goes back but positions.
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;

  std::string_view model() const override { return "ntrip"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }
  std::string condition() const override;

  std::uint64_t frames() const { return frames_; }
  std::uint64_t frames_lost() const { return frames_lost_; }
  std::uint64_t requests() const { return requests_; }
  // By the satellites' time, of the last epoch when it came; unknown without a fix.
  std::optional<double> age_s() const { return age_s_; }

 private:
  struct LastOfType {
    std::uint32_t epoch_raw{}, checksum{};
  };

  hal::Task<void> attempt();
  hal::Task<bool> ask();
  hal::Task<bool> read(hal::Time deadline);
  hal::Task<void> fill();
  hal::Task<void> discard();
  hal::Task<void> begin_anew();
  hal::Task<void> refused(NtripAnswer& answer);
  hal::Task<void> look_into_table(NtripAnswer& answer);
  hal::Task<void> receive(NtripAnswer& answer);
  hal::Task<void> tell_position();
  hal::Task<void> watch();
  ByteView got() const { return ByteView(piece_).first(got_); }
  std::optional<GnssEpoch> position() const;
  std::string where() const;
  void begin_stream();
  void take(ByteView body);
  void take_frame(ByteView frame);
  void put(ByteView frame);
  void note_epoch(ByteView frame);
  void note_base(ByteView frame);
  void name_silence();
  void judge();
  void name(const Fault* why, std::string detail = {});

  const NtripConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& link_;
  DropLink drop_;
  std::function<GnssEpoch()> position_;
  BackOff pause_;
  DeviceState state_ = DeviceState::off;
  Identity identity_;
  Troubles troubles_;
  const Fault* why_{};  // No corrections come.

  std::array<std::uint8_t, 4096> piece_{};
  std::size_t got_{};
  bool lost_{};  // The connection, since it was asked.

  std::optional<Resync> resync_;  // Of this answer.
  std::uint64_t bytes_{}, bytes_at_frame_{}, damaged_told_{}, again_{}, again_told_{};
  hal::Time frame_at_{}, epoch_at_{}, damaged_at_{}, again_at_{};
  std::map<std::uint16_t, LastOfType> last_;
  std::optional<std::uint16_t> lead_;  // The type that gaps are told by.
  double gap_s_{};
  std::optional<double> age_s_, base_distance_m_;
  bool position_told_{};

  std::deque<Bytes> waiting_;
  std::size_t front_at_{};  // Bytes of the first one that were read.
  hal::Wake ready_;
  std::uint64_t frames_{}, frames_lost_{}, requests_{};
};

}  // namespace drivers
