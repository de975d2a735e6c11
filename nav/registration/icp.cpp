#include "nav/registration/icp.hpp"

#include <algorithm>
#include <cmath>

#include "nav/linear.hpp"

namespace nav {
namespace {

struct Moments {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares{};
  Moments& operator+=(const Moments& other) {
    sum += other.sum;
    squares += other.squares;
    return *this;
  }
};

struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double weight{}, kept_squares{};
  std::size_t kept{};
  Normal& operator+=(const Normal& other) {
    H += other.H;
    g += other.g;
    weight += other.weight;
    kept_squares += other.kept_squares;
    kept += other.kept;
    return *this;
  }
};

double robust_sigma(const std::vector<PlanePair>& pairs, double floor_m) {
  std::vector<double> sizes(pairs.size());
  std::transform(pairs.begin(), pairs.end(), sizes.begin(),
                 [](const PlanePair& pair) { return std::abs(pair.residual_m); });
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(1.4826 * *middle, floor_m);
}

}  // namespace

std::vector<PlanePair> plane_pairs(const Surface& reference, const Points& reading,
                                   std::size_t points_max, const Eigen::Isometry3d& pose,
                                   double reach_m, const RunPieces& run) {
  const std::size_t step = std::max<std::size_t>(1, (reading.size() + points_max - 1) / points_max);
  const std::size_t count = (reading.size() + step - 1) / step;
  const Eigen::Isometry3f pose_f = pose.cast<float>();
  const Points& planes = reference.points.points_m();
  std::vector<std::vector<PlanePair>> found((count + kPieceSize - 1) / kPieceSize);
  in_pieces(run, count, [&](std::size_t begin, std::size_t end) {
    auto& pairs = found[begin / kPieceSize];
    pairs.reserve(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f point = pose_f * reading[i * step];
      Neighbour near;
      if (!reference.points.nearest(point, static_cast<float>(reach_m), near)) continue;
      const Eigen::Vector3f& normal = reference.normals[near.index];
      if (normal.isZero()) continue;
      pairs.push_back({point.cast<double>(), normal.cast<double>(),
                       static_cast<double>(normal.dot(point - planes[near.index]))});
    }
  });
  std::vector<PlanePair> all;
  all.reserve(count);
  for (const auto& pairs : found) all.insert(all.end(), pairs.begin(), pairs.end());
  return all;
}

PlaneEquations plane_equations(const std::vector<PlanePair>& pairs,
                               const RegistrationConfig& config, const RunPieces& run) {
  PlaneEquations equations;
  if (pairs.empty()) return equations;
  const auto count = static_cast<double>(pairs.size());
  const auto moments =
      sum_pieces<Moments>(run, pairs.size(), [&](std::size_t begin, std::size_t end) {
        Moments part;
        for (std::size_t i = begin; i < end; ++i) {
          part.sum += pairs[i].point_m;
          part.squares += pairs[i].point_m.squaredNorm();
        }
        return part;
      });
  equations.centre_m = moments.sum / count;
  equations.radius_m =
      std::sqrt(std::max(1e-6, moments.squares / count - equations.centre_m.squaredNorm()));
  equations.sigma_m = robust_sigma(pairs, config.noise_floor_m);
  const double scale2 = std::pow(config.kernel_scale * equations.sigma_m, 2);
  const auto normal =
      sum_pieces<Normal>(run, pairs.size(), [&](std::size_t begin, std::size_t end) {
        Normal part;
        for (std::size_t i = begin; i < end; ++i) {
          const PlanePair& pair = pairs[i];
          Vector6d row;
          row << pair.normal,
              (pair.point_m - equations.centre_m).cross(pair.normal) / equations.radius_m;
          const double r2 = pair.residual_m * pair.residual_m;
          const double weight = std::pow(scale2 / (scale2 + r2), 2);
          part.H.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
          part.g += weight * pair.residual_m * row;
          part.weight += weight;
          if (r2 > scale2) continue;
          part.kept_squares += r2;
          ++part.kept;
        }
        return part;
      });
  equations.weight = normal.weight;
  equations.H = Matrix6d(normal.H.selfadjointView<Eigen::Lower>()) / normal.weight;
  equations.g = normal.g / normal.weight;
  equations.pairs = normal.kept;
  equations.pairs_asked = pairs.size();
  equations.rms_m =
      std::sqrt(normal.kept_squares / static_cast<double>(std::max<std::size_t>(1, normal.kept)));
  return equations;
}

Vector6d plane_step(const PlaneEquations& equations, double free_below, Eigen::Isometry3d& pose) {
  const Axes<6> axes = axes_of(equations.H);
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    // Strengths are in thirds: see HeldAxis.
    if (3 * axes.values[i] < free_below) continue;
    const Vector6d direction = axes.vectors.col(i);
    step -= direction * (direction.dot(equations.g) / axes.values[i]);
  }
  step.tail<3>() /= equations.radius_m;
  const Eigen::Vector3d arm = pose.translation() - equations.centre_m;
  const Eigen::Matrix3d R = rotation_of(step.tail<3>());
  Eigen::Isometry3d moved_pose;
  moved_pose.linear() = Eigen::Quaterniond(R * pose.linear()).normalized().matrix();
  moved_pose.translation() = equations.centre_m + R * arm + step.head<3>();
  pose = moved_pose;
  return step;
}

}  // namespace nav
