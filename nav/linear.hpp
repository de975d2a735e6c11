// Decompositions of small matrices behind plain functions: Eigen's templates for them are compiled
// once here, and not wherever one is needed.
#pragma once

#include <Eigen/Core>

namespace nav {

// Of a symmetric matrix: eigenvalues in ascending order, unit eigenvectors as columns.
template <int N>
struct Axes {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};
Axes<2> axes_of(const Eigen::Matrix2d& symmetric);
Axes<3> axes_of(const Eigen::Matrix3d& symmetric);
Axes<6> axes_of(const Eigen::Matrix<double, 6, 6>& symmetric);

// Of a regular matrix; of another the result is of no use, and may not be finite.
Eigen::Matrix<double, 6, 6> inverse_of(const Eigen::Matrix<double, 6, 6>& regular);

}  // namespace nav
