// Brings two 3-D scans together: point-to-plane ICP from coarse to fine with a robust kernel, and
// says how far the result can be trusted. The same result for any number of threads.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nav/registration/cloud.hpp"
#include "nav/registration/pieces.hpp"
#include "nav/registration/rigid.hpp"

namespace nav {

// One resolution. Points farther apart than the reach are no pair; the reach shrinks by half from
// one step to the next, down to its end.
struct IcpLevel {
  double voxel_m{};
  double reach_start_m{}, reach_end_m{};
  int steps_max{};
};

struct RegistrationConfig {
  // Used of a scan: empty returns and the robot itself are nearer.
  double near_m = 0.5, far_m = 150;
  // From coarse to fine, at least one.
  std::vector<IcpLevel> levels{{1.0, 4.0, 1.5, 20}, {0.5, 1.5, 0.8, 15}, {0.25, 0.8, 0.4, 25}};
  NormalConfig normals;
  std::size_t points_max = 4000;  // Of the reading, in each step.
  double noise_floor_m = 0.02;    // Residuals below this are as good as none.
  double kernel_scale = 2.5;      // In robust sigmas of the residuals (Geman and McClure).
  double settled_m = 2e-4;        // A smaller step ends the last level ...
  double settled_rad = 2e-5;      // ... and so small a turn; the others end sooner.
  double free_below = 0.02;  // Strength below which a direction is held where the guess has it.
  double correlated_points = 12;  // So many residuals count as one independent measurement.
  double guess_sigma_m = 0.5;     // How far the guess may be off: enters the covariance,
  double guess_sigma_rad = 0.09;  // which matters where the scans say nothing.
  // Gate.
  std::size_t pairs_min = 300;
  double overlap_min = 0.25;
  double overlap_within_m = 0.5;
  double rms_max_m = 0.15;
  double conflict_max =
      0.02;  // Right pairs of real scans have 0.01 at most, wrong ones 0.025 and more.
  double fit_min = 0.4;
  double moved_max_m = 2.5, moved_max_rad = 0.35;
  bool scanner_at_origin = true;  // Else what a point hides cannot be told: no conflicts.
  // A guess that fails is tried again turned and shifted by so much (0: not).
  double retry_m = 1.0, retry_rad = 0.12;
};

// A scan made ready, once for all its pairs. Points in the scanner's frame, metres.
class PreparedScan {
 public:
  // A scan that will never be the reference needs no normals, which take the most time.
  enum class Use { both, reading_only };

  PreparedScan(std::span<const Eigen::Vector3f> points_m, const RegistrationConfig& config,
               const RunPieces& run = {}, Use use = Use::both);
  ~PreparedScan();
  PreparedScan(PreparedScan&&) noexcept;
  PreparedScan& operator=(PreparedScan&&) noexcept;

  struct Parts;
  const Parts& parts() const { return *parts_; }

 private:
  std::unique_ptr<Parts> parts_;
};

// How firmly the pair holds one direction: 1 where surfaces face every way alike, 0 where the
// reading may slide (or turn) without anything changing.
struct HeldAxis {
  Eigen::Vector3d direction{0, 0, 1};  // In the reference's axes, length 1.
  double strength{};
  double sigma{};  // m, or rad about the axis.
  bool is_free{};  // Weaker than free_below.
};

enum class Verdict {
  accepted,
  held_in_part,  // Good, but free directions stand where the guess had them.
  refused
};
std::string_view name(Verdict verdict);

struct Registration {
  Eigen::Isometry3d T_reference_reading = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();  // Of motions of that pose: see rigid.hpp.
  std::array<HeldAxis, 3> shift, turn;     // Weakest first.
  double rms_m{};             // Of distances to the reference's planes, outliers left out.
  double cloud_to_cloud_m{};  // Median distance to the nearest point of the reference, in overlap.
  double overlap{};           // Share of the reading with the reference within overlap_within_m.
  double fit{};               // Share of pairs that the kernel keeps: the rest lie off the plane.
  double conflict{};          // Share of points that stand where the other scan looked through.
  double moved_m{}, moved_rad{};  // From the guess.
  std::size_t pairs{};
  int steps{};
  bool settled{};
  int guess_tried{};  // 0: the guess itself; else which of the others.
  Verdict verdict = Verdict::refused;
  std::string reason;  // Why it was refused, or which directions are free. Empty: accepted.
};

Registration register_scans(const PreparedScan& reference, const PreparedScan& reading,
                            const Eigen::Isometry3d& guess_T_reference_reading,
                            const RegistrationConfig& config, const RunPieces& run = {});

// Share of the reading that has the reference within `within_m` where the pose puts it: how much
// they would overlap, from the coarsest clouds only. Cheap; says nothing of how well they fit.
double overlap_at(const PreparedScan& reference, const PreparedScan& reading,
                  const Eigen::Isometry3d& T_reference_reading, double within_m);

// Registration::conflict as it would be at that pose, without moving it.
double conflict_at(const PreparedScan& reference, const PreparedScan& reading,
                   const Eigen::Isometry3d& T_reference_reading);

// "x", "y and z", or "(0.71, -0.71, 0.00)": a direction for people.
std::string in_words(const Eigen::Vector3d& direction);

}  // namespace nav
