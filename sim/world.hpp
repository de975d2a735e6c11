// The truth: where the robot really is, and what the world does to its motion and its sensors.
// Shares no code with nav/, so that an error there cannot hide here.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "sim/noise.hpp"
#include "sim/people.hpp"
#include "sim/scan.hpp"
#include "sim/scene.hpp"

namespace sim {

// How the world behaves. Radians, metres, seconds; sigmas are 1-sigma.
struct WorldConfig {
  std::uint64_t seed = 1;
  int threads = 2;  // For ray casting; changes nothing but speed.

  // Body: a disc on wheels with skid steering.
  double radius_m = 0.5;
  double track_m = 0.6;
  double speed_max_mps = 1.0;
  double turn_max_radps = 45 * 0.017453292519943295;
  double lag_s = 0.2;             // First-order lag of each side's speed.
  double command_expiry_s = 0.5;  // Then the drive stops by itself.
  double step_max_m = 0.15;       // Drives over lower steps; does not drive off higher ones.
  double collision_height_m = 1.5;

  // The slip of each side wanders with this sigma over slip_length_m of its travel: over a longer
  // way d the travel error's variance is 2 slip_sigma^2 slip_length_m d.
  double slip_sigma = 0.02;
  double slip_length_m = 5.0;
  double encoder_tick_m = 0.001;
  double gyro_sigma_radps = 0.05 * 0.017453292519943295;
  double gyro_bias_sigma_radps = 0.02 * 0.017453292519943295;  // Drawn once per run.
  // GNSS error per axis = white + wandering; the receiver claims the sigma of their sum.
  double gnss_sigma_m = 0.03;
  double gnss_wander_share = 0.5;  // Of the variance.
  double gnss_wander_s = 60;       // Correlation time.
  // Outlines in W within which no satellite is seen: courtyards, halls. Ground within an even
  // number of them is not.
  std::vector<std::vector<Eigen::Vector2d>> gnss_outages;

  // A scanner set up by hand: how far from the wanted pose, and how well it is surveyed then.
  double placement_offset_sigma_m = 0.05;
  double placement_offset_heading_sigma_rad = 2 * 0.017453292519943295;
  double placement_sigma_m = 0.01;
  double placement_heading_sigma_rad = 0.05 * 0.017453292519943295;
  double placement_s = 900;
  double tripod_radius_m = 0.4;

  ScannerModel scanner;

  double ground_z_m = 0;                            // Expected where no region says otherwise.
  std::map<std::string, double> region_ground_z_m;  // By name, for Placement.

  std::vector<Person> people;  // On ground_z_m.
};

// A pose on the ground it stands on.
struct StandingPose {
  hal::Pose2 pose;
  double ground_z_m{};

  Eigen::Isometry3d T_W_S(double scanner_height_m) const;
};

// Where a scan was really taken.
struct ScanTruth {
  hal::Time stamp{};
  StandingPose at;
  bool by_hand{};
};

// Advances in ticks of 20 ms, only when asked: whoever asks first, the world is the same at a tick.
// The scene must outlive it; put_robot comes first.
class World {
 public:
  static constexpr hal::Duration kTick = std::chrono::milliseconds(20);

  World(const Scene& scene, const WorldConfig& config);

  // Puts the robot somewhere, standing still. Fails with errc::address_not_available, changing
  // nothing, when there is no ground within 1 m of expected_ground_z_m or something is in the way.
  hal::Result<void> put_robot(const hal::Pose2& pose, double expected_ground_z_m);

  // Brings every tick up to `now` about. Time never turns back.
  void advance(hal::Time now);

  // A commanded twist at the present time: clamped to the body's limits, forgotten after
  // command_expiry_s. errc::invalid_argument when not finite; errc::io_error, and the robot stays,
  // when it stands against something and the twist would push on.
  hal::Result<void> command(const hal::Twist& twist);

  const WorldConfig& config() const { return config_; }
  const Scene& scene() const { return scene_; }
  const StandingPose& robot() const { return robot_; }  // The truth.
  bool moving() const { return left_.speed_mps != 0 || right_.speed_mps != 0; }
  hal::Twist rolling() const;  // As the wheels turn now, slip left out.
  int collisions() const { return collisions_; }
  double driven_m() const { return driven_m_; }  // Of the body's centre.

  // Those who walk about, at the latest tick.
  const std::vector<Walker>& people() const { return people_; }
  // How far away along a ray (unit direction) the first of them is; infinite: none.
  double range_to_people_m(const Eigen::Vector3d& W_from, const Eigen::Vector3d& W_direction) const;
  // The same along many rays from one origin.
  void ranges_to_people_m(const Eigen::Vector3d& W_from,
                          std::span<const Eigen::Vector3d> W_directions,
                          std::span<double> ranges_m) const;

  // What the sensors say at the latest tick. Each has one reader: asking again draws new noise.
  hal::WheelTravel take_travel();  // Whole encoder ticks since the last call.
  hal::ImuSample sample_imu();     // Yaw rate over the latest tick.
  hal::GnssFix sample_gnss();
  bool gnss_hidden() const;  // No satellite is seen where the robot is.
  // What day the satellites say it is: so many off from then on. Their time of day stays.
  void shift_date(int days) { date_shift_days_ = days; }
  int date_shift_days() const { return date_shift_days_; }

  // Where a scanner can stand near a pose: errc::address_not_available as put_robot, with the
  // tripod's radius.
  hal::Result<StandingPose> standing(const hal::Pose2& pose, double expected_ground_z_m,
                                     double radius_m) const;

  // A scanner set up by hand stays there until the robot is commanded to move.
  void place_scanner(const StandingPose& at) { placed_scanner_ = at; }
  const std::optional<StandingPose>& placed_scanner() const { return placed_scanner_; }

  std::uint64_t next_scan_number() { return ++scans_begun_; }
  void record_scan(const ScanTruth& truth) { scans_.push_back(truth); }
  const std::vector<ScanTruth>& scans() const { return scans_; }  // In the order taken.

 private:
  struct Side {
    double target_mps = 0;
    double speed_mps = 0;
    WanderingNoise slip;
    double rolled_m = 0;    // Of the wheel, unslipped, since the start.
    double reported_m = 0;  // In whole encoder ticks.
  };

  void tick();
  double roll(Side& side);  // Over one tick: how far the ground went by.
  void move(double left_m, double right_m);
  bool blocked(const StandingPose& to);
  bool runs_into_person(const Eigen::Vector2d& to) const;
  void walk();
  bool ground_breaks_off(const StandingPose& at) const;
  void stop_against_something();
  bool free_ahead(double forward_mps) const;
  std::optional<double> ground_within_step(const Eigen::Vector2d& W_point, double z_m) const;

  const Scene& scene_;
  const WorldConfig config_;
  std::int64_t ticks_ = 0;  // Since time 0.
  StandingPose robot_;
  Side left_, right_;
  std::int64_t command_expires_ = 0;  // Tick.
  double yaw_rate_radps_ = 0;
  double clear_m_ = 0;           // Can move this far without looking.
  double ground_checked_m_ = 0;  // Moved since the ground was last looked at.
  int blocked_direction_ = 0;    // 1: something in front, -1: behind, 0: free.
  int collisions_ = 0;
  double driven_m_ = 0;
  NoiseStream gyro_;
  double gyro_bias_radps_;
  NoiseStream gnss_white_;
  WanderingNoise gnss_wander_x_, gnss_wander_y_;
  std::int64_t gnss_tick_ = 0;
  int date_shift_days_ = 0;
  std::vector<Walker> people_;
  std::optional<StandingPose> placed_scanner_;
  std::uint64_t scans_begun_ = 0;
  std::vector<ScanTruth> scans_;
};

}  // namespace sim
