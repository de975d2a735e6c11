#include "nav/hindsight.hpp"

namespace nav {

void ErrorTape::moved(const ErrorMatrix& F) {
  steps_.emplace_back(F);
}

void ErrorTape::forgot(int error, double kept) {
  if (steps_.empty() || !std::holds_alternative<ErrorMatrix>(steps_.back()))
    steps_.emplace_back(ErrorMatrix(ErrorMatrix::Identity()));
  std::get<ErrorMatrix>(steps_.back()).row(error) *= kept;
}

void ErrorTape::measured(const Tall& Ht, const Numbers& innovation, const Square& S_inverse,
                         const Tall& K) {
  steps_.emplace_back(Measured{Ht, innovation, S_inverse, K});
}

void Hindsight::before(const ErrorTape& tape) {
  for (auto step = tape.steps_.rbegin(); step != tape.steps_.rend(); ++step) {
    if (const auto* F = std::get_if<ErrorMatrix>(&*step)) {
      pull_ = Errors(F->transpose() * pull_);
      known_ = ErrorMatrix(F->transpose() * ErrorMatrix(known_ * *F));
      continue;
    }
    const auto& m = std::get<ErrorTape::Measured>(*step);
    // (I - K H)' from the left, (I - K H) from the right.
    pull_ -= m.Ht * ErrorTape::Numbers(m.K.transpose() * pull_ + m.S_inverse * m.innovation);
    known_ -= m.Ht * Eigen::Matrix<double, Eigen::Dynamic, kErrors, 0, 3, kErrors>(m.K.transpose() *
                                                                                   known_);
    known_ -= ErrorTape::Tall(known_ * m.K) * m.Ht.transpose();
    known_ += ErrorTape::Tall(m.Ht * m.S_inverse) * m.Ht.transpose();
    known_ = ErrorMatrix((known_ + known_.transpose()) / 2);
  }
}

}  // namespace nav
