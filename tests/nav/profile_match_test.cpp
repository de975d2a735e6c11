// Profiles that a driving robot lays over the walls that it knows.
#include "nav/profile_match.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "tests/support/random_site.hpp"

namespace nav {
namespace {

using hal::kDeg;
using testing::HasSubstr;
using Segments = std::vector<WallSegment>;

constexpr int kBeams = 271;
constexpr double kHeightM = 0.3;

Segments box_walls(double x_m, double y_m, double width_m, double depth_m) {
  const Eigen::Vector2d a(x_m, y_m), b(x_m + width_m, y_m), c(x_m + width_m, y_m + depth_m),
      d(x_m, y_m + depth_m);
  return {{a, b}, {b, c}, {c, d}, {d, a}};
}

Segments with(Segments walls, const Segments& more) {
  walls.insert(walls.end(), more.begin(), more.end());
  return walls;
}

// 30 m x 20 m with a shed, and a buttress.
Segments courtyard() {
  return with(with(box_walls(0, 0, 30, 20), box_walls(12, 8, 6, 4)), box_walls(29, 6, 1, 1));
}

Segments corridor() {
  return {{{-60, -2}, {60, -2}}, {{-60, 2}, {60, 2}}};
}

double range_to_m(const Segments& walls, const Eigen::Vector2d& from, double direction_rad) {
  const Eigen::Vector2d beam(std::cos(direction_rad), std::sin(direction_rad));
  double range_m = 1e9;
  for (const WallSegment& wall : walls) {
    Eigen::Matrix2d A;
    A << beam, wall.from_m - wall.to_m;
    if (std::abs(A.determinant()) < 1e-9) continue;
    const Eigen::Vector2d hit = A.inverse() * (wall.from_m - from);
    if (hit.x() > 0 && hit.x() < range_m && hit.y() >= 0 && hit.y() <= 1) range_m = hit.x();
  }
  return range_m;
}

hal::Pose2 between(const hal::Pose2& from, const hal::Pose2& to, double share) {
  return {from.position_m + share * (to.position_m - from.position_m),
          from.heading_rad + share * hal::wrapped(to.heading_rad - from.heading_rad)};
}

// All round but for a quarter behind, up to 20 m, while the body goes from one pose to the other.
hal::Profile profile_of(const Segments& walls, const hal::Pose2& first, const hal::Pose2& last,
                        support::Dice& dice) {
  hal::Profile profile;
  profile.beam_period_s = 0.025 / kBeams;
  profile.angle_first_rad = -135 * kDeg;
  profile.angle_step_rad = 1 * kDeg;
  for (int i = 0; i < kBeams; ++i) {
    const hal::Pose2 at = between(first, last, i / (kBeams - 1.0));
    const double range_m =
        range_to_m(walls, at.position_m, at.heading_rad + profile.angle_first_rad + i * kDeg) +
        dice.gauss(0.01);
    profile.ranges_m.push_back(range_m <= 20 ? static_cast<float>(range_m) : 0.0F);
  }
  return profile;
}

MovingProfile seen_from(const Segments& walls, const hal::Pose2& first, const hal::Pose2& last,
                        support::Dice& dice) {
  MovingProfile seen;
  seen.profile = profile_of(walls, first, last, dice);
  seen.height_m = kHeightM;
  seen.W_first = first;
  seen.W_last = last;
  return seen;
}

Eigen::Matrix3d sigmas(double position_m, double heading_deg) {
  return Eigen::Vector3d(position_m, position_m, heading_deg * kDeg).cwiseAbs2().asDiagonal();
}

Eigen::Vector3d off(const hal::Pose2& pose, const hal::Pose2& truth) {
  Eigen::Vector3d error;
  error << pose.position_m - truth.position_m, hal::wrapped(pose.heading_rad - truth.heading_rad);
  return error;
}

TEST(ProfileMatch, TellsWhereARobotIsThatTurnsWhileItMeasures) {
  const WallMap walls(courtyard(), {});
  support::Dice dice(1);
  for (int i = 0; i < 30; ++i) {
    const hal::Pose2 last{{dice.uniform(3, 10), dice.uniform(3, 17)}, dice.uniform(-3, 3)};
    const hal::Pose2 first{last.position_m - Eigen::Vector2d(0.025, 0),
                           last.heading_rad - 10 * kDeg};
    MovingProfile seen = seen_from(courtyard(), first, last, dice);
    const Eigen::Vector2d shift(dice.uniform(-0.3, 0.3), dice.uniform(-0.3, 0.3));
    for (hal::Pose2* guess : {&seen.W_first, &seen.W_last}) {
      guess->position_m += shift;
      guess->heading_rad += 2 * kDeg;
    }
    const ProfileMatch found = match_profile(walls, seen, sigmas(0.3, 3));
    ASSERT_TRUE(found.match.good) << found.match.reason;
    const Eigen::Vector3d error = off(found.match.pose, last);
    EXPECT_LT(error.head<2>().norm(), 0.04);
    EXPECT_LT(std::abs(error.z()), 0.4 * kDeg);
  }
}

// Nose down on a slope: beams ahead end on the ground, those behind fly too high; what is left is
// level.
TEST(ProfileMatch, LeavesOutGroundAndWhatIsTooHigh) {
  support::Dice dice(2);
  const hal::Pose2 at{{6, 6}, 0};
  MovingProfile seen = seen_from(courtyard(), at, at, dice);
  ProfileMatchConfig all;
  all.beams_max = kBeams;
  const std::size_t level = level_points(seen, all).size();
  seen.R_level = Eigen::AngleAxisd(4 * kDeg, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const std::vector<Eigen::Vector2d> points = level_points(seen, all);
  EXPECT_LT(points.size(), level);
  EXPECT_GT(points.size(), 50U);
  for (const Eigen::Vector2d& point : points) {
    EXPECT_LT(point.x(), (kHeightM - all.low_m) / std::tan(4 * kDeg) + 0.01);
    EXPECT_GT(point.x(), -(all.high_m - kHeightM) / std::tan(4 * kDeg) - 0.01);
  }
}

TEST(ProfileMatch, ThinsBeamsEvenly) {
  support::Dice dice(3);
  const hal::Pose2 at{{6, 6}, 0};
  ProfileMatchConfig few;
  few.beams_max = 60;
  const std::size_t points = level_points(seen_from(courtyard(), at, at, dice), few).size();
  EXPECT_LE(points, 60U);
  EXPECT_GE(points, 45U);
}

TEST(ProfileMatch, LeavesTheWayAlongACorridorFree) {
  const WallMap walls(corridor(), {});
  support::Dice dice(4);
  const hal::Pose2 truth{{3, 0.4}, 3 * kDeg};
  MovingProfile seen = seen_from(corridor(), truth, truth, dice);
  seen.W_first = seen.W_last = {{3.5, 0.1}, 0};
  const ProfileMatch found = match_profile(walls, seen, sigmas(0.5, 3));
  ASSERT_TRUE(found.match.good) << found.match.reason;
  EXPECT_TRUE(found.match.free);
  EXPECT_NEAR(found.match.pose.position_m.x(), 3.5, 0.05);
  EXPECT_GT(std::sqrt(found.match.covariance(0, 0)), 1);
  EXPECT_NEAR(found.match.pose.position_m.y(), 0.4, 0.05);
  EXPECT_LT(std::sqrt(found.match.covariance(1, 1)), 0.15);
}

// Walls that are half a metre beside where a robot can be are others: a parapet, a parked truck.
TEST(ProfileMatch, RefusesWallsThatAreElsewhereThanTheRobotCanBe) {
  const WallMap walls(courtyard(), {});
  support::Dice dice(5);
  const hal::Pose2 truth{{6, 5}, 0.5};
  MovingProfile seen = seen_from(courtyard(), truth, truth, dice);
  seen.W_first.position_m.x() += 0.7, seen.W_last.position_m.x() += 0.7;
  const ProfileMatch sure = match_profile(walls, seen, sigmas(0.03, 0.5));
  EXPECT_FALSE(sure.match.good);
  EXPECT_TRUE(sure.refused);
  EXPECT_THAT(sure.match.reason, HasSubstr("beside where the robot can be"));
  EXPECT_TRUE(match_profile(walls, seen, sigmas(0.5, 3)).match.good);
}

TEST(ProfileMatch, SaysThatItSeesNoWallsOrOthers) {
  support::Dice dice(6);
  const hal::Pose2 at{{6, 6}, 0};
  const MovingProfile seen = seen_from(courtyard(), at, at, dice);
  EXPECT_FALSE(match_profile(WallMap(Segments{}, WallMapConfig{}), seen, sigmas(1, 5)).match.good);
  const WallMap others(box_walls(4, 4, 4.5, 5.5), {});
  const ProfileMatch found = match_profile(others, seen, sigmas(1, 5));
  EXPECT_FALSE(found.match.good);
  EXPECT_FALSE(found.refused);
  EXPECT_FALSE(found.match.reason.empty());
  MovingProfile blind = seen;
  for (float& range_m : blind.profile.ranges_m) range_m = std::nanf("");
  EXPECT_FALSE(match_profile(WallMap(courtyard(), {}), blind, sigmas(1, 5)).match.good);
}

// Scans show the shed that the map lacks, and the west wall 0.2 m beside where it is drawn.
TEST(WallMap, TakesWhatScansShowForWhatIsDrawnBesideIt) {
  std::vector<Eigen::Vector2d> shown_m;
  for (double y_m = 0; y_m <= 20; y_m += 0.1) shown_m.emplace_back(0.2, y_m);
  for (double x_m = 12; x_m <= 18; x_m += 0.1) shown_m.emplace_back(x_m, 8);
  const WallMap map(box_walls(0, 0, 30, 20), shown_m, {});
  ASSERT_NE(map.nearest({0.1, 10}), nullptr);
  EXPECT_NEAR(map.nearest({0.1, 10})->point_m.x(), 0.2, 0.01);
  EXPECT_NEAR(std::abs(map.nearest({0.1, 10})->normal.x()), 1, 0.02);
  ASSERT_NE(map.nearest({15, 8.2}), nullptr) << "the shed";
  EXPECT_NEAR(map.nearest({15, 8.2})->point_m.y(), 8, 0.01);
  ASSERT_NE(map.nearest({29.8, 10}), nullptr) << "drawn only";
  EXPECT_NEAR(map.nearest({29.8, 10})->point_m.x(), 30, 0.06);
  EXPECT_EQ(map.nearest({8, 10}), nullptr);
}

// Round the shed without satellites. Wheels slip by 2 % and turn the robot by 0.5 deg a metre more
// than they say; the map is drawn 3 cm off.
class Lap {
 public:
  explicit Lap(std::uint64_t seed)
      : dice_(seed),
        slip_(dice_.gauss(0.02)),
        drift_radpm_((dice_.below(2) == 0 ? -0.5 : 0.5) * kDeg),
        localizer_({}, kStart, sigmas(0.05, 1)) {
    const Eigen::Vector2d off_m(dice_.gauss(0.02), dice_.gauss(0.02));
    for (WallSegment& wall : drawn_) wall.from_m += off_m, wall.to_m += off_m;
  }

  // Legs of the lap, with a right angle after each.
  void drive(bool looks) {
    const WallMap walls(drawn_, WallMapConfig{});
    for (const double leg_m : {20.0, 12.0, 20.0, 12.0}) {
      for (double way_m = 0; way_m < leg_m; way_m += kStepM) {
        step(kStepM, 0);
        if (looks && ++steps_ % 20 == 0) look(walls);
      }
      for (int i = 0; i < 40; ++i) step(0, 90 * kDeg / 40);
      if (looks) look(walls);
    }
  }

  Eigen::Vector3d error() const { return off(localizer_.pose(), truth_); }
  double nees() const { return error().dot(localizer_.covariance().inverse() * error()); }
  int used() const { return used_; }

 private:
  static inline const hal::Pose2 kStart{{5, 4}, 0};
  static constexpr double kStepM = 0.05, kTrackM = 0.6;

  // Wheels do not tell of the drift.
  void step(double way_m, double turn_rad) {
    before_ = truth_;
    const double heading_rad = truth_.heading_rad + turn_rad / 2;
    truth_.position_m += way_m * Eigen::Vector2d(std::cos(heading_rad), std::sin(heading_rad));
    truth_.heading_rad = hal::wrapped(truth_.heading_rad + turn_rad);
    now_ += std::chrono::milliseconds(50);
    const double told_m = way_m * (1 + slip_);
    const double side_m = (turn_rad - drift_radpm_ * way_m) * kTrackM / 2;
    localizer_.predict(hal::WheelTravel{now_, told_m - side_m, told_m + side_m});
  }

  void look(const WallMap& walls) {
    MovingProfile seen;
    const hal::Pose2 first = between(before_, truth_, 0.5);
    seen.profile = profile_of(courtyard(), first, truth_, dice_);
    seen.height_m = kHeightM;
    seen.W_first = localizer_.pose_at(now_ - std::chrono::milliseconds(25));
    seen.W_last = localizer_.pose_at(now_);
    const ProfileMatch found = match_profile(walls, seen, localizer_.covariance());
    if (!found.match.good) return;
    used_ += localizer_.add(PoseFix{now_, found.match.pose, found.match.covariance}).gate ==
             Gate::accepted;
  }

  support::Dice dice_;
  double slip_, drift_radpm_;
  Localizer localizer_;
  Segments drawn_ = courtyard();
  hal::Pose2 before_ = kStart, truth_ = kStart;
  hal::Time now_{};
  int steps_{}, used_{};
};

TEST(ProfileMatch, KeepsARobotWithinThreeDecimetresWithoutSatellites) {
  std::vector<double> off_m, off_deg, without_m;
  double nees = 0;
  constexpr int kLaps = 100;
  for (std::uint64_t seed = 1; seed <= kLaps; ++seed) {
    Lap blind(seed), lap(seed);
    blind.drive(false);
    lap.drive(true);
    EXPECT_GT(lap.used(), 50) << seed;
    without_m.push_back(blind.error().head<2>().norm());
    off_m.push_back(lap.error().head<2>().norm());
    off_deg.push_back(std::abs(lap.error().z()) / kDeg);
    nees += lap.nees() / kLaps;
  }
  for (std::vector<double>* values : {&off_m, &off_deg, &without_m}) std::ranges::sort(*values);
  std::printf("95 %% within %.3f m and %.2f deg (without walls %.2f m), NEES %.2f\n", off_m[94],
              off_deg[94], without_m[94], nees);
  EXPECT_LE(off_m[94], 0.30);
  EXPECT_LE(off_deg[94], 1.5);
  EXPECT_GT(without_m[94], 5 * off_m[94]);
  EXPECT_LT(nees, 3.5) << "claims less than it is off";
}

}  // namespace
}  // namespace nav
