#include "nav/registration/registration.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "nav/linear.hpp"
#include "nav/registration/icp.hpp"

namespace nav {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kSettledM = 0.005, kSettledRad = 0.0005;       // What the last step may still do.
constexpr double kShiftFloorM = 0.001, kTurnFloorRad = 0.0001;  // No pair is better than that.

struct Alignment {
  Eigen::Isometry3d pose;
  PlaneEquations equations;
  int steps = 0;
  bool settled = false;
};

// Steps of one level. False when there is not enough to hold on to.
bool run_level(const Surface& reference, const Points& reading, const IcpLevel& level,
               const RegistrationConfig& config, const RunPieces& run, bool last, Alignment& at) {
  const double enough_m = last ? config.settled_m : 0.01 * level.voxel_m;
  const double enough_rad = last ? config.settled_rad : 0.0005;
  double reach_m = level.reach_start_m;
  for (int step = 0; step < level.steps_max; ++step) {
    const auto pairs = plane_pairs(reference, reading, config.points_max, at.pose, reach_m, run);
    if (pairs.size() < 12) return false;
    at.equations = plane_equations(pairs, config, run);
    const Vector6d motion = plane_step(at.equations, config.free_below, at.pose);
    ++at.steps;
    const double shift_m = motion.head<3>().norm(), turn_rad = motion.tail<3>().norm();
    const bool narrowest = reach_m <= level.reach_end_m;
    at.settled = shift_m < kSettledM && turn_rad < kSettledRad;
    if (narrowest && shift_m < enough_m && turn_rad < enough_rad) break;
    // Far from rest, the pairs are not yet the right ones.
    if (narrowest || step % 2 == 0) continue;
    reach_m = std::max(level.reach_end_m, reach_m * 0.7);
  }
  return true;
}

Alignment align(const PreparedScan& reference, const PreparedScan& reading,
                const Eigen::Isometry3d& guess, const RegistrationConfig& config,
                const RunPieces& run) {
  Alignment at{guess, {}, 0, false};
  for (std::size_t i = 0; i < config.levels.size(); ++i)
    run_level(reference.parts().levels[i], reading.parts().levels[i].points.points_m(),
              config.levels[i], config, run, i + 1 == config.levels.size(), at);
  return at;
}

// What is left of a block of H when the other block may move freely.
Eigen::Matrix3d held(const Matrix6d& H, bool shift) {
  const int own = shift ? 0 : 3, other = shift ? 3 : 0;
  const Eigen::Matrix3d O = H.block<3, 3>(other, other) + 1e-9 * Eigen::Matrix3d::Identity();
  return H.block<3, 3>(own, own) -
         H.block<3, 3>(own, other) * O.inverse() * H.block<3, 3>(other, own);
}

std::array<HeldAxis, 3> axes(const Matrix6d& H, bool shift, const Matrix6d& covariance,
                             double free_below) {
  const Axes<3> found = axes_of(held(H, shift));
  std::array<HeldAxis, 3> all;
  for (int i = 0; i < 3; ++i) {
    HeldAxis& axis = all[static_cast<std::size_t>(i)];
    axis.direction = found.vectors.col(i);
    Eigen::Index largest = 0;
    axis.direction.cwiseAbs().maxCoeff(&largest);
    if (axis.direction[largest] < 0) axis.direction *= -1;
    axis.strength = std::max(0.0, 3 * found.values[i]);
    const int at = shift ? 0 : 3;
    axis.sigma = std::sqrt(
        std::max(0.0, axis.direction.dot(covariance.block<3, 3>(at, at) * axis.direction)));
    axis.is_free = axis.strength < free_below;
  }
  return all;
}

// Of motions of the pose: from the equations about their centre to the reading's origin.
Matrix6d covariance_of(const Alignment& at, const RegistrationConfig& config) {
  const PlaneEquations& e = at.equations;
  Vector6d unscale;
  unscale << 1, 1, 1, e.radius_m, e.radius_m, e.radius_m;
  const double information =
      e.weight / config.correlated_points / std::pow(std::max(e.sigma_m, config.noise_floor_m), 2);
  Matrix6d H = information * (unscale.asDiagonal() * e.H * unscale.asDiagonal());
  Matrix6d arm = Matrix6d::Identity();
  arm.topRightCorner<3, 3>() = -cross_matrix(at.pose.translation() - e.centre_m);
  // The equations see a motion of the pose as one about their centre: inverse of the arm.
  const Matrix6d inverse_arm = 2 * Matrix6d::Identity() - arm;
  H = Matrix6d(inverse_arm.transpose() * H * inverse_arm);
  H.diagonal().head<3>().array() += std::pow(config.guess_sigma_m, -2);
  H.diagonal().tail<3>().array() += std::pow(config.guess_sigma_rad, -2);
  Matrix6d covariance = inverse_of(H);
  covariance.diagonal().head<3>().array() += std::pow(kShiftFloorM, 2);
  covariance.diagonal().tail<3>().array() += std::pow(kTurnFloorRad, 2);
  return (covariance + covariance.transpose()) / 2;
}

struct Seen {
  double agrees{}, in_front{};
};

Seen seen_by(const RangeImage& image, const Points& points, const Eigen::Isometry3d& pose) {
  const Eigen::Isometry3f pose_f = pose.cast<float>();
  Seen seen;
  for (const auto& p : points) {
    const auto sight = image.look(pose_f * p);
    seen.agrees += sight == RangeImage::Sight::agrees;
    seen.in_front += sight == RangeImage::Sight::in_front;
  }
  return seen;
}

// Both ways: a reading that was taken elsewhere stands in the reference's clear views, or the other
// way round.
double conflict_of(const PreparedScan::Parts& reference, const PreparedScan::Parts& reading,
                   const Eigen::Isometry3d& pose, std::size_t level) {
  const Points& ours = reading.levels[level].points.points_m();
  const Points& theirs = reference.levels[level].points.points_m();
  const Seen there = seen_by(reference.seen, ours, pose);
  const Seen back = seen_by(reading.seen, theirs, pose.inverse());
  const double clear = there.in_front + back.in_front;
  return clear / std::max(1.0, clear + there.agrees + back.agrees);
}

void measure_overlap(const Surface& reference, const Points& reading,
                     const RegistrationConfig& config, Registration& result) {
  const Eigen::Isometry3f pose = result.T_reference_reading.cast<float>();
  std::vector<float> near2;
  const std::size_t step =
      std::max<std::size_t>(1, (reading.size() + config.points_max - 1) / config.points_max);
  std::size_t asked = 0;
  for (std::size_t i = 0; i < reading.size(); i += step, ++asked) {
    Neighbour near;
    if (reference.points.nearest(pose * reading[i], static_cast<float>(config.overlap_within_m),
                                 near))
      near2.push_back(near.distance2_m2);
  }
  result.overlap =
      static_cast<double>(near2.size()) / static_cast<double>(std::max<std::size_t>(1, asked));
  if (near2.empty()) return;
  const auto middle = near2.begin() + static_cast<std::ptrdiff_t>(near2.size() / 2);
  std::nth_element(near2.begin(), middle, near2.end());
  result.cloud_to_cloud_m = std::sqrt(static_cast<double>(*middle));
}

std::string why_refused(const Registration& r, const RegistrationConfig& config) {
  if (r.pairs < config.pairs_min)
    return fmt::format(
        "only {} pairs of points came together, fewer than {}: the scans hardly "
        "overlap; scan from a nearer station",
        r.pairs, config.pairs_min);
  if (r.overlap < config.overlap_min)
    return fmt::format(
        "overlap {:.0f} % is below {:.0f} %: these scans may not belong together; "
        "scan from a nearer station",
        100 * r.overlap, 100 * config.overlap_min);
  if (r.conflict > config.conflict_max)
    return fmt::format(
        "{:.0f} % of the points stand where the other scan looked through (at most "
        "{:.0f} %): wrong pair or wrong guess",
        100 * r.conflict, 100 * config.conflict_max);
  if (r.fit < config.fit_min)
    return fmt::format(
        "{:.0f} % of the pairs lie in their plane, fewer than {:.0f} %: wrong pair or "
        "wrong guess",
        100 * r.fit, 100 * config.fit_min);
  if (r.rms_m > config.rms_max_m)
    return fmt::format(
        "RMS {:.3f} m is above {:.3f} m: wrong pair, or the scanner moved while it "
        "scanned",
        r.rms_m, config.rms_max_m);
  if (!r.settled) return "did not settle: give a better guess";
  if (r.moved_m > config.moved_max_m || r.moved_rad > config.moved_max_rad)
    return fmt::format(
        "moved {:.2f} m and {:.1f} deg from the guess, farther than {:.2f} m and "
        "{:.1f} deg: give a better guess",
        r.moved_m, r.moved_rad / kDeg, config.moved_max_m, config.moved_max_rad / kDeg);
  return {};
}

std::string free_directions(const Registration& r) {
  std::string text;
  const auto add = [&](const std::array<HeldAxis, 3>& held_axes, std::string_view what) {
    for (const HeldAxis& axis : held_axes)
      if (axis.is_free)
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", what, in_words(axis.direction));
  };
  add(r.shift, "free along");
  add(r.turn, "free about");
  return text;
}

void judge(Registration& result, const RegistrationConfig& config) {
  result.reason = why_refused(result, config);
  if (!result.reason.empty()) {
    result.verdict = Verdict::refused;
    return;
  }
  result.reason = free_directions(result);
  result.verdict = result.reason.empty() ? Verdict::accepted : Verdict::held_in_part;
}

Registration registration_from(const PreparedScan& reference, const PreparedScan& reading,
                               const Eigen::Isometry3d& start, const Eigen::Isometry3d& guess,
                               const RegistrationConfig& config, const RunPieces& run) {
  const Alignment at = align(reference, reading, start, config, run);
  Registration result;
  result.T_reference_reading = at.pose;
  result.pairs = at.equations.pairs;
  result.fit = static_cast<double>(at.equations.pairs) /
               static_cast<double>(std::max<std::size_t>(1, at.equations.pairs_asked));
  result.steps = at.steps;
  result.settled = at.settled;
  result.rms_m = at.equations.rms_m;
  const Vector6d way = motion_between(guess, at.pose);
  result.moved_m = way.head<3>().norm();
  result.moved_rad = way.tail<3>().norm();
  if (result.pairs > 0) {
    result.covariance = covariance_of(at, config);
    result.shift = axes(at.equations.H, true, result.covariance, config.free_below);
    result.turn = axes(at.equations.H, false, result.covariance, config.free_below);
    const std::size_t finest = config.levels.size() - 1;
    measure_overlap(reference.parts().levels[finest],
                    reading.parts().levels[finest].points.points_m(), config, result);
    if (config.scanner_at_origin)
      result.conflict =
          conflict_of(reference.parts(), reading.parts(), at.pose, finest > 0 ? finest - 1 : 0);
  }
  judge(result, config);
  return result;
}

// Turned either way and shifted four ways, about the reading's own origin.
std::vector<Eigen::Isometry3d> other_guesses(const Eigen::Isometry3d& guess,
                                             const RegistrationConfig& config) {
  std::vector<Eigen::Isometry3d> others;
  const auto add = [&](double x_m, double y_m, double turn_rad) {
    Vector6d motion;
    motion << x_m, y_m, 0, 0, 0, turn_rad;
    others.push_back(moved(guess, motion));
  };
  for (const double sign : {1.0, -1.0}) {
    if (config.retry_rad > 0) add(0, 0, sign * config.retry_rad);
    if (config.retry_m > 0) add(sign * config.retry_m, 0, 0);
    if (config.retry_m > 0) add(0, sign * config.retry_m, 0);
  }
  return others;
}

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::accepted:
      return "accepted";
    case Verdict::held_in_part:
      return "held in part";
    case Verdict::refused:
      break;
  }
  return "refused";
}

std::string in_words(const Eigen::Vector3d& direction) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(direction[i]) > 0.985) return std::string(1, "xyz"[i]);
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

PreparedScan::PreparedScan(std::span<const Eigen::Vector3f> points_m,
                           const RegistrationConfig& config, const RunPieces& run, Use use) {
  // Coarser clouds are thinned from the next finer one: most points are met once only.
  std::vector<Points> clouds(config.levels.size());
  Points finer = usable_points(points_m, config.near_m, config.far_m);
  for (std::size_t i = clouds.size(); i-- > 0;)
    finer = clouds[i] = thinned(finer, config.levels[i].voxel_m);
  parts_ = std::make_unique<Parts>(Parts{{}, RangeImage(clouds.back())});
  for (Points& points : clouds)
    parts_->levels.push_back(use == Use::both ? make_surface(std::move(points), config.normals, run)
                                              : Surface{NearestPoints(std::move(points)), {}});
}
PreparedScan::~PreparedScan() = default;
PreparedScan::PreparedScan(PreparedScan&&) noexcept = default;
PreparedScan& PreparedScan::operator=(PreparedScan&&) noexcept = default;

double overlap_at(const PreparedScan& reference, const PreparedScan& reading,
                  const Eigen::Isometry3d& T_reference_reading, double within_m) {
  const Points& points = reading.parts().levels.front().points.points_m();
  const NearestPoints& there = reference.parts().levels.front().points;
  const Eigen::Isometry3f pose = T_reference_reading.cast<float>();
  const auto near = std::ranges::count_if(points, [&](const Eigen::Vector3f& p) {
    Neighbour unused;
    return there.nearest(pose * p, static_cast<float>(within_m), unused);
  });
  return static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(1, points.size()));
}

double conflict_at(const PreparedScan& reference, const PreparedScan& reading,
                   const Eigen::Isometry3d& T_reference_reading) {
  const std::size_t finest = reference.parts().levels.size() - 1;
  return conflict_of(reference.parts(), reading.parts(), T_reference_reading,
                     finest > 0 ? finest - 1 : 0);
}

Registration register_scans(const PreparedScan& reference, const PreparedScan& reading,
                            const Eigen::Isometry3d& guess_T_reference_reading,
                            const RegistrationConfig& config, const RunPieces& run) {
  Registration first = registration_from(reference, reading, guess_T_reference_reading,
                                         guess_T_reference_reading, config, run);
  if (first.verdict != Verdict::refused) return first;
  int tried = 0;
  for (const auto& other : other_guesses(guess_T_reference_reading, config)) {
    Registration again =
        registration_from(reference, reading, other, guess_T_reference_reading, config, run);
    again.guess_tried = ++tried;
    if (again.verdict != Verdict::refused) return again;
  }
  return first;
}

}  // namespace nav
