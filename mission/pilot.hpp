// Knows where the robot is and drives it along the roadmap: the loops between nav's pure functions
// and the devices.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "hal/clock.hpp"
#include "hal/compute.hpp"
#include "hal/devices.hpp"
#include "hal/turn_scanner.hpp"
#include "mission/config.hpp"
#include "mission/record.hpp"
#include "mission/roads.hpp"
#include "mission/sensor_log.hpp"
#include "nav/follow.hpp"
#include "nav/localizer.hpp"
#include "nav/obstacle_map.hpp"
#include "nav/profile_match.hpp"

namespace mission {

// How a leg ended. Not arrived: why, in words for the operator.
struct LegEnd {
  bool arrived{};
  bool drive_lost{};  // It did not come back in time: nothing more can be driven.
  std::string reason;
  double driven_m{};
  double short_of_goal_m{};                // Where it ended, as believed.
  int obstacles_met{};                     // Ways that had something in them.
  double waited_s{};                       // Standing before it.
  std::vector<Eigen::Vector2d> track_m;    // Believed positions, about one per metre.
  std::vector<Eigen::Vector2d> touched_m;  // Where roads were closed for good.
};

// How a robot of this body follows paths.
nav::FollowConfig follow_config(const BodyConfig& body);

// How a robot of this body slows down and stops for what is in its way.
nav::ZoneConfig zone_config(const BodyConfig& body);

// What a robot takes for an obstacle: with a scanner that has rows, what lies between the ground
// and its own height.
nav::ObstacleMapConfig obstacle_config(const RobotConfig& robot);

// How long it takes along the route, from pose to pose and until it stands: the follower at work on
// a robot that does exactly as told.
double drive_time_s(const BodyConfig& body, const nav::Route& route, hal::Pose2 from,
                    hal::Pose2 to);

class Pilot {
 public:
  // Of a start pose from survey marks or the operator's care: a few centimetres, a degree.
  static Eigen::Matrix3d start_covariance();
  static constexpr double kTouchedSideM = 0.6;  // Square that is closed around what was touched.

  Pilot(const RobotConfig& config, hal::Clock& clock, hal::Devices& devices, hal::Pose2 start,
        const Eigen::Matrix3d& covariance = start_covariance());

  // From now on, what looks ahead on the way is laid over these walls where satellites do not tell
  // the place: every metre, or turn of 20 deg, and where it stands. `compute` outlives the pilot.
  void know_walls(hal::Compute& compute, std::shared_ptr<const nav::WallMap> walls);
  const ProfileCounts& profiles() const { return profiles_; }

  // Runs beside the mission and keeps the pose current, without IMU or satellites where these are
  // lost. Ends only by cancellation, or when the wheels' travel cannot be had (throws
  // boost::system::system_error).
  hal::Task<void> track();

  // Drives to the goal, at most kRoutesMax routes. What it sees in its way it stops for, waits a
  // little, and then closes the roads there for now; what it touched (at most kTouchesMax times)
  // closes them for good. Then it looks for another way. Where none is left, what was closed for
  // now is tried once more: it may have gone. Without a look at what is ahead it stands. While the
  // drive does not obey (lost, or held by an e-stop) it waits, for a bounded time, and then goes on
  // where it stands.
  hal::Task<LegEnd> drive_to(Roads& roads, hal::Pose2 goal);

  // After drive_to was cancelled: the robot stands, as far as the drive obeys, and nothing looks
  // ahead any more.
  hal::Task<void> abandon();

  hal::Pose2 pose() const { return localizer_.pose(); }
  Eigen::Matrix3d covariance() const { return localizer_.covariance(); }
  // The same without what correct() was told: wheels, IMU, satellites and map only.
  hal::Pose2 pose_alone() const { return alone_.pose(); }
  Eigen::Matrix3d covariance_alone() const { return alone_.covariance(); }
  // Where the other scans, or the map, say that the robot stands, now.
  nav::Correction correct(const hal::Pose2& pose, const Eigen::Matrix3d& covariance);
  nav::Correction correct_by_map(const hal::Pose2& pose, const Eigen::Matrix3d& covariance);
  double travelled_m() const { return travelled_m_; }
  // While it drives with a look at what is ahead: when the last profile came, or the scanner was
  // told to start.
  std::optional<hal::Time> range_at() const {
    return looks_since_ ? std::max(looked_at_, looks_since_) : looks_since_;
  }
  const GnssCounts& gnss() const { return sensors_.gnss(); }
  SensorLog& sensors() { return sensors_; }

 private:
  static constexpr int kRoutesMax = 8, kTouchesMax = 3;
  enum class RouteEnd { arrived, near, touched, in_the_way, blind, given_up, drive_lost };
  // For how long, and since when, the robot has been standing for what is in its way.
  struct Hold {
    std::optional<hal::Time> since;
    Eigen::Vector2d W_in_way_m{0, 0};
  };

  hal::Task<void> track_travel();
  hal::Task<void> track_imu();
  hal::Task<void> track_gnss();
  hal::Task<void> track_obstacles();
  hal::Task<void> track_turns(hal::TurnScanner& scanner);
  hal::Task<void> track_walls();
  bool wants_walls() const;
  bool has_good_gnss() const;
  hal::Task<void> lay_over_walls();
  hal::Task<LegEnd> drive_on(Roads& roads, hal::Pose2 goal);
  bool is_blind() const;
  nav::Zones zones(const nav::FollowConfig& config, nav::FollowState state,
                   const nav::Path& path) const;
  bool has_patience(const nav::Zones& zones, Hold& hold, LegEnd& leg) const;
  RouteEnd end_of(const Hold& hold, const hal::Pose2& goal, LegEnd& leg);
  void close_seen(Roads& roads, const Eigen::Vector2d& W_in_way_m) const;
  hal::Task<void> close_touched(Roads& roads, LegEnd& leg);
  hal::Task<RouteEnd> follow_route(const nav::Route& route, hal::Pose2 goal, LegEnd& leg);
  hal::Task<boost::system::error_code> tell_drive(hal::Twist twist, LegEnd& leg);
  hal::Task<boost::system::error_code> wait_for_drive(boost::system::error_code why, LegEnd& leg);
  hal::Task<void> back_off();
  hal::Task<void> halt();
  void note_track(LegEnd& leg) const;

  const RobotConfig config_;
  hal::Clock& clock_;
  hal::Devices& devices_;
  nav::Localizer localizer_;
  nav::Localizer alone_;
  SensorLog sensors_;
  nav::ObstacleMap obstacles_;
  std::optional<hal::Time> looked_at_;  // When the last profile came.
  std::optional<hal::Time> looks_since_;
  std::optional<hal::Profile> profile_;  // The last, until it is laid over the walls.
  std::shared_ptr<const nav::WallMap> walls_;
  hal::Compute* compute_ = nullptr;
  std::optional<hal::Time> told_by_gnss_at_;
  double laid_at_m_{}, laid_at_rad_{};  // Way travelled and heading when that was done last.
  ProfileCounts profiles_;
  Eigen::Vector2d W_in_way_m_{0, 0};  // What ended the last route.
  std::optional<hal::Time> closed_for_now_at_;
  double travelled_m_{};  // By the wheels, since the start.
};

}  // namespace mission
