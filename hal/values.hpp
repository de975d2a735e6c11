// The robot's vocabulary: plain values that every folder may use. No waiting, no sockets.
//
// Frames: W is the site frame (right-handed, x east, y north, z up, metres), S the scanner's own
// frame (x forward, y left, z up), B the robot's body on the ground below S. T_W_S maps S to W.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/system/result.hpp>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

namespace hal {

// An operating error (time-out, bad frame, bus off) is a value. A broken promise in our own code is
// an assertion.
template <class T>
using Result = boost::system::result<T>;

struct RobotClock {};  // Tags time points, so a wall-clock time cannot be passed by mistake.
using Duration = std::chrono::nanoseconds;
using Time = std::chrono::time_point<RobotClock, Duration>;

inline double seconds(Duration span) {
  return std::chrono::duration<double>(span).count();
}
inline double seconds(Time time) {
  return seconds(time.time_since_epoch());
}
inline Duration from_seconds(double span_s) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(span_s));
}

struct Twist {
  double forward_mps{};
  double turn_radps{};  // Counter-clockwise positive.
};

// Where the body stands on the ground, in W. Heading is counter-clockwise from the x axis.
struct Pose2 {
  Eigen::Vector2d position_m{0, 0};
  double heading_rad{};
};

// How far each side rolled since the previous report.
struct WheelTravel {
  Time stamp{};
  double left_m{};
  double right_m{};
};

struct ImuSample {
  Time stamp{};
  double yaw_rate_radps{};
};

// A satellite fix, already in W. sigma_m is the receiver's own 1-sigma claim per axis.
struct GnssFix {
  Time stamp{};
  Eigen::Vector2d position_m{0, 0};
  double sigma_m{};
};

// Where a person set up the scanner by hand, as surveyed from known marks.
struct SurveyedPose {
  Pose2 pose;
  double ground_z_m{};
  double position_sigma_m{};
  double heading_sigma_rad{};
};

// The directions of a scan's beams in S: `columns` azimuths from azimuth_first_rad, and in each
// column `rows` elevations from elevation_first_rad (0 is the horizon, pi/2 the zenith).
struct ScanPattern {
  double azimuth_first_rad{};
  double azimuth_step_rad{};
  double elevation_first_rad{};
  double elevation_step_rad{};
  std::uint32_t columns{};
  std::uint32_t rows{};

  std::size_t beams() const { return std::size_t{columns} * rows; }
};

// Where a beam starts and which way it goes, in S. The direction has length 1.
struct Beam {
  Eigen::Vector3f S_origin_m{0, 0, 0};
  Eigen::Vector3f S_direction{1, 0, 0};
};

// How a scan's beams went, where one fan of them turned about S's z axis: shorter by far than beam
// by beam, which is beams_of() in hal/pan_fan.hpp. Frame P is S turned with the pan axis.
struct PanFan {
  Eigen::Vector3d P_origin_m{0, 0, 0};
  std::vector<Eigen::Vector3d> P_directions;  // Of each row.
  double pan_per_row_rad{};                   // The axis goes on turning from row to row.
  std::vector<double> pan_rad;                // At row 0 of each column.

  std::size_t beams() const { return P_directions.size() * pan_rad.size(); }
};

// One 3-D scan. ranges_m[column * rows + row] is the range along that beam in metres; 0 says that
// nothing came back, NaN that nothing is known: such a beam claims nothing.
struct ScanCloud {
  Time stamp{};
  ScanPattern pattern;
  std::vector<float> ranges_m;
  // Where the beams really went, in the same order: a scanner that turns while it measures, or
  // whose optics are beside the pan axis, keeps to the pattern only nearly. Empty: exactly the
  // pattern, all from the origin of S.
  std::vector<Beam> beams = {};
  // Where it is there, `beams` are exactly its beams_of().
  std::optional<PanFan> fan = {};
};

// One turn of a profile scanner's mirror, in the scanner's own frame L: x ahead, y left, beams in
// the xy plane, angles counter-clockwise from x.
struct Profile {
  Time stamp{};            // Of the first beam, by our clock.
  double beam_period_s{};  // From one beam to the next.
  double angle_first_rad{};
  double angle_step_rad{};
  std::vector<float> ranges_m;     // 0: nothing came back. NaN: nothing is known.
  std::vector<float> intensities;  // As the device counts; empty where it sends none.
  std::uint64_t lost_before{};     // Profiles that went missing since the one before.
};

// Where the pan axis stood at some time between asking and the answer's arrival. Counter-clockwise
// from S's x axis.
struct PanReading {
  Time asked{}, answered{};
  double angle_rad{};
};

// What the robot's supply says; what it does not know is nothing.
struct BatteryState {
  Time stamp{};
  std::optional<double> voltage_v, current_a, charge_percent, temperature_c, time_to_go_s;
};

// What the safety inputs say. Whatever is not surely released counts as pressed.
struct SafetyInputs {
  Time stamp{};
  bool estop_pressed = true;
  bool bumper_pressed = true;
  bool reset_pressed = false;
};

}  // namespace hal
