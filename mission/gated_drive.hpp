// The only one that commands the drive: supervisor and gate at work, 100 times a second.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/wake.hpp"
#include "mission/faults.hpp"
#include "mission/gate.hpp"
#include "mission/supervisor.hpp"
#include "mission/surroundings.hpp"

namespace mission {

class GatedDrive final : public hal::Drive {
 public:
  struct Config {
    GateConfig gate;
    Boot boot = Boot::clean;
    // What the safety inputs say; nothing: the robot has none, or they were not heard yet. Called
    // in every cycle; must not allocate. May be empty.
    std::function<std::optional<hal::SafetyInputs>()> safety;
    // A scan is being taken: the drive's time-out is not proven then. May be empty.
    std::function<bool()> scanning;
    std::function<void(const std::string&)> tell;  // What happens, as it happens. May be empty.
    std::string how_to_release = "press the reset button";  // For the operator.
    // start() does not begin, however the program came up: a person does, by a release.
    bool starts_held = false;
    // In every cycle: it goes on. Must not allocate. May be empty.
    std::function<void()> alive;
  };
  // Clock and drive must outlive it.
  GatedDrive(Config config, hal::Clock& clock, hal::GuardedDrive& drive);

  // The cycle, and what releases need. From before the devices start, and never twice. Ends only by
  // cancellation.
  hal::Task<void> run();

  // Once all devices run: proves the drive's own time-out, then begins. Answer::released, or the
  // robot stays where it is: after Answer::not_enough until a person releases it, and after
  // Answer::not_proven (proof() says why) it should not go on.
  hal::Task<Answer> start();

  // A person's release or stop, from wherever it comes. A release is carried out in run(), when the
  // drive's time-out has been proven; what became of it is told.
  void ask_release();
  // A hold takes back every release that was asked for before it.
  void ask_hold();
  // What an operator's console sends over and over while a dead-man key is held: takes over from
  // the mission within one period, once the robot is released. Repeated and older packets count for
  // nothing.
  void hear(const OperatorPacket& packet);
  // What the mission knows of where it is; called in every cycle; must not allocate, and must live
  // as long as run() runs. Empty: nothing holds the robot there.
  void watch_surroundings(std::function<Surroundings()> around) { around_ = std::move(around); }
  // The mission is over: stands, and what the drive does from now on stops nothing any more.
  void finish();

  // What the mission wants. Counts for GateConfig::planner_max unless repeated. Fails as the drive
  // does, with errc::operation_not_permitted while the mission may not drive: see why(), and with
  // errc::resource_unavailable_try_again while the robot stands only because the range source is
  // silent.
  hal::Task<hal::Result<void>> command(hal::Twist twist) override;
  hal::Task<hal::Result<hal::WheelTravel>> next_travel() override;

  Mode mode() const { return mode_; }
  bool released() const { return supervisor_.released; }
  bool begun() const { return begun_; }  // start() was called: releases count.
  // The proof of the drive's time-out is under way, or the robot may still roll out after it.
  bool creeps() const;
  // An e-stop, a bumper or a remote control holds it just now.
  bool held_by_people() const;
  // Until it is released, whatever for it was not.
  hal::Task<void> until_released();
  // Why it stands and what to do, in words for the operator; empty: it does not, or nobody stopped
  // or held it.
  std::string why() const;
  // Why the drive's time-out is not proven; empty: it is, or nobody has tried.
  const std::string& proof() const { return proof_failure_; }
  // What stopped it, the gravest first seen; nothing: it is not stopped.
  std::optional<FaultCode> stopped_by() const { return stopped_by_; }
  // What holds a released robot until it is over; nothing: nothing does.
  std::optional<FaultCode> held_by() const;
  GateReason gate_reason() const { return reason_; }

 private:
  hal::Task<void> cycle();
  hal::Task<void> serve_releases();
  hal::Task<void> prove();
  hal::Task<void> try_to_prove();
  hal::Task<void> until_stop(std::uint64_t holds);
  hal::Twist decide(hal::Time now);
  Conditions look(hal::Time now);
  void look_at_reset(const hal::SafetyInputs& safety);
  FaultCode cause_of(Conditions conditions) const;
  void on_decision(const Decision& decision, Conditions conditions);
  void tell(const std::string& what) const;

  const Config config_;
  hal::Clock& clock_;
  hal::GuardedDrive& drive_;

  SupervisorState supervisor_;
  GateState gate_;
  GateReason reason_ = GateReason::mode;  // Of the latest cycle.
  Mode mode_ = Mode::idle;
  bool begun_ = false;   // Silence and refusals of the drive count from now on.
  bool proven_ = false;  // Since the drive was last silent.
  Event event_ = Event::none;
  Answer answer_ = Answer::none;  // To the latest release or start.
  Conditions conditions_;
  hal::DriveStatus status_;
  int silent_cycles_ = 0;  // In a row.
  bool reset_was_ = false, release_asked_ = false, loaded_ = true, held_ = false;
  std::uint64_t holds_ = 0;  // That were asked for.
  std::uint64_t stops_ = 0;  // How often something began to stop it.
  hal::Wake asked_, stopped_, released_;
  std::optional<FaultCode> stopped_by_;
  std::string proof_failure_;
  std::function<Surroundings()> around_;
  Surroundings is_;
  bool proving_ = false;
  hal::Time proved_at_{};  // The end of the latest proof; 0: none.

  hal::Twist planned_;
  hal::Time planned_at_{};
};

}  // namespace mission
