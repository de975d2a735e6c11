// Marks with known answers, and marks that lie.
#include "nav/registration/marks.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "nav/linear.hpp"
#include "tests/support/scans.hpp"

namespace {

using nav::MarkPair;

const Eigen::Isometry3d kTruth = scans::pose(12, -7, 0.4, 130, 2, -3);

std::vector<MarkPair> marks(int count, double sigma_m, std::uint64_t seed) {
  support::Dice dice(seed);
  std::vector<MarkPair> all;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d at(dice.uniform(-20, 20), dice.uniform(-20, 20), dice.uniform(0, 4));
    const Eigen::Vector3d error(dice.gauss(sigma_m), dice.gauss(sigma_m), dice.gauss(sigma_m));
    all.push_back({"M" + std::to_string(i + 1), kTruth * at + error, at});
  }
  return all;
}

TEST(Marks, ThreeExactMarksGiveTheExactPose) {
  const auto fit = nav::fit_marks(marks(3, 0, 1)).value();
  const auto off = nav::motion_between(kTruth, fit.T_reference_reading);
  EXPECT_LT(off.norm(), 1e-9);
  EXPECT_LT(fit.rms_m, 1e-9);
}

TEST(Marks, MarksInOnePlaneAreNotMirrored) {
  auto flat = marks(5, 0, 2);
  for (auto& mark : flat) {
    mark.reading_m.z() = 1;
    mark.reference_m = kTruth * mark.reading_m;
  }
  const auto fit = nav::fit_marks(flat).value();
  EXPECT_LT(nav::motion_between(kTruth, fit.T_reference_reading).norm(), 1e-9);
}

TEST(Marks, SwappedMarksAreNamedAndLeftOut) {
  auto swapped = marks(7, 0.003, 3);
  std::swap(swapped[2].reference_m, swapped[5].reference_m);
  const auto fit = nav::fit_marks(swapped).value();
  for (std::size_t i = 0; i < swapped.size(); ++i) {
    EXPECT_EQ(fit.residuals[i].used, i != 2 && i != 5) << fit.residuals[i].name;
    EXPECT_EQ(fit.residuals[i].residual_m > 0.03, i == 2 || i == 5);
  }
  EXPECT_LT(nav::motion_between(kTruth, fit.T_reference_reading).head<3>().norm(), 0.02);
}

TEST(Marks, CovarianceCoversTheErrorOver500Fits) {
  double chi2 = 0;
  for (int run = 0; run < 500; ++run) {
    const auto fit = nav::fit_marks(marks(6, 0.005, 10 + static_cast<std::uint64_t>(run))).value();
    const auto error = nav::motion_between(kTruth, fit.T_reference_reading);
    chi2 += error.dot(nav::inverse_of(fit.covariance) * error) / 500;
  }
  EXPECT_NEAR(chi2, 6, 0.6);
}

TEST(Marks, SaysWhatIsWrongAndWhatToDo) {
  const auto error = [](std::vector<MarkPair> some) { return nav::fit_marks(some).error().what; };
  EXPECT_EQ(error(marks(2, 0, 4)),
            "2 common marks, three are needed: add marks that both scans see");
  auto line = marks(4, 0, 5);
  for (std::size_t i = 0; i < line.size(); ++i) {
    line[i].reading_m = Eigen::Vector3d(static_cast<double>(i), 2.0 * static_cast<double>(i), 1);
    line[i].reference_m = kTruth * line[i].reading_m;
  }
  EXPECT_NE(error(line).find("lie on one line"), std::string::npos);
  auto odd = marks(6, 0, 6);
  for (std::size_t i = 0; i < 3; ++i) odd[i].reference_m.x() += static_cast<double>(i) + 1;
  EXPECT_EQ(error(odd),
            "only 3 of 6 marks agree, not more than half; at odds: M1, M2, M3: check "
            "their names and coordinates");
  auto broken = marks(4, 0, 7);
  broken[1].reading_m.y() = std::nan("");
  EXPECT_NE(error(broken).find("mark M2 has no finite coordinates"), std::string::npos);
  EXPECT_NE(error(marks(61, 0, 8)).find("more than 60"), std::string::npos);
}

}  // namespace
