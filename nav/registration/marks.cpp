#include "nav/registration/marks.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

#include "nav/linear.hpp"

namespace nav {
namespace {

constexpr std::size_t kMarksMax = 60;

struct Consensus {
  std::vector<bool> used;
  std::size_t count{};
  double squares{};
};

double residual_m(const MarkPair& mark, const Eigen::Isometry3d& pose) {
  return (pose * mark.reading_m - mark.reference_m).norm();
}

Consensus agreeing(const std::vector<MarkPair>& marks, const Eigen::Isometry3d& pose,
                   double within_m) {
  Consensus all{std::vector<bool>(marks.size()), 0, 0};
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const double off_m = residual_m(marks[i], pose);
    if (off_m > within_m) continue;
    all.used[i] = true;
    ++all.count;
    all.squares += off_m * off_m;
  }
  return all;
}

std::vector<MarkPair> picked(const std::vector<MarkPair>& marks, const std::vector<bool>& used) {
  std::vector<MarkPair> some;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (used[i]) some.push_back(marks[i]);
  return some;
}

// The width of the marks across the line that fits them best.
double width_m(const std::vector<MarkPair>& marks) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& mark : marks) mean += mark.reference_m / static_cast<double>(marks.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& mark : marks)
    spread += (mark.reference_m - mean) * (mark.reference_m - mean).transpose();
  return std::sqrt(spread.jacobiSvd().singularValues()[1] / static_cast<double>(marks.size()));
}

bool flat_triple(const std::vector<MarkPair>& three, const MarkConfig& config) {
  return width_m(three) < 10 * config.sigma_m;
}

// The largest set that one pose explains; of equal ones the one with the least squares.
Consensus best_consensus(const std::vector<MarkPair>& marks, const MarkConfig& config) {
  Consensus best{std::vector<bool>(marks.size()), 0, 0};
  for (std::size_t a = 0; a < marks.size(); ++a)
    for (std::size_t b = a + 1; b < marks.size(); ++b)
      for (std::size_t c = b + 1; c < marks.size(); ++c) {
        const std::vector<MarkPair> three{marks[a], marks[b], marks[c]};
        if (flat_triple(three, config)) continue;
        const Consensus found = agreeing(marks, fit_rigid(three), config.residual_max_m);
        const bool better =
            found.count > best.count || (found.count == best.count && found.squares < best.squares);
        if (found.count >= 3 && better) best = found;
      }
  return best;
}

// Of motions about the pose's own origin, from marks of config.sigma_m.
Matrix6d covariance_of(const std::vector<MarkPair>& marks, const Eigen::Isometry3d& pose,
                       double sigma_m) {
  Matrix6d H = Matrix6d::Zero();
  for (const auto& mark : marks) {
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -cross_matrix(pose.linear() * mark.reading_m);
    H += J.transpose() * J;
  }
  return sigma_m * sigma_m * inverse_of(H);
}

MarkError too_few(const std::vector<MarkPair>& marks, const Consensus& best,
                  const MarkConfig& config) {
  if (best.count == 0)
    return {
        fmt::format("no three of the {} marks agree within {:.3f} m, or they lie on one line: "
                    "check their names and coordinates, or place them farther apart",
                    marks.size(), config.residual_max_m)};
  std::string odd;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (!best.used[i]) odd += (odd.empty() ? "" : ", ") + marks[i].name;
  return {
      fmt::format("only {} of {} marks agree, not more than half; at odds: {}: check their "
                  "names and coordinates",
                  best.count, marks.size(), odd)};
}

}  // namespace

void throw_exception_from_error(const MarkError& error, const boost::source_location&) {
  throw std::runtime_error(error.what);
}

Eigen::Isometry3d fit_rigid(const std::vector<MarkPair>& marks) {
  const auto count = static_cast<double>(marks.size());
  Eigen::Vector3d reference_mean = Eigen::Vector3d::Zero(), reading_mean = reference_mean;
  for (const auto& mark : marks) {
    reference_mean += mark.reference_m / count;
    reading_mean += mark.reading_m / count;
  }
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const auto& mark : marks)
    products += (mark.reference_m - reference_mean) * (mark.reading_m - reading_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d proper = Eigen::Matrix3d::Identity();  // Marks in a plane: no mirror image.
  proper(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  Eigen::Isometry3d pose;
  pose.linear() = svd.matrixU() * proper * svd.matrixV().transpose();
  pose.translation() = reference_mean - pose.linear() * reading_mean;
  return pose;
}

MarkResult<MarkFit> fit_marks(const std::vector<MarkPair>& marks, const MarkConfig& config) {
  if (marks.size() < 3)
    return MarkError{fmt::format("{} common marks, three are needed: add marks that both scans see",
                                 marks.size())};
  if (marks.size() > kMarksMax)
    return MarkError{
        fmt::format("{} marks are more than {}: leave some out", marks.size(), kMarksMax)};
  for (const auto& mark : marks)
    if (!mark.reference_m.allFinite() || !mark.reading_m.allFinite())
      return MarkError{fmt::format("mark {} has no finite coordinates: correct it", mark.name)};
  const Consensus best = best_consensus(marks, config);
  if (2 * best.count <= marks.size() || best.count < 3) return too_few(marks, best, config);

  const auto used = picked(marks, best.used);
  MarkFit fit;
  fit.T_reference_reading = fit_rigid(used);
  fit.covariance = covariance_of(used, fit.T_reference_reading, config.sigma_m);
  double squares = 0;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const double off_m = residual_m(marks[i], fit.T_reference_reading);
    fit.residuals.push_back({marks[i].name, off_m, best.used[i]});
    if (best.used[i]) squares += off_m * off_m;
  }
  fit.rms_m = std::sqrt(squares / static_cast<double>(best.count));
  return fit;
}

}  // namespace nav
