// What the robot can sense and do. Missions use these; which wire a device hangs on does not show
// here.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "hal/task.hpp"
#include "hal/values.hpp"

namespace hal {

class Drive {
 public:
  virtual ~Drive() = default;
  // Expires in the drive (<= 500 ms) unless repeated. Fails with errc::io_error after a collision.
  virtual Task<Result<void>> command(Twist twist) = 0;
  virtual Task<Result<WheelTravel>> next_travel() = 0;
};

// What a drive says of itself. Until it says otherwise it counts as silent and held.
struct DriveStatus {
  Time reported_at{};  // Its latest report of how it moves; 0: none.
  bool silent = true;  // It does not report as it should.
  bool held = true;    // An e-stop, a remote control or a fault of its own: it refuses commands.
  // What it says for sure.
  bool estop_pressed{};
  bool remote_control{};
  bool commanded_by_others{};  // Somebody else's commands were seen on its link.
};

// A drive whose own safeguards can be looked at.
class GuardedDrive : public Drive {
 public:
  // Does not wait, does not allocate.
  virtual DriveStatus status() const = 0;
  // Shows that the drive stops by itself when it hears no more commands, and returns after how
  // long. The robot must stand; it may creep by up to 2 cm. Fails with errc::timed_out when the
  // drive did not stop by itself, errc::io_error when it could not be seen to move,
  // errc::not_connected or errc::operation_not_permitted when it does not obey. Commands given
  // meanwhile are not carried out. Cancelling it makes the drive stand.
  virtual Task<Result<Duration>> prove_timeout() = 0;
};

class Imu {
 public:
  virtual ~Imu() = default;
  virtual Task<Result<ImuSample>> next_sample() = 0;
};

class Gnss {
 public:
  virtual ~Gnss() = default;
  virtual Task<Result<GnssFix>> next_fix() = 0;
};

// Takes one whole scan while the robot stands still.
class Scanner {
 public:
  virtual ~Scanner() = default;
  virtual Task<Result<ScanCloud>> scan() = 0;
};

// A laser scanner that measures in one plane.
class ProfileScanner {
 public:
  virtual ~ProfileScanner() = default;
  // Profiles come only between start and stop.
  virtual Task<Result<void>> start() = 0;
  virtual Task<Result<void>> stop() = 0;
  // The oldest that nobody took yet; a bounded number waits, then the oldest are lost and counted.
  virtual Task<Result<Profile>> next_profile() = 0;
};

// Turns a scanner about the z axis of S.
class PanUnit {
 public:
  virtual ~PanUnit() = default;
  // Ends when the unit stands there. Fails with errc::argument_out_of_domain beyond its limits.
  virtual Task<Result<void>> move_to(double angle_rad) = 0;
  // Begins to turn towards `angle_rad` at that rate (positive) and returns at once.
  virtual Task<Result<void>> turn_to(double angle_rad, double rate_radps) = 0;
  virtual Task<Result<void>> halt() = 0;
  virtual Task<Result<PanReading>> read() = 0;
};

// Supply, relays and safety inputs.
class PowerIo {
 public:
  virtual ~PowerIo() = default;
  virtual Task<Result<BatteryState>> battery() = 0;
  virtual Task<Result<SafetyInputs>> inputs() = 0;
  // Goes off by itself after `hold` unless repeated.
  virtual Task<Result<void>> set_relay(int channel, bool on, Duration hold) = 0;
};

// Where no robot can drive, a person carries the scanner: asks for it to be set up at `wanted` and
// returns where it then stands. Fails with errc::address_not_available when nobody can stand there.
class Placement {
 public:
  virtual ~Placement() = default;
  virtual Task<Result<SurveyedPose>> place(std::string_view region, Pose2 wanted) = 0;
};

struct Devices {
  Drive& drive;
  Imu& imu;
  Gnss& gnss;
  Scanner& scanner;
  Placement& placement;
  // What is wrong with them now, in words for the operator; empty text: nothing. May be empty.
  std::function<std::string()> troubles = {};
  // Looks level ahead while the robot drives, to see what is in the way. Null: the robot has none.
  ProfileScanner* obstacles = nullptr;
};

}  // namespace hal
