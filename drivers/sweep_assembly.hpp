// A 3-D scan from the profiles of a scanner that a pan unit turned: which part of the circle to
// turn through, and where every beam went. Pure: profiles and pan angles in, a ScanCloud out.
//
// Frames: S stands still, P is S turned about z by the pan angle, L is the profile scanner's own
// (hal::Profile). T_P_L is the mount. The mirror's axis (z of L) lies across the pan axis, so that
// a profile is an upright half circle or more: it begins on one side, may pass over the zenith and
// come down on the far side. Elevations are counted on from 0 at the near horizon, beyond 90
// degrees behind the zenith.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/pan_fit.hpp"
#include "hal/values.hpp"

namespace drivers {

// What the robot file says of how the scanner hangs on the pan unit. Begins with an upright plane
// whose x axis looks straight ahead and whose y axis looks up; tilted within its plane, then leaned
// over to the right, then turned to the left. The offset along the pan axis shows only as the
// scanner's height.
struct SweepMount {
  double tilt_rad{};  // How high the scanner's straight ahead looks: 90 degrees is up.
  double roll_rad{}, yaw_rad{};
  Eigen::Vector3d P_offset_m{0, 0, 0};  // Of the scanner's origin from the pan axis.

  Eigen::Isometry3d T_P_L() const;
};

// What a profile covers.
struct MirrorField {
  double angle_first_rad{}, angle_step_rad{};
  std::uint32_t beams{};
  double beam_period_s{};
  double interval_s{};  // From one profile to the next.
};

// The wanted field of view, centred ahead: elevations from -90 to 90 degrees.
struct SweepField {
  double fov_rad = 6.283185307179586;
  double elevation_min_rad = -1.5707963267948966;
  double elevation_max_rad = 1.5707963267948966;
  double azimuth_step_rad = 0.0043633231299858238;  // Between profiles.
};

struct SweepPlan {
  std::string problem;                     // Empty, or why this field cannot be had so.
  double pan_first_rad{}, pan_last_rad{};  // At the middles of the first and the last profile.
  double pan_step_rad{};                   // From one column to the next,
  double interval_s{};                     // after which time.
  double rate_radps{};
  bool both_sides{};  // Half a circle shows all of it, the far side of the profiles included.
  // Rows go up in elevation: row r is beam beam_first + r * beam_step.
  std::uint32_t rows{}, beam_first{};
  int beam_step = 1;
  double azimuth_offset_rad{};  // Of the near side from the pan angle.
  double elevation_first_rad{}, elevation_step_rad{};
};

// No more of the circle than the field needs, and no beams that it does not.
SweepPlan plan_sweep(const SweepField& field, const MirrorField& mirror,
                     const Eigen::Isometry3d& T_P_L);

// How far the axis turns before the first and after the last profile, to be at an even speed in
// between.
double run_up_rad(const SweepPlan& plan, double acceleration_radps2);

// How good a scan is.
struct SweepQuality {
  std::uint32_t columns{}, columns_lost{};
  double pan_residual_rms_rad{}, pan_residual_max_rad{};
  std::size_t pan_readings{};
  double rate_radps{};
  double clock_jitter_s{};  // Of the profiles' arrivals.
  double lost_share() const { return columns == 0 ? 1 : 1.0 * columns_lost / columns; }
};

struct SweepLimits {
  double lost_share_max = 0.01;
  double pan_residual_rms_max_rad = 0.00025;  // About one step of a fine unit.
  double rate_error_max = 0.02;               // Of the planned rate.
  double clock_jitter_max_s = 0.05;
  std::size_t pan_readings_min = 20;
};

// Empty, or which limit it breaks.
std::string sweep_problem(const SweepQuality& quality, const SweepPlan& plan,
                          const SweepLimits& limits);

struct SweepCloud {
  hal::ScanCloud cloud;
  SweepQuality quality;
};

// One column per profile whose middle lies between the plan's angles, in the order of pan angles;
// a column whose profile was lost says nothing: its ranges are NaN. `pan_late_s` is how much later
// than the profiles' the pan readings' times are (calibrated by scanning both ways). Stamped with
// the last beam. No columns at all when no profile fits.
SweepCloud assemble_sweep(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L,
                          std::span<const hal::Profile> profiles, const PanFit& pan,
                          double pan_late_s);

// The same from standing profiles: one per stop, taken at these pan angles.
struct StoppedProfile {
  double pan_rad{};
  hal::Profile profile;
  bool lost{};
};
SweepCloud assemble_stops(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L,
                          std::span<const StoppedProfile> stops);

}  // namespace drivers
