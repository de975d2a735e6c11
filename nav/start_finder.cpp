#include "nav/start_finder.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace nav {
namespace {

constexpr double kRefusedSigmas = 4;
constexpr double kRefusedShareMax = 0.34;

struct Laid {
  double heading_rad{};
  Eigen::Vector2d shift_m{0, 0};
  Eigen::Vector2d O_centre_m{0, 0};
  double weight{}, weighted_squares{};  // Of the ways from the centre.
};

Eigen::Matrix2d turn_by(double angle_rad) {
  return Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
}

}  // namespace

StartFinder::StartFinder(const LocalizerConfig& localizer, const StartFinderConfig& config)
    : localizer_(localizer),
      config_(config),
      odometry_(localizer, {}, Eigen::Matrix3d::Identity() * 1e-6) {}

void StartFinder::add(const LocalizerEvent& event) {
  if (const auto* fix = std::get_if<GnssPosition>(&event)) {
    if (!fix->position_m.allFinite() || !(fix->covariance_m2.diagonal().minCoeff() >= 0)) return;
    if (seen_++ % keep_every_ != 0) return;
    const auto pose = odometry_.T_W_B();
    sights_.push_back({(pose * localizer_.B_antenna_m).head<2>(), fix->position_m,
                       std::sqrt(std::max(1e-6, fix->covariance_m2.diagonal().maxCoeff())),
                       way_m_});
    if (sights_.size() < config_.fixes_max) return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < sights_.size(); i += 2) sights_[kept++] = sights_[i];
    sights_.resize(kept);
    keep_every_ *= 2;
    return;
  }
  if (const auto* travel = std::get_if<hal::WheelTravel>(&event)) {
    way_m_ += std::abs(travel->left_m + travel->right_m) / 2;
  } else if (!std::holds_alternative<InertialSample>(event)) {
    return;
  }
  odometry_.apply(localizer_, event);
}

std::optional<FoundStart> StartFinder::found() const {
  std::string missing;
  return fit(missing);
}

std::string StartFinder::waiting_for() const {
  std::string missing;
  fit(missing);
  return missing;
}

std::optional<FoundStart> StartFinder::fit(std::string& missing) const {
  std::vector<bool> used(sights_.size(), true);
  std::size_t count = sights_.size();
  const auto sigma_m = [&](const Sight& s) {
    return std::hypot(s.sigma_m, config_.drift_share * (way_m_ - s.way_m) / 2);
  };
  const auto lay = [&] {
    Laid laid;
    Eigen::Vector2d W_centre(0, 0);
    for (std::size_t i = 0; i < sights_.size(); ++i) {
      if (!used[i]) continue;
      const double w = std::pow(sigma_m(sights_[i]), -2);
      laid.weight += w;
      laid.O_centre_m += w * sights_[i].O_antenna_m;
      W_centre += w * sights_[i].W_fix_m;
    }
    laid.O_centre_m /= laid.weight;
    W_centre /= laid.weight;
    double along = 0, across = 0;
    for (std::size_t i = 0; i < sights_.size(); ++i) {
      if (!used[i]) continue;
      const double w = std::pow(sigma_m(sights_[i]), -2);
      const Eigen::Vector2d o = sights_[i].O_antenna_m - laid.O_centre_m;
      const Eigen::Vector2d f = sights_[i].W_fix_m - W_centre;
      along += w * o.dot(f);
      across += w * (o.x() * f.y() - o.y() * f.x());
      laid.weighted_squares += w * o.squaredNorm();
    }
    laid.heading_rad = std::atan2(across, along);
    laid.shift_m = W_centre - turn_by(laid.heading_rad) * laid.O_centre_m;
    return laid;
  };

  for (;;) {
    double reach_m = 0;
    for (std::size_t i = 0; i < sights_.size(); ++i)
      for (std::size_t j = 0; used[i] && j < i; ++j)
        if (used[j])
          reach_m = std::max(reach_m, (sights_[i].O_antenna_m - sights_[j].O_antenna_m).norm());
    if (count < config_.fixes_min) {
      missing = fmt::format("{} of {} satellite fixes", count, config_.fixes_min);
      return std::nullopt;
    }
    if (reach_m < config_.reach_min_m) {
      missing =
          fmt::format("drive on: {:.1f} of {:.1f} m with fixes", reach_m, config_.reach_min_m);
      return std::nullopt;
    }
    const Laid laid = lay();
    std::size_t worst = 0;
    double worst_sigmas = 0;
    for (std::size_t i = 0; i < sights_.size(); ++i) {
      const Eigen::Vector2d off =
          turn_by(laid.heading_rad) * sights_[i].O_antenna_m + laid.shift_m - sights_[i].W_fix_m;
      const double sigmas = off.norm() / sigma_m(sights_[i]);
      if (used[i] && sigmas > worst_sigmas) worst_sigmas = sigmas, worst = i;
    }
    if (worst_sigmas > kRefusedSigmas) {
      used[worst] = false;
      --count;
      if (static_cast<double>(sights_.size() - count) >
          kRefusedShareMax * static_cast<double>(sights_.size())) {
        missing = "satellite fixes that agree with the way driven: go where the sky is open";
        return std::nullopt;
      }
      continue;
    }
    // What wanders does not average out: at worst all fixes share it, and its change bends the
    // heading over the reach.
    const double sigma_fix_m = std::sqrt(static_cast<double>(count) / laid.weight);
    const double lasting = localizer_.gnss_wander_share * sigma_fix_m * sigma_fix_m;
    const double heading_variance = 1 / laid.weighted_squares + 2 * lasting / (reach_m * reach_m) +
                                    std::pow(config_.drift_share / 2, 2);
    if (heading_variance > std::pow(config_.heading_sigma_max_rad, 2)) {
      missing = fmt::format("drive on: heading known to {:.1f} deg only",
                            std::sqrt(heading_variance) * 180 / std::numbers::pi);
      return std::nullopt;
    }
    const hal::Pose2 O_pose = odometry_.pose();
    FoundStart start;
    start.stamp = odometry_.moved_until().value_or(hal::Time{});
    start.pose.position_m = turn_by(laid.heading_rad) * O_pose.position_m + laid.shift_m;
    start.pose.heading_rad =
        std::remainder(laid.heading_rad + O_pose.heading_rad, 2 * std::numbers::pi);
    start.fixes_refused = sights_.size() - count;
    const Eigen::Vector2d arm = turn_by(laid.heading_rad) * (O_pose.position_m - laid.O_centre_m);
    const Eigen::Vector2d swing(-arm.y(), arm.x());
    start.covariance.setZero();
    start.covariance.topLeftCorner<2, 2>() =
        (1 / laid.weight + lasting) * Eigen::Matrix2d::Identity() +
        heading_variance * swing * swing.transpose();
    start.covariance.topRightCorner<2, 1>() = heading_variance * swing;
    start.covariance.bottomLeftCorner<1, 2>() = heading_variance * swing.transpose();
    start.covariance(2, 2) = heading_variance;
    return start;
  }
}

}  // namespace nav
