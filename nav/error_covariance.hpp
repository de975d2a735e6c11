// The covariance P of the localizer's errors, through motions and measurements: the plain products
// of matrices bit for bit (but for the sign of zeros), without the terms that are 0 because a
// motion or a measurement has nothing to do with most errors. P must be finite.
#pragma once

#include <Eigen/Core>

#include "nav/hindsight.hpp"

namespace nav {

template <int N>
using ErrorColumns = Eigen::Matrix<double, kErrors, N>;
template <int N>
using Numbers = Eigen::Matrix<double, N, 1>;
template <int N>
using NumbersSquared = Eigen::Matrix<double, N, N>;

// F - I of a motion where it may be other than 0: how the errors of position (W) and attitude, the
// first six, then depend on those from kMotionFrom on: attitude, gyro bias, slip of each side. The
// attitude does not depend on the attitude before.
inline constexpr int kMotionFrom = 3;
using Motion = Eigen::Matrix<double, 6, 8>;

// P = F P F'. tilts: the biases of the first two axes of the gyro have a part in it.
void carry(ErrorMatrix& P, const Motion& motion, bool tilts);

// One to three numbers that were measured: how they depend on the errors (H transposed), by how
// much they differ from what was expected, and their own covariance.
template <int N>
struct Measurement {
  ErrorColumns<N> Ht;
  Numbers<N> innovation;
  NumbersSquared<N> R;
};

// What the errors have to do with the numbers, and how far these were expected to be off by them:
// P H', H P H'.
template <int N>
struct Expected {
  ErrorColumns<N> PHt;
  NumbersSquared<N> HPHt;
};
template <int N>
Expected<N> expected(const ErrorMatrix& P, const ErrorColumns<N>& Ht);

// Squared innovation, normalised by H P H' + R.
template <int N>
double squared(const Measurement<N>& m, const Expected<N>& expected);

// The inverse of H P H' + R, the gain, and the error that is most likely after all.
template <int N>
struct Learnt {
  NumbersSquared<N> S_inverse;
  ErrorColumns<N> K;
  Errors error;
};
// P = (I - K H) P (I - K H)' + K R K': Joseph's form stays symmetric and positive.
template <int N>
Learnt<N> learn(ErrorMatrix& P, const Measurement<N>& m, const Expected<N>& expected);

}  // namespace nav
