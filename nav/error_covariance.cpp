#include "nav/error_covariance.hpp"

#include <Eigen/LU>

namespace nav {
namespace {

// Sums are added up in the order of Eigen's products of whole matrices: of three rows two go at
// once, one term after the other, and the third by halves of halves of the terms.

template <bool kTilts>
void carry_rows(ErrorMatrix& P, const Motion& motion) {
  Motion pairs;  // Rows that are added up alike, beside each other.
  pairs << motion.row(0), motion.row(1), motion.row(3), motion.row(4), motion.row(2), motion.row(5);
  for (int column = 0; column < kErrors; ++column) {
    const auto part = [&](int row, int k) {
      return pairs.block<2, 1>(row, k) * P(kMotionFrom + k, column);
    };
    Eigen::Vector2d steps, turns, thirds;
    if constexpr (kTilts) {
      steps = part(0, 0) + part(0, 1) + part(0, 2) + part(0, 3) + part(0, 4) + part(0, 5) +
              part(0, 6) + part(0, 7);
      turns = part(2, 3) + part(2, 4) + part(2, 5) + part(2, 6) + part(2, 7);
      thirds = ((part(4, 0) + part(4, 1)) + (part(4, 2) + part(4, 3))) +
               ((part(4, 4) + (part(4, 5) + part(4, 6))) + part(4, 7));
    } else {
      steps = part(0, 0) + part(0, 1) + part(0, 2) + part(0, 5) + part(0, 6) + part(0, 7);
      turns = part(2, 5) + part(2, 6) + part(2, 7);
      thirds = ((part(4, 0) + part(4, 1)) + part(4, 2)) + ((part(4, 5) + part(4, 6)) + part(4, 7));
    }
    P.col(column).head<2>() += steps;
    P(2, column) += thirds[0];
    P.col(column).segment<2>(3) += turns;
    P(5, column) += thirds[1];
  }
}

// The positions' columns first: they need the attitudes' as they were.
template <bool kTilts>
void carry_columns(ErrorMatrix& P, const Motion& motion) {
  for (int row = 0; row < 6; ++row) {
    const auto part = [&](int k) { return P.col(kMotionFrom + k) * motion(row, k); };
    Errors sum;
    if (row < 3 && kTilts)
      sum = part(0) + part(1) + part(2) + part(3) + part(4) + part(5) + part(6) + part(7);
    else if (row < 3)
      sum = part(0) + part(1) + part(2) + part(5) + part(6) + part(7);
    else if (kTilts)
      sum = part(3) + part(4) + part(5) + part(6) + part(7);
    else
      sum = part(5) + part(6) + part(7);
    P.col(row) += sum;
  }
}

// P H' for an H that has 0 for most errors.
template <int N>
ErrorColumns<N> times(const ErrorMatrix& P, const ErrorColumns<N>& Ht) {
  ErrorColumns<N> product = ErrorColumns<N>::Zero();
  for (int k = 0; k < kErrors; ++k) {
    if ((Ht.row(k).array() == 0).all()) continue;
    for (int i = 0; i < N; ++i) product.col(i) += P.col(k) * Ht(k, i);
  }
  return product;
}

// A B, B square.
template <int N>
ErrorColumns<N> mixed(const ErrorColumns<N>& A, const NumbersSquared<N>& B) {
  ErrorColumns<N> product;
  for (int i = 0; i < N; ++i) {
    product.col(i) = A.col(0) * B(0, i);
    for (int k = 1; k < N; ++k) product.col(i) += A.col(k) * B(k, i);
  }
  return product;
}

// A b.
template <int N, class Vector>
Errors combined(const ErrorColumns<N>& A, const Vector& b) {
  Errors sum = A.col(0) * b[0];
  for (int i = 1; i < N; ++i) sum += A.col(i) * b[i];
  return sum;
}

template <int N>
NumbersSquared<N> inverse_spread(const NumbersSquared<N>& S) {
  Eigen::Matrix3d full = Eigen::Matrix3d::Identity();
  full.template topLeftCorner<N, N>() = S;
  return full.inverse().template topLeftCorner<N, N>();
}

}  // namespace

void carry(ErrorMatrix& P, const Motion& motion, bool tilts) {
  if (tilts) {
    carry_rows<true>(P, motion);
    carry_columns<true>(P, motion);
  } else {
    carry_rows<false>(P, motion);
    carry_columns<false>(P, motion);
  }
}

template <int N>
Expected<N> expected(const ErrorMatrix& P, const ErrorColumns<N>& Ht) {
  Expected<N> is{times<N>(P, Ht), {}};
  is.HPHt = Ht.transpose().lazyProduct(is.PHt);
  return is;
}

template <int N>
double squared(const Measurement<N>& m, const Expected<N>& is) {
  const NumbersSquared<N> S_inverse = inverse_spread<N>(is.HPHt + m.R);
  double sum = 0;
  for (int i = 0; i < N; ++i) {
    double part = S_inverse(i, 0) * m.innovation[0];
    for (int k = 1; k < N; ++k) part += S_inverse(i, k) * m.innovation[k];
    sum += m.innovation[i] * part;
  }
  return sum;
}

template <int N>
Learnt<N> learn(ErrorMatrix& P, const Measurement<N>& m, const Expected<N>& is) {
  Learnt<N> learnt{inverse_spread<N>(is.HPHt + m.R), {}, {}};
  const ErrorColumns<N>& K = learnt.K = mixed<N>(is.PHt, learnt.S_inverse);
  learnt.error = combined<N>(K, m.innovation);
  // With the products that are small: P - K (P H')' is (I - K H) P.
  for (int column = 0; column < kErrors; ++column)
    P.col(column) -= combined<N>(K, is.PHt.row(column));
  const ErrorColumns<N> B = mixed<N>(K, m.R) - times<N>(P, m.Ht);
  for (int column = 0; column < kErrors; ++column) P.col(column) += combined<N>(B, K.row(column));
  for (int column = 0; column < kErrors; ++column)
    for (int row = 0; row < column; ++row)
      P(row, column) = P(column, row) = (P(row, column) + P(column, row)) / 2;
  return learnt;
}

template Expected<1> expected(const ErrorMatrix&, const ErrorColumns<1>&);
template Expected<2> expected(const ErrorMatrix&, const ErrorColumns<2>&);
template Expected<3> expected(const ErrorMatrix&, const ErrorColumns<3>&);
template double squared(const Measurement<1>&, const Expected<1>&);
template double squared(const Measurement<2>&, const Expected<2>&);
template double squared(const Measurement<3>&, const Expected<3>&);
template Learnt<1> learn(ErrorMatrix&, const Measurement<1>&, const Expected<1>&);
template Learnt<2> learn(ErrorMatrix&, const Measurement<2>&, const Expected<2>&);
template Learnt<3> learn(ErrorMatrix&, const Measurement<3>&, const Expected<3>&);

}  // namespace nav
