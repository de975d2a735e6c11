// What must hold at every step of every mission, whatever goes wrong: looked at from outside, at
// the drive unit's wire and in the world's truth.
#pragma once

#include <optional>
#include <string>

#include "mission/console.hpp"
#include "mission/main_hardware.hpp"
#include "tests/dst/rig/rig.hpp"

namespace dst {

struct Violation {
  hal::Time at{};
  std::string invariant, seen;
};

// FNV-1a of 64 bits.
class Hash {
 public:
  void add(char byte) { hash_ = (hash_ ^ static_cast<unsigned char>(byte)) * kPrime; }
  void add(std::uint64_t value) {
    for (int byte = 0; byte < 8; ++byte) hash_ = (hash_ ^ (value >> 8 * byte & 0xFF)) * kPrime;
  }
  std::uint64_t value() const { return hash_; }

 private:
  static constexpr std::uint64_t kPrime = 0x100000001b3;
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

class Judge {
 public:
  // All must outlive it. `held`: power came back, and nothing moves before a person's release.
  Judge(hal::Clock& clock, Rig& rig, mission::GuardedSurvey& survey, bool held);

  // A frame passes the drive unit's end of the bus.
  void on_frame(const hal::CanFrame& frame, bool to_unit);
  // A person presses something that stops the robot, or asks for its release.
  void on_press(Press what);
  void on_release();
  // The right password is typed at a console: from now on somebody may be logged in there.
  void on_password() { password_typed_ = true; }
  // Another password counts from now on, and nobody is logged in any more.
  void on_password_set() { password_typed_ = false; }
  // A console has the robot do something.
  void on_order(const mission::ConsoleOrder& order);
  // At the end of each instant: nothing can run any more before time moves.
  void look();
  // When the mission has ended, or should have.
  void on_end(bool ended);

  const std::optional<Violation>& violation() const { return violation_; }  // The first.

  int stops() const { return stops_; }
  hal::Duration slowest_stop() const { return slowest_stop_; }  // From the cause to the zero frame.
  std::uint64_t frames_hash() const { return frames_.value(); }

 private:
  void violated(std::string invariant, std::string seen);
  std::string cause(const hal::DriveStatus& status) const;
  void look_at_causes(const hal::DriveStatus& status);
  void look_at_presses();
  void look_at_world();
  void on_motion(const drivers::agilex::MotionCommand& told);
  void on_stop_order();
  void look_at_console();
  bool may_creep(hal::Time now) const;

  hal::Clock& clock_;
  Rig& rig_;
  mission::GuardedSurvey& survey_;
  std::optional<Violation> violation_;
  Hash frames_;

  bool may_move_ = true;  // The program's start counts once; a stop ends it.
  bool driven_ = false;   // Faster than the proof of the drive's time-out creeps.
  std::string cause_;     // That stops the robot just now; empty: none.
  std::optional<hal::Time> stopped_at_, silent_since_;
  hal::Time released_at_{}, crept_at_{};
  drivers::agilex::MotionCommand told_;
  hal::Time reported_at_{};
  bool measuring_ = false;  // The zero frame is awaited.
  std::optional<hal::Time> board_pressed_at_, safety_pressed_at_;
  int stops_ = 0, collisions_ = 0;
  bool password_typed_ = false;
  std::optional<hal::Time> disk_failed_at_;   // It fails just now.
  std::optional<hal::Time> stop_ordered_at_;  // The zero frame after it is awaited.
  hal::Time key_at_{-std::chrono::hours(1)}, driven_by_hand_at_ = key_at_;
  hal::Duration slowest_stop_{}, stood_{};
  hal::Time looked_at_{};
};

}  // namespace dst
