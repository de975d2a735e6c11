// Against the products of whole matrices, bit for bit.
#include "nav/error_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/support/random_site.hpp"
#include "tests/support/whole_covariance.hpp"

namespace {

using nav::ErrorMatrix;

// The sign of a zero apart.
template <class A, class B>
bool same_bits(const A& a, const B& b) {
  const Eigen::MatrixXd one = a.array() + 0.0, other = b.array() + 0.0;
  return one.size() == other.size() &&
         std::memcmp(one.data(), other.data(),
                     static_cast<std::size_t>(one.size()) * sizeof(double)) == 0;
}

class ErrorDice {
 public:
  explicit ErrorDice(std::uint64_t seed) : dice_(seed) {}
  double any() { return dice_.gauss(1) * std::pow(10, dice_.uniform(-4, 2)); }
  template <class M>
  M matrix() {
    return M::NullaryExpr([&] { return any(); });
  }
  bool yes() { return dice_.uniform(0, 1) < 0.5; }
  // nav::Errors that are known, and have to do with no other, among those that are not.
  ErrorMatrix covariance() {
    const auto root = matrix<ErrorMatrix>();
    ErrorMatrix P = root * root.transpose();
    for (int i = 0; i < nav::kErrors; ++i)
      if (dice_.uniform(0, 1) < 0.1) P.row(i).setZero(), P.col(i).setZero();
    return P;
  }

 private:
  support::Dice dice_;
};

TEST(ErrorCovariance, CarriesAsWholeMatricesDo) {
  ErrorDice dice(1);
  for (int i = 0; i < 2000; ++i) {
    const bool tilts = i % 2 == 0;
    auto motion = dice.matrix<nav::Motion>();
    motion.bottomLeftCorner<3, 3>().setZero();
    motion.diagonal().head<3>().setZero();
    if (!tilts) motion.middleCols<2>(3).setZero();
    const ErrorMatrix before = dice.covariance();
    ErrorMatrix P = before, expected = before;
    nav::carry(P, motion, tilts);
    support::carry_whole(expected, motion);
    ASSERT_TRUE(same_bits(P, expected)) << (P - expected);
  }
}

template <int N>
void learns_as_whole_matrices_do() {
  ErrorDice dice(N);
  for (int i = 0; i < 2000; ++i) {
    nav::Measurement<N> m{dice.matrix<nav::ErrorColumns<N>>(), dice.matrix<nav::Numbers<N>>(), {}};
    for (int row = 0; row < nav::kErrors; ++row)
      if (dice.yes()) m.Ht.row(row).setZero();
    const auto root = dice.matrix<nav::NumbersSquared<N>>();
    m.R = root * root.transpose();
    const ErrorMatrix before = dice.covariance();
    ErrorMatrix P = before, expected = before;
    support::Whole whole{m.Ht, m.innovation, m.R, {}, {}};
    const auto is = nav::expected<N>(P, m.Ht);
    const double squared = nav::squared(m, is);
    ASSERT_EQ(squared, whole.squared(expected));
    const auto learnt = nav::learn(P, m, is);
    const nav::Errors error = whole.learn(expected);
    ASSERT_TRUE(same_bits(learnt.S_inverse, whole.S_inverse));
    ASSERT_TRUE(same_bits(learnt.K, whole.K));
    ASSERT_TRUE(same_bits(learnt.error, error));
    ASSERT_TRUE(same_bits(P, expected)) << (P - expected);
  }
}

TEST(ErrorCovariance, LearnsOneNumberAsWholeMatricesDo) {
  learns_as_whole_matrices_do<1>();
}
TEST(ErrorCovariance, LearnsTwoNumbersAsWholeMatricesDo) {
  learns_as_whole_matrices_do<2>();
}
TEST(ErrorCovariance, LearnsThreeNumbersAsWholeMatricesDo) {
  learns_as_whole_matrices_do<3>();
}

}  // namespace
