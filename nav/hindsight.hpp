// What is learnt later about earlier errors: the way back through a Kalman filter's events, by the
// modified Bryson-Frazier recursion, which inverts no covariance (G. J. Bierman, Fixed interval
// smoothing with discrete measurements, Int. J. Control 18, 1973).
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

namespace nav {

inline constexpr int kErrors = 14;  // Of the localizer's filter.
using Errors = Eigen::Matrix<double, kErrors, 1>;
using ErrorMatrix = Eigen::Matrix<double, kErrors, kErrors>;

// What one event, or several, did to the filter's errors, in the order in which they happened.
class ErrorTape {
 public:
  using Tall = Eigen::Matrix<double, kErrors, Eigen::Dynamic, 0, kErrors, 3>;
  using Numbers = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

  // One to three numbers: H transposed, innovation, inverse of its covariance, gain.
  struct Measured {
    Tall Ht;
    Numbers innovation;
    Square S_inverse;
    Tall K;
  };

  void clear() { steps_.clear(); }
  // error after = F * error before, noise apart.
  void moved(const ErrorMatrix& F);
  // One error fades to this share.
  void forgot(int error, double kept);
  void measured(const Tall& Ht, const Numbers& innovation, const Square& S_inverse, const Tall& K);

 private:
  friend class Hindsight;
  std::vector<std::variant<ErrorMatrix, Measured>> steps_;
};

// What all that came after a moment says of the errors at that moment. Begins knowing nothing, at
// the end of the log; takes the events' tapes from the last to the first.
class Hindsight {
 public:
  void before(const ErrorTape& tape);
  // Smoothed error: -P * pull; smoothed covariance: P - P * known * P.
  const Errors& pull() const { return pull_; }
  const ErrorMatrix& known() const { return known_; }

 private:
  Errors pull_ = Errors::Zero();
  ErrorMatrix known_ = ErrorMatrix::Zero();
};

}  // namespace nav
