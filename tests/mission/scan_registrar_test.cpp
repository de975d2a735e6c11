#include "mission/scan_registrar.hpp"

#include <gmock/gmock.h>

#include <numbers>

#include "mission/site_model.hpp"
#include "tests/support/scans.hpp"

namespace mission {
namespace {

using scans::kDeg;
using testing::HasSubstr;

constexpr double kHeightM = 1.5;

// In a made-up site, from where the truth is known.
class Place {
 public:
  explicit Place(std::vector<scans::Panel> panels) : panels_(std::move(panels)) {
    scanner_.height_m = kHeightM;
    scanner_.range_min_m = 0.5;
  }

  ScanRegistrar registrar(const RegisterConfig& config = {}, int threads = 1) const {
    return {config, scanner_, threads};
  }
  std::vector<Eigen::Vector3f> scan(const hal::Pose2& truth, std::uint64_t seed) const {
    return scans::seen_from(panels_, scanner_pose(truth, 0, kHeightM), 1, 0.01, seed);
  }
  // Takes a scan that is believed to be `off`, and lays it over those before it.
  ScanAttempt add(ScanRegistrar& registrar, int number, const hal::Pose2& truth,
                  const hal::Pose2& off, double sigma_m = 0.1, double sigma_deg = 1) const {
    const ScanBelief belief = believed(truth, off, sigma_m, sigma_deg);
    registrar.take(scan(truth, static_cast<std::uint64_t>(number)));
    const ScanAttempt attempt = registrar.attempt(belief, false);
    registrar.keep(number, belief, attempt);
    return attempt;
  }
  static ScanBelief believed(const hal::Pose2& truth, const hal::Pose2& off, double sigma_m,
                             double sigma_deg) {
    ScanBelief belief;
    belief.pose = {truth.position_m + off.position_m, truth.heading_rad + off.heading_rad};
    belief.covariance =
        Eigen::Vector3d(sigma_m, sigma_m, sigma_deg * kDeg).cwiseAbs2().asDiagonal();
    belief.alone = belief.pose;
    belief.alone_covariance = belief.covariance;
    return belief;
  }

 private:
  std::vector<scans::Panel> panels_;
  ScannerConfig scanner_;
};

hal::Pose2 at(double x_m, double y_m, double heading_deg) {
  return {{x_m, y_m}, heading_deg * kDeg};
}
double off_m(const hal::Pose2& a, const hal::Pose2& b) {
  return (a.position_m - b.position_m).norm();
}
double off_deg(const hal::Pose2& a, const hal::Pose2& b) {
  return std::abs(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi)) / kDeg;
}

TEST(ScanRegistrar, FindsWhereAScanReallyStood) {
  const Place yard(scans::yard());
  ScanRegistrar registrar = yard.registrar();
  const ScanAttempt first = yard.add(registrar, 1, at(-4, -2, 20), at(0, 0, 0), 0.005, 0.02);
  EXPECT_EQ(first.fit.verdict, ScanVerdict::alone);
  const hal::Pose2 truth = at(1, 2, -35);
  const ScanAttempt second = yard.add(registrar, 2, truth, at(0.2, -0.15, 1.5), 0.2, 1.5);
  EXPECT_EQ(second.fit.verdict, ScanVerdict::accepted) << second.fit.reason;
  EXPECT_EQ(second.fit.references, 1);
  EXPECT_LT(off_m(second.pose, truth), 0.015);
  EXPECT_LT(off_deg(second.pose, truth), 0.06);
  EXPECT_NEAR(second.fit.moved_m, 0.25, 0.02);
  EXPECT_GT(second.fit.overlap, 0.5);
  EXPECT_GT(second.fit.strength_shift, 0.02);
  EXPECT_LT(second.fit.rms_m, 0.03);
  // It claims to know better than it was told, and no more than it can.
  EXPECT_LT(second.covariance(0, 0), 0.02 * 0.02);
  EXPECT_GT(second.covariance(0, 0), 0.004 * 0.004);
}

// A corridor says nothing of the way along it.
TEST(ScanRegistrar, CorrectsOnlyWhatTheWallsHold) {
  const Place corridor(scans::corridor());
  ScanRegistrar registrar = corridor.registrar();
  corridor.add(registrar, 1, at(0, 0, 0), at(0, 0, 0), 0.005, 0.02);
  const hal::Pose2 truth = at(2, 0.3, 2);
  const ScanAttempt second = corridor.add(registrar, 2, truth, at(0.15, -0.2, 1), 0.2, 1);
  EXPECT_EQ(second.fit.verdict, ScanVerdict::held_in_part) << second.fit.reason;
  EXPECT_EQ(second.fit.reason, "free along x");
  EXPECT_NEAR(second.pose.position_m.x(), 2.15, 0.02);  // As believed.
  EXPECT_NEAR(second.pose.position_m.y(), 0.3, 0.01);   // As it is.
  EXPECT_LT(off_deg(second.pose, truth), 0.1);
  // Nor is the localizer told anything of it.
  EXPECT_GT(second.measured_covariance(0, 0), 5 * 5);
  EXPECT_LT(second.measured_covariance(1, 1), 0.02 * 0.02);
  EXPECT_NEAR(second.covariance(0, 0), 0.2 * 0.2, 0.01);
}

TEST(ScanRegistrar, RefusesWhatTheLocalizerIsSureAgainst) {
  const Place yard(scans::yard());
  ScanRegistrar registrar = yard.registrar();
  yard.add(registrar, 1, at(-4, -2, 20), at(0, 0, 0), 0.005, 0.02);
  const ScanAttempt second = yard.add(registrar, 2, at(1, 2, 0), at(0, 0.5, 0), 0.02, 0.1);
  EXPECT_EQ(second.fit.verdict, ScanVerdict::refused);
  EXPECT_THAT(second.fit.reason, HasSubstr("beside the localizer"));
  EXPECT_GT(second.fit.chi2, 100);
  EXPECT_LT(off_m(second.pose, at(1, 2.5, 0)), 1e-9);  // As believed.
  EXPECT_EQ(registrar.in_hand(), 1U);                  // Nothing is laid over it.
}

TEST(ScanRegistrar, RefusesAScanOfAnotherPlace) {
  const Place yard(scans::yard());
  std::vector<scans::Panel> turned = scans::yard();
  for (scans::Panel& panel : turned)  // The same ground and walls of another yard.
    for (Eigen::Vector3d* v : {&panel.corner, &panel.u, &panel.v})
      *v = Eigen::AngleAxisd(50 * kDeg, Eigen::Vector3d::UnitZ()) * *v * 0.8;
  ScanRegistrar registrar = yard.registrar();
  yard.add(registrar, 1, at(-4, -2, 20), at(0, 0, 0));
  const ScanAttempt other = Place(turned).add(registrar, 2, at(1, 2, 0), at(0, 0, 0));
  EXPECT_EQ(other.fit.verdict, ScanVerdict::refused);
  EXPECT_FALSE(other.fit.reason.empty());
}

TEST(ScanRegistrar, SaysThatAScanStandsAlone) {
  const Place yard(scans::yard());
  ScanRegistrar registrar = yard.registrar();
  yard.add(registrar, 1, at(-4, -2, 20), at(0, 0, 0));
  const ScanAttempt far = yard.add(registrar, 2, at(1, 2, 0), at(200, 0, 0));
  EXPECT_EQ(far.fit.verdict, ScanVerdict::alone);
  EXPECT_TRUE(far.pairs.empty());
  EXPECT_LT(off_m(far.pose, at(201, 2, 0)), 1e-9);
}

TEST(ScanRegistrar, ATourThatClosesBringsAllPairsToAgree) {
  const Place yard(scans::yard());
  RegisterConfig config;
  config.references_max = 1;
  ScanRegistrar registrar = yard.registrar(config);
  const std::vector<hal::Pose2> truth{at(-10, -3, 0), at(-3, 8, 60), at(3, -6, -80), at(12, 3, 170),
                                      at(14, -10, 120)};
  for (std::size_t i = 0; i < truth.size(); ++i)
    yard.add(registrar, static_cast<int>(i) + 1, truth[i],
             i == 0 ? at(0, 0, 0) : at(0.06, -0.05, 0.4), i == 0 ? 0.005 : 0.08,
             i == 0 ? 0.02 : 0.5);
  const TourFit tour = registrar.close();
  EXPECT_TRUE(tour.settled);
  EXPECT_GE(tour.pairs_new, 2);
  EXPECT_GE(tour.pairs, static_cast<int>(truth.size()) - 1 + tour.pairs_new);
  ASSERT_EQ(tour.scans.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(tour.scans[i].number, static_cast<int>(i) + 1);
    EXPECT_LT(off_m(tour.scans[i].pose, truth[i]), 0.02) << i;
    EXPECT_LT(off_deg(tour.scans[i].pose, truth[i]), 0.08) << i;
    EXPECT_LT(tour.scans[i].covariance(0, 0), 0.02 * 0.02) << i;
  }
  // Nothing is left to be registered, and nothing moves any more.
  const TourFit again = registrar.close();
  EXPECT_EQ(again.pairs_new, 0);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT(off_m(again.scans[i].pose, tour.scans[i].pose), 1e-6);
}

TEST(ScanRegistrar, KeepsNoMoreScansInHandThanAsked) {
  const Place yard(scans::yard());
  RegisterConfig config;
  config.in_hand_max = 2;
  ScanRegistrar registrar = yard.registrar(config);
  for (int i = 0; i < 4; ++i) {
    const ScanAttempt attempt = yard.add(registrar, i + 1, at(2 * i - 4, 0, 0), at(0, 0, 0));
    EXPECT_LE(attempt.pairs.size(), 2U);
    EXPECT_EQ(registrar.in_hand(), std::min<std::size_t>(2, static_cast<std::size_t>(i) + 1));
  }
  EXPECT_EQ(registrar.close().scans.size(), 4U);  // Those that went still have poses.
}

TEST(ScanRegistrar, AnyNumberOfThreadsGivesTheSame) {
  const Place yard(scans::yard());
  std::vector<ScanAttempt> attempts;
  for (const int threads : {1, 3}) {
    ScanRegistrar registrar = yard.registrar({}, threads);
    yard.add(registrar, 1, at(-4, -2, 20), at(0, 0, 0));
    attempts.push_back(yard.add(registrar, 2, at(1, 2, 0), at(0.1, 0.1, 0.5)));
  }
  EXPECT_EQ(attempts[0].pose.position_m, attempts[1].pose.position_m);
  EXPECT_EQ(attempts[0].pose.heading_rad, attempts[1].pose.heading_rad);
  EXPECT_EQ(attempts[0].measured_covariance, attempts[1].measured_covariance);
}

}  // namespace
}  // namespace mission
