// Fiducial marks: the pose of a scan from marks that are known, by the closed form of Umeyama
// without scale (an SVD). Wrong correspondences are found and left out.
#pragma once

#include <Eigen/Geometry>
#include <boost/system/result.hpp>
#include <string>
#include <vector>

#include "nav/registration/rigid.hpp"

namespace nav {

struct MarkPair {
  std::string name;
  Eigen::Vector3d reference_m, reading_m;  // The same mark in both frames.
};

struct MarkConfig {
  double sigma_m = 0.005;        // Of a mark's coordinate, both sides together.
  double residual_max_m = 0.03;  // Farther off is a wrong correspondence.
};

struct MarkResidual {
  std::string name;
  double residual_m{};
  bool used{};
};

struct MarkFit {
  Eigen::Isometry3d T_reference_reading = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();  // Of motions of that pose: see rigid.hpp.
  double rms_m{};                          // Of the marks used.
  std::vector<MarkResidual> residuals;     // In the order of the marks, left out ones too.
};

// What is wrong with the marks, and what to do.
struct MarkError {
  std::string what;
};
template <class T>
using MarkResult = boost::system::result<T, MarkError>;
[[noreturn]] void throw_exception_from_error(const MarkError& error,
                                             const boost::source_location& where);

// Needs three marks that agree and do not lie on one line; more than half of all must agree, so of
// three marks none may be wrong. At most 60 marks. Every triple is tried, so the answer does not
// depend on chance.
MarkResult<MarkFit> fit_marks(const std::vector<MarkPair>& marks, const MarkConfig& config = {});

// The rigid motion that brings the readings nearest to the references, by least squares. At least
// three, not on one line.
Eigen::Isometry3d fit_rigid(const std::vector<MarkPair>& marks);

}  // namespace nav
