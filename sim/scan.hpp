// The simulated 3-D scanner (paper section 4): one beam per direction of the pattern, cast into the
// mesh, with the noise and the losses of a real one.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "hal/values.hpp"
#include "sim/scene.hpp"

namespace sim {

// What the scanner can do. Radians and metres; sigmas are 1-sigma.
struct ScannerModel {
  double height_m = 1.8;  // Of S above the ground.
  double range_min_m = 1.0;
  double range_max_m = 100.0;
  double fov_rad = 6.283185307179586;  // Horizontal, centred on the heading.
  double azimuth_step_rad = 0.2 * 0.017453292519943295;
  double elevation_min_rad = -60 * 0.017453292519943295;
  double elevation_max_rad = 90 * 0.017453292519943295;
  double elevation_step_rad = 0.1 * 0.017453292519943295;
  double scan_s = 300.0;
  double range_sigma_m = 0.01;
  // Beams that graze a surface come back too weak: see lost_share.
  double grazing_start_rad = 80 * 0.017453292519943295;
  double grazing_end_rad = 89 * 0.017453292519943295;
  double lost_share_max = 0.95;  // 0: no beam is lost.
};

// The beams of one scan: directions in the middle of equal steps that fill the field of view, so
// that a full circle closes and the zenith is not scanned once per column. Steps that do not divide
// their interval are adjusted to the nearest that do. Throws std::invalid_argument for a step or an
// interval that is not positive or asks for more than 1e9 beams.
hal::ScanPattern make_pattern(const ScannerModel& model);

// The share of beams that do not come back from an incidence angle (0 is head-on): 0 up to
// grazing_start, then smoothly (3 s^2 - 2 s^3) to lost_share_max at grazing_end and beyond.
double lost_share(const ScannerModel& model, double incidence_rad);

// One scan from T_W_S (rotation and translation only). ranges_m[column * rows + row] as in
// hal::ScanCloud: 0 where nothing within range_max, something nearer than range_min, or a lost
// beam. Noise depends on (seed, scan_number, beam) only: any number of threads gives the same scan.
std::vector<float> cast_scan(const Scene& scene, const Eigen::Isometry3d& T_W_S,
                             const hal::ScanPattern& pattern, const ScannerModel& model,
                             std::uint64_t seed, std::uint64_t scan_number, int threads);

}  // namespace sim
