// What motions and measurements do to the covariance of the localizer's errors, by products of
// whole matrices: the oracle of nav/error_covariance.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "nav/error_covariance.hpp"

namespace support {

using nav::ErrorMatrix;

// Sizes known only when it runs, as the sums of these products were first written.
using Tall = Eigen::Matrix<double, nav::kErrors, Eigen::Dynamic, 0, nav::kErrors, 3>;
using Few = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
using FewSquared = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

inline void carry_whole(ErrorMatrix& P, const nav::Motion& motion) {
  Eigen::Matrix<double, 3, nav::kErrors> step_by, turn_by;
  step_by.setZero();
  turn_by.setZero();
  step_by.middleCols<8>(nav::kMotionFrom) = motion.topRows<3>();
  turn_by.middleCols<8>(nav::kMotionFrom) = motion.bottomRows<3>();
  ErrorMatrix FP = P;
  FP.middleRows<3>(0) += step_by.lazyProduct(P);
  FP.middleRows<3>(3) += turn_by.lazyProduct(P);
  P = FP;
  P.middleCols<3>(0) += FP.lazyProduct(step_by.transpose());
  P.middleCols<3>(3) += FP.lazyProduct(turn_by.transpose());
}

inline FewSquared whole_inverse(const FewSquared& S) {
  Eigen::Matrix3d full = Eigen::Matrix3d::Identity();
  full.topLeftCorner(S.rows(), S.cols()) = S;
  return full.inverse().topLeftCorner(S.rows(), S.cols());
}

struct Whole {
  Tall Ht;
  Few innovation;
  FewSquared R;

  double squared(const ErrorMatrix& P) const {
    const FewSquared S = Ht.transpose().lazyProduct(Tall(P.lazyProduct(Ht))) + R;
    return innovation.dot(Few(whole_inverse(S).lazyProduct(innovation)));
  }
  nav::Errors learn(ErrorMatrix& P) {
    const Tall PHt = P.lazyProduct(Ht);
    const FewSquared S = Ht.transpose().lazyProduct(PHt) + R;
    S_inverse = whole_inverse(S);
    K = PHt.lazyProduct(S_inverse);
    ErrorMatrix A = P;
    A -= K.lazyProduct(PHt.transpose());
    const Tall B = K.lazyProduct(R) - Tall(A.lazyProduct(Ht));
    A += B.lazyProduct(K.transpose());
    P = (A + A.transpose()) / 2;
    return K.lazyProduct(innovation);
  }
  FewSquared S_inverse;
  Tall K;
};

}  // namespace support
