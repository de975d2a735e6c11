// AgileX Scout 2.0, Scout Mini and Bunker on CAN (500 kbit/s, version 2 of their protocol).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/agilex_codec.hpp"
#include "drivers/device.hpp"
#include "drivers/odometer.hpp"
#include "drivers/stall.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"
#include "hal/wake.hpp"

namespace drivers {

// Takes command of the base by itself, again after every loss, and never against a transmitter or
// an e-stop. The base is told to stand unless commands come.
//
// Silence is judged by the times at which frames arrived, and only when those that wait were heard:
// a program that was held up for a while says nothing of a base that went on talking.
class AgilexDrive final : public hal::GuardedDrive, public Device {
 public:
  enum class Model { scout2, scout_mini, bunker };
  struct Config {
    Model model = Model::scout2;
    double track_m = 0.58;  // From the left wheels or track to the right.
    // A command counts for this long unless repeated; the base itself stops after 500 ms.
    hal::Duration command_max = std::chrono::milliseconds(200);
    StallWatch::Limits stall;
  };

  AgilexDrive(const Config& config, hal::Clock& clock, hal::CanBus& bus);

  // Slowed down as a whole beyond the model's limits. Fails with
  //   errc::io_error: the wheels stood though they were told to turn (Config::stall); the base is
  //     told to stand, and stays so until something else than pushing on is commanded;
  //   errc::operation_not_permitted: e-stop, transmitter or the base's own fault holds it;
  //   errc::not_connected: the base is not in command (troubles() says why);
  //   errc::invalid_argument: not finite.
  hal::Task<hal::Result<void>> command(hal::Twist twist) override;
  // Waits for the base, however long it is silent: what it rolled meanwhile is in the next report,
  // unless it was switched off or given away in the meantime. One caller at a time.
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override;

  hal::DriveStatus status() const override;
  // The base cannot be asked for its time-out (500 ms by its manual): it is made to creep at 2
  // cm/s, then told nothing, and must report that it stands.
  hal::Task<hal::Result<hal::Duration>> prove_timeout() override;

  std::string_view model() const override;
  // What it needs to hear: everything but lights, transmitter and the motors' speeds, which a base
  // reports 50 times a second each.
  static std::span<const hal::CanFilter> filters();
  hal::Task<void> run() override;
  DeviceState state() const override;
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override;

  // Before the program ends: stands for 200 ms, then gives the base back (standby). Afterwards it
  // is not taken again.
  hal::Task<void> release();

  std::span<const Fault> faults() const;  // All of this driver's own; the base's are in the codec.

 private:
  // What was heard, and when. Time 0: never.
  struct Heard {
    std::optional<agilex::SystemState> system;
    hal::Time system_at{}, count_at{}, motion_at{};
    std::array<std::uint8_t, 4> motor_bits{};
    hal::Time lost_at{}, late_at{}, doubled_at{}, unread_at{};
    int lost_reports{};
    hal::Duration gap{};
    std::string_view unread_why;
    int v1_frames{}, other_frames{};
    hal::Time other_at{}, v1_at{};
    std::uint32_t other_id{};
    hal::Time foreign_at{};  // Somebody else's command.
  };
  // What the proof of the time-out tells the base instead of commands.
  enum class Proof : std::uint8_t { none, creep, nothing };

  hal::Task<void> listen();
  hal::Task<void> keep();
  hal::Task<void> hear_what_waits();
  void hear(const hal::ReceivedFrame& received);
  void hear_other(const hal::ReceivedFrame& received);
  void on(const agilex::SystemState& system, hal::Time at);
  void on(const agilex::MotionState& motion, hal::Time at);
  void on(const agilex::Odometry& odometry, hal::Time at);
  void on(const agilex::MotorSlow& motor, hal::Time at);
  void on(const agilex::Version& version, hal::Time at);
  void on(const agilex::MotionCommand& foreign, hal::Time at);
  void on_silence_over();
  std::optional<hal::CanFrame> next_frame(hal::Time now);
  std::optional<hal::CanFrame> take_command(hal::Time now);
  agilex::MotionCommand motion(hal::Time now);
  void watch_sides(hal::Time now);
  hal::Task<void> send(const hal::CanFrame& frame);
  hal::Task<hal::Result<hal::Duration>> creep_then_say_nothing();
  boost::system::error_code disobeys(hal::Time now) const;

  hal::Time heard_until(hal::Time now) const;
  bool talks(hal::Time now) const;   // Reports come as they should.
  bool drives(hal::Time now) const;  // And the base obeys us.
  bool held() const;                 // By a person or by itself.
  bool frozen(hal::Time now) const;
  void add_link_troubles(std::vector<Trouble>& all, hal::Time now) const;
  void add_base_troubles(std::vector<Trouble>& all, hal::Time now) const;
  void add_report_troubles(std::vector<Trouble>& all, hal::Time now) const;

  const Config config_;
  const agilex::Limits limits_;
  hal::Clock& clock_;
  hal::CanBus& bus_;
  Identity identity_;
  Heard heard_;
  bool started_ = false, ran_ = false, released_ = false;
  hal::Time started_at_{}, talked_at_{}, released_at_{};
  hal::Time attended_at_{};  // When keep() last knew that all that had come was heard.
  std::uint64_t frames_heard_{};

  Odometer odometer_;
  hal::Wake odometry_heard_;
  bool silence_over_ = true;  // No state has come since the last silence: the base may be another.

  hal::Twist wanted_;
  hal::Time wanted_at_{};
  agilex::MotionCommand told_;
  Proof proof_ = Proof::none;
  BlockedWay way_;
  SideWatch left_, right_;
  agilex::MotionState moves_;

  int tries_ = 0;
  bool cleared_ = false;
  hal::Time next_try_{};
  hal::Time next_query_{}, asked_at_{};
  bool answer_due_ = false;
  hal::Duration answer_took_{};
  boost::system::error_code send_error_, receive_error_;
};

}  // namespace drivers
