#include "nav/linear.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace nav {
namespace {

// One type for all sizes, without the heap.
using UpTo6 = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

template <int N>
Axes<N> axes(const UpTo6& symmetric) {
  const Eigen::SelfAdjointEigenSolver<UpTo6> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace

Axes<2> axes_of(const Eigen::Matrix2d& symmetric) {
  return axes<2>(symmetric);
}
Axes<3> axes_of(const Eigen::Matrix3d& symmetric) {
  return axes<3>(symmetric);
}
Axes<6> axes_of(const Eigen::Matrix<double, 6, 6>& symmetric) {
  return axes<6>(symmetric);
}

Eigen::Matrix<double, 6, 6> inverse_of(const Eigen::Matrix<double, 6, 6>& regular) {
  return Eigen::PartialPivLU<UpTo6>(regular).inverse();
}

}  // namespace nav
