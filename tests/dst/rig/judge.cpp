#include "tests/dst/rig/judge.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace dst {
namespace {

using namespace std::chrono_literals;
namespace agilex = drivers::agilex;

constexpr std::uint32_t kMotionId = 0x111;
// One gate period, and the longest frame at 500 kbit/s.
constexpr hal::Duration kStopMax = mission::kGatePeriod + 1ms;
constexpr hal::Duration kFeedbackMax = 100ms + kStopMax;
// While its time-out is being proven the drive's own driver looks after it.
constexpr hal::Duration kProofFeedbackMax = 200ms + 20ms + kStopMax;
// Silence is a stop of its own when it lasts: see GatedDrive.
constexpr hal::Duration kSilentMax = 100ms + kStopMax;
// The inputs are read 20 times a second and count for 200 ms.
constexpr hal::Duration kInputsMax = 300ms + kStopMax;
constexpr hal::Duration kRollsOutMax = 3s;  // Until the wheels of a skid-steered base stand.
constexpr hal::Duration kProofMax = 4s;     // Of the drive's own time-out.
// From the last key to the zero frame.
constexpr hal::Duration kDeadManMax = 200ms + kStopMax;
constexpr int kCreep_mmps = 20;  // What that may be told.
constexpr double kOver = 1.02;

bool stands(const agilex::MotionCommand& told) {
  return told.forward_mmps == 0 && told.turn_mradps == 0;
}
bool creeps(const agilex::MotionCommand& told) {
  return told.forward_mmps == kCreep_mmps && told.turn_mradps == 0;
}

// Faults that nobody can see from what the inputs say.
bool hides(const sim::UnitFaults& faults) {
  return faults.is(sim::UnitFault::stuck) || faults.is(sim::UnitFault::slow) ||
         faults.is(sim::UnitFault::delayed);
}

}  // namespace

Judge::Judge(hal::Clock& clock, Rig& rig, mission::GuardedSurvey& survey, bool held)
    : clock_(clock), rig_(rig), survey_(survey) {
  if (!held) return;
  may_move_ = false;
  stopped_at_ = clock.now() - 1h;
  released_at_ = crept_at_ = *stopped_at_;
  driven_ = true;  // Before the cut: creeping needs a release, too.
}

void Judge::violated(std::string invariant, std::string seen) {
  if (!violation_) violation_ = {clock_.now(), std::move(invariant), std::move(seen)};
}

void Judge::on_frame(const hal::CanFrame& frame, bool to_unit) {
  frames_.add(static_cast<std::uint64_t>(clock_.now().time_since_epoch().count()));
  frames_.add(std::uint64_t{frame.id} << 8 | frame.size << 1 | (to_unit ? 1 : 0));
  std::uint64_t data = 0;
  for (const std::uint8_t byte : frame.data) data = data << 8 | byte;
  frames_.add(data);
  if (!to_unit || frame.id != kMotionId) return;
  const agilex::Message message = agilex::decode(frame, agilex::Dialect::v2);
  if (const auto* told = std::get_if<agilex::MotionCommand>(&message)) on_motion(*told);
}

void Judge::on_motion(const agilex::MotionCommand& told) {
  const hal::Time now = clock_.now();
  told_ = told;
  if (measuring_ && stands(told)) {
    measuring_ = false;
    slowest_stop_ = std::max(slowest_stop_, now - *stopped_at_);
  }
  if (stands(told)) return stop_ordered_at_.reset();
  const std::string what =
      fmt::format("told {} mm/s, {} mrad/s", told.forward_mmps, told.turn_mradps);
  const mission::BodyConfig& body = rig_.config().body;
  if (std::abs(told.forward_mmps) > body.speed_max_mps * 1000 + 1 ||
      std::abs(told.turn_mradps) > body.turn_max_degps * std::numbers::pi / 180 * 1000 + 1)
    violated("the speed stays within its limit", what);
  if (survey_.scanning()) violated("no motion while a scan is being taken", what);
  if (stopped_at_ && !may_move_ && now - *stopped_at_ > kStopMax &&
      !(creeps(told) && may_creep(now)))
    violated("no motion after a stop without a person's release",
             fmt::format("{}; stopped {:.3f} s ago: {}", what, hal::seconds(now - *stopped_at_),
                         cause_));
  if (now - reported_at_ > (creeps(told) && may_creep(now) ? kProofFeedbackMax : kFeedbackMax))
    violated(
        "no motion while the drive does not report",
        fmt::format("{}; the last report is {:.3f} s old", what, hal::seconds(now - reported_at_)));
  if (survey_.gate().mode() == mission::Mode::teleop && now - key_at_ > kDeadManMax)
    violated("the robot stands when the dead-man key is let go",
             fmt::format("{}; the last key is {:.3f} s old", what, hal::seconds(now - key_at_)));
  if (survey_.gate().mode() == mission::Mode::autonomous && disk_failed_at_ &&
      now - *disk_failed_at_ > kStopMax)
    violated(
        "a mission whose disk fails stands",
        fmt::format("{}; it has failed for {:.3f} s", what, hal::seconds(now - *disk_failed_at_)));
  if (creeps(told))
    crept_at_ = now;
  else
    driven_ = true;
}

// For the proof of the drive's own time-out: as the program starts, or when a person releases it.
bool Judge::may_creep(hal::Time now) const {
  return cause_.empty() && (now - released_at_ <= kProofMax || !driven_);
}

void Judge::on_press(Press what) {
  if (what == Press::board_estop) board_pressed_at_ = clock_.now();
  if (what == Press::safety_estop || what == Press::bumper) safety_pressed_at_ = clock_.now();
}

void Judge::on_release() {
  released_at_ = clock_.now();
  if (cause_.empty()) may_move_ = true;
}

void Judge::on_order(const mission::ConsoleOrder& order) {
  using Order = mission::ConsoleOrder::Kind;
  if (order.kind == Order::stop) return on_stop_order();
  const bool stands_still = order.kind == Order::drive && !order.packet.dead_man;
  if (order.kind == Order::pause || stands_still) return;
  if (!password_typed_)
    violated("nothing moves by a console at which nobody is logged in",
             fmt::format("order {}", static_cast<int>(order.kind)));
  if (order.kind == Order::drive) key_at_ = clock_.now();
  if (order.kind == Order::arm && survey_.gate().begun() && !survey_.gate().released())
    on_release();
}

void Judge::on_stop_order() {
  may_move_ = false;
  if (!measuring_) stopped_at_ = clock_.now();
  if (!stands(told_) && !stop_ordered_at_) stop_ordered_at_ = clock_.now();
}

// What stops the robot, as the drivers tell; empty: nothing.
std::string Judge::cause(const hal::DriveStatus& status) const {
  const auto safety = rig_.drivers().safety_inputs();
  if (status.estop_pressed) return "the base's e-stop";
  if (status.remote_control) return "the transmitter";
  if (status.commanded_by_others) return "somebody else's commands";
  if (safety && safety->estop_pressed) return "the e-stop's inputs";
  if (safety && safety->bumper_pressed) return "the bumper";
  if (driven_ && silent_since_ && clock_.now() - *silent_since_ > kSilentMax)
    return "the drive is silent";
  return "";
}

void Judge::look_at_causes(const hal::DriveStatus& status) {
  const hal::Time now = clock_.now();
  if (!status.silent)
    silent_since_.reset();
  else if (!silent_since_)
    silent_since_ = now;
  const bool was = !cause_.empty();
  cause_ = cause(status);
  if (cause_.empty()) {
    measuring_ = false;
    return;
  }
  if (!was) {
    ++stops_;
    stopped_at_ = now;
    measuring_ = !stands(told_);
  }
  may_move_ = false;
}

void Judge::look_at_presses() {
  const hal::Time now = clock_.now();
  const auto late = [&](std::optional<hal::Time>& at, const char* role) {
    if (!at || !(rig_.pressed())) return at.reset();
    if (hides(rig_.faults(role))) return at.reset();
    if (now - *at > kInputsMax && !stands(told_))
      violated(
          "a pressed input stops the robot",
          fmt::format("{} for {:.3f} s, and it is told to move", role, hal::seconds(now - *at)));
  };
  late(board_pressed_at_, "board");
  late(safety_pressed_at_, "safety");
}

void Judge::look_at_world() {
  const hal::Time now = clock_.now();
  sim::World& world = rig_.world();
  if (world.collisions() > collisions_) {
    collisions_ = world.collisions();
    // An operator sees where they drive, or does not.
    if (now - driven_by_hand_at_ < kRollsOutMax) return;
    const hal::Pose2& at = world.robot().pose;
    violated("the robot touches nothing",
             fmt::format("at ({:.2f}, {:.2f})", at.position_m.x(), at.position_m.y()));
  }
  if (!world.moving()) return;
  if (std::abs(world.rolling().forward_mps) > rig_.config().body.speed_max_mps * kOver)
    violated("the speed stays within its limit",
             fmt::format("it rolls at {:.3f} m/s", world.rolling().forward_mps));
  if (survey_.scanning())
    violated("no motion while a scan is being taken",
             fmt::format("it rolls at {:.3f} m/s", world.rolling().forward_mps));
  if (!may_move_ && stopped_at_ && now - *stopped_at_ > kRollsOutMax &&
      now - crept_at_ > kRollsOutMax)
    violated("no motion after a stop without a person's release",
             fmt::format("it rolls at {:.3f} m/s, stopped {:.3f} s ago",
                         world.rolling().forward_mps, hal::seconds(now - *stopped_at_)));
}

void Judge::look() {
  const hal::Time now = clock_.now();
  const hal::DriveStatus status = rig_.drivers().drive().status();
  reported_at_ = status.reported_at;
  const bool waits = survey_.survey().orders().waits();
  if (!may_move_ || waits || disk_failed_at_ || !survey_.watch().well()) stood_ += now - looked_at_;
  looked_at_ = now;
  look_at_causes(status);
  if (rig_.is_cut("drive")) {  // Nothing gets through: the base's own time-out has to do.
    told_ = {};
    measuring_ = false;
  }
  if (measuring_ && now - *stopped_at_ > kStopMax)
    violated("a zero command within one gate period and a frame of every cause to stop",
             fmt::format("{}: none after {:.3f} s", cause_, hal::seconds(now - *stopped_at_)));
  const bool disk_failed = survey_.survey().disk_fault().has_value();
  if (disk_failed != disk_failed_at_.has_value())
    disk_failed_at_ = disk_failed ? std::optional(now) : std::nullopt;
  look_at_presses();
  look_at_console();
  look_at_world();
}

void Judge::look_at_console() {
  const hal::Time now = clock_.now();
  if (survey_.gate().mode() == mission::Mode::teleop) driven_by_hand_at_ = now;
  if (rig_.is_cut("drive")) stop_ordered_at_.reset();
  if (stop_ordered_at_ && now - *stop_ordered_at_ > kStopMax)
    violated("`stop` ends in a zero command within one gate period and a frame",
             fmt::format("none after {:.3f} s", hal::seconds(now - *stop_ordered_at_)));
}

void Judge::on_end(bool ended) {
  const mission::RunRecord& record = survey_.survey().record();
  if (!ended) return violated("every mission ends", "it goes on and on");
  if (record.end.empty() && survey_.failure().empty())
    violated("every mission ends with a reason", "there is none");
  if (record.completed && record.scans.empty())
    violated("a mission without a scan is not completed", record.end);
  // What it stood for with its devices missing, or stopped, was not to be foreseen.
  const double unforeseen_wh = hal::seconds(stood_) / 3600 * rig_.config().battery.drive_w;
  if (record.completed && record.energy.left_wh + unforeseen_wh < 0)
    violated("the energy to return is kept",
             fmt::format("{:.1f} Wh are left", record.energy.left_wh));
}

}  // namespace dst
