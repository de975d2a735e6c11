// FLIR (Directed Perception) PTU-D46, E46, D48E and PTU-5 on a serial line or TCP port 4000: the
// pan axis.
#pragma once

#include <optional>
#include <string>

#include "drivers/device.hpp"
#include "drivers/port_search.hpp"
#include "drivers/ptu_codec.hpp"
#include "drivers/resync.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

struct FlirPtuConfig {
  bool counter_clockwise{};   // Whether positive positions turn that way: found by a test move.
  double arcsec_per_step{};   // As the unit must say; 0: as it says.
  double angle_min_rad = -3;  // The unit's own limits hold besides.
  double angle_max_rad = 3;
  double speed_radps = 0.5;  // Of move_to.
  double acceleration_radps2 = 0.5;
  bool reset_at_start{};  // Drives to both ends to find its zero; else only when it is lost.
  double bytes_per_s{};  // Of a serial line: baud / 10. Then the line's time is taken off readings.
  double retry_s = 1;    // From losing the unit to trying again.
};

// Until the unit answers for the first time, it is also asked at the other rates of a settable
// line, in the pauses between two starts: a trouble then says at which one it answers. It is used
// at the line's own rate only.
//
// Sends one request at a time. While it is lost, calls wait up to 10 s for it and then fail with
// errc::not_connected.
class FlirPtu final : public hal::PanUnit, public Device {
 public:
  // The clock and the stream must outlive it.
  FlirPtu(FlirPtuConfig config, hal::Clock& clock, hal::ByteStream& stream,
          std::optional<SettableLine> line = {});
  ~FlirPtu() override;

  // Also fails with errc::timed_out when it does not get there.
  hal::Task<hal::Result<void>> move_to(double angle_rad) override;
  // Fails with errc::argument_out_of_domain beyond the limits of angle and rate.
  hal::Task<hal::Result<void>> turn_to(double angle_rad, double rate_radps) override;
  hal::Task<hal::Result<void>> halt() override;
  hal::Task<hal::Result<hal::PanReading>> read() override;

  std::string_view model() const override { return "flir-ptu"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  double step_rad() const;  // 0 before it was identified.
  std::optional<PtuHealth> health() const { return health_; }

 private:
  struct Exchange {
    PtuAnswer answer;
    hal::Time asked{}, answered{};
  };
  enum class Expect { number, nothing, anything };

  hal::Task<void> session();
  hal::Task<void> hail_at_other_rates(hal::Time until);
  hal::Task<bool> answers_at(int baud);
  hal::Task<void> receive();
  hal::Task<void> converse();
  hal::Task<bool> bring_up();
  hal::Task<bool> set_up_talk();
  hal::Task<bool> learn();
  hal::Task<bool> find_zero();
  hal::Task<bool> set_and_check(std::string_view command, std::int64_t value);
  hal::Task<void> watch();
  hal::Task<bool> there();

  hal::Task<hal::Result<Exchange>> exchange(Bytes request, Expect expect, hal::Duration timeout);
  hal::Task<hal::Result<Exchange>> ask_once(const Bytes& request, Expect expect,
                                            hal::Duration timeout);
  hal::Task<hal::Result<std::int64_t>> query(std::string_view command);
  hal::Task<hal::Result<void>> command(std::string_view command, std::int64_t value);
  void take(ByteView frame, hal::Time arrival);
  void judge(const Exchange& done);
  void judge_silence(const Bytes& request);
  void note(std::int64_t steps);
  hal::Result<std::int64_t> allowed(double angle_rad) const;

  const FlirPtuConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;
  const std::optional<SettableLine> line_;
  std::vector<int> other_bauds_;  // Next first.

  DeviceState state_ = DeviceState::off;
  Identity identity_;
  Troubles troubles_;

  Resync resync_{kPtuLineMax};
  Turns turns_;
  Signal answered_, changed_;
  std::optional<Exchange> answer_;
  bool asked_{}, unsure_{}, lost_{}, resetting_{}, unanswered_{};
  std::uint64_t bytes_{};
  int late_{}, in_step_{};

  PtuAxis axis_;
  bool learned_{};
  std::int64_t least_{}, greatest_{}, speed_max_{}, speed_min_{};
  std::optional<std::int64_t> target_;
  std::int64_t last_steps_{};
  hal::Time moved_{};
  hal::Time last_exchange_{};
  std::optional<PtuHealth> health_;
};

}  // namespace drivers
