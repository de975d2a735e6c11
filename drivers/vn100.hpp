// VectorNav VN-100 on a serial port: the yaw rate, stamped by the device's clock fitted to ours.
#pragma once

#include "drivers/clock_fit.hpp"
#include "drivers/device.hpp"
#include "drivers/outbox.hpp"
#include "drivers/port_search.hpp"
#include "drivers/stream_health.hpp"
#include "drivers/vn100_startup.hpp"
#include "hal/devices.hpp"

namespace drivers {

struct Vn100Config {
  Vn100Settings settings;
};

// Asks at settings.baud first, then at every other rate that the device may be set to; leaves it
// at the rate at which it answers. What it is told is not saved: it comes up as it was sold, and is
// told again after every loss.
class Vn100 final : public hal::Imu, public Device {
 public:
  // The stream goes through a port whose rate set_baud sets; empty: there is none to set. The
  // settings must have no problem.
  Vn100(const Vn100Config& config, hal::Clock& clock, hal::ByteStream& stream,
        SetBaud set_baud = {});

  // The oldest of at most 64 that nobody took yet. Fails with errc::timed_out once a second while
  // the device is lost. Without a device time (lines) the stamp is the arrival.
  hal::Task<hal::Result<hal::ImuSample>> next_sample() override { return samples_.take(); }

  std::string_view model() const override { return "vn100"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  const ClockFit& clock_fit() const { return fit_; }
  int baud() const { return baud_; }  // At which it last answered.
  std::uint64_t lost_samples() const { return samples_.lost(); }

 private:
  hal::Task<void> serve();
  hal::Task<bool> find();
  hal::Task<Found> find_at(int baud);
  hal::Task<bool> configure();
  hal::Task<bool> apply(const Vn100Step& step);
  hal::Task<hal::Result<Vn100Line>> ask(const Vn100Step& step, hal::Duration patience);
  hal::Task<void> listen();
  hal::Task<void> read_samples();
  hal::Task<void> watch();
  bool identify(const Vn100Step& step, const Vn100Line& line);
  void clear_search();
  void name_silence();
  void handle(ByteView frame);
  void handle_line(ByteView frame);
  void handle_sample(const Vn100Sample& sample);
  bool is_new(const Vn100Sample& sample);
  bool weighs_wrong(const Vn100Sample& sample);
  void deliver(hal::Time stamp, double yaw_rate_radps);
  void note_filter(std::uint16_t vpe_status);

  Vn100Config config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;
  SetBaud set_baud_;
  FrameReader reader_;
  StreamHealth health_;
  Outbox<hal::ImuSample> samples_{64};
  Troubles troubles_;
  Identity identity_;
  DeviceState state_ = DeviceState::off;
  int baud_;
  ClockFit fit_;
  std::optional<std::int64_t> device_ns_;                         // Of the last sample.
  std::optional<Vn100Vector> line_rate_radps_, line_accel_mps2_;  // Of the last line.
  std::optional<std::uint16_t> vpe_status_;
  hal::Time new_sample_at_{};
  double gravity_mps2_;  // What it feels, smoothed over a second.
  bool start_again_ = false;
};

}  // namespace drivers
