// Everything a run decided and did, as values: what the store writes and the report draws.
#pragma once

#include <array>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "mission/config.hpp"
#include "mission/energy.hpp"
#include "nav/free_space.hpp"
#include "nav/site_map.hpp"
#include "planning/cover.hpp"
#include "planning/stop_certificate.hpp"
#include "planning/voxel_map.hpp"
#include "planning/why.hpp"

namespace mission {

// Voxel counts of the whole map (the columns of the paper's Tables I and II).
struct VoxelCounts {
  std::uint64_t seen_empty{};
  std::uint64_t seen_occupied{};
  std::uint64_t unseen{};
  std::uint64_t boundary_unseen{};
};

// How a scan was laid over those before it.
enum class ScanVerdict {
  off,           // Not asked for.
  alone,         // It overlaps no scan in hand: nothing to compare it with.
  accepted,      // Fits those that it overlaps.
  held_in_part,  // Fits, but some directions are left to the localizer.
  refused        // Contradicts them: not merged.
};
std::string_view name(ScanVerdict verdict);

// In figures of the pair that overlaps most, where there is one.
struct ScanFit {
  ScanVerdict verdict = ScanVerdict::off;
  std::string reason;  // Why it was refused, or which directions are free.
  int tries{};         // Guesses and scans that it took.
  int references{};    // Scans that it fits.
  double rms_m{};
  double cloud_to_cloud_m{};
  double overlap{};
  double strength_shift{}, strength_turn{};  // Of the weakest direction, height and tilt included.
  double moved_m{}, moved_rad{};             // From where the localizer had it.
  double chi2{};                             // Of that, by both covariances; 3 numbers.
  hal::Pose2 before;                         // Where the localizer had it.
};

struct ScanRecord {
  int number{};           // 1, 2, ...: scans/0001.ply
  bool next_best_view{};  // false: a station of Phase I
  std::string name;       // "inner 3", "NBV 2"
  std::string area;
  bool by_hand{};  // Placed by a person.
  hal::Pose2 planned;
  hal::Pose2 believed;        // Where localizer and registration say the scan was taken.
  double sigma_position_m{};  // Their own claim, 1-sigma.
  double sigma_heading_rad{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // Of (x m, y m, heading rad), in W.
  std::optional<hal::Pose2> arrived;  // Where the localizer had a robot that came to scan here,
  double arrived_sigma_m{}, arrived_sigma_rad{};  // and its claim, as above.
  ScanFit fit;
  hal::Time stamp{};                // Of the scan, by the robot's clock.
  std::optional<hal::Pose2> truth;  // In simulation.
  double ground_z_m{};
  hal::ScanPattern pattern;  // Of its beams.
  double start_s{};          // Mission time.
  double end_s{};
  double driven_m{};  // On the way here.
  std::uint64_t beams{};
  std::uint64_t points{};
  std::uint64_t points_outside_box{};
  double adds_m{};                   // Phase I, planned
  double overlaps_m{};               // Phase I, planned
  std::uint64_t predicted_voxels{};  // NBV: boundary unseen voxels it should see.
  std::uint64_t resolved_voxels{};   // Of those, no longer unseen afterwards.
  VoxelCounts after;
  std::uint64_t visible_to_next{};  // Best tally after this scan: what the next view would see.

  // Sets the covariance, and in two numbers what it says along its worse axis and of the heading.
  void claim(const Eigen::Matrix3d& of_pose);
  // The same of where it arrived.
  void arrive(const hal::Pose2& at, const Eigen::Matrix3d& of_pose);
};

// What is scanned from in place of a station that no road led to.
struct Instead {
  double lost_m{};                    // Wall that no other station and no scan in hand sees.
  double left_m{};                    // Of that, what these stations do not see either.
  std::vector<std::string> stations;  // None: no place is worth a scan.
};

// A station that was planned and not scanned.
struct DroppedStation {
  std::string name;
  std::string area;
  hal::Pose2 planned;
  std::string reason;
  std::optional<Instead> instead = std::nullopt;  // Nothing: it was not asked for.
};

// A place for a next best view to which no road led.
struct LeftOutView {
  std::string area;
  hal::Pose2 planned;
  std::uint32_t voxels{};  // NextView::voxels
};

// Phase I for one free area.
struct AreaPlan {
  nav::FreeArea area;
  std::string mode;  // "robot" or "manual"
  std::vector<planning::Wall> walls;
  planning::CoverPlan cover;
  // Of cover.stations, as a plan file calls them, or for what they stand in; else empty.
  std::vector<std::string> names;
  std::vector<int> tour;  // Order in which cover.stations are visited.
  double tour_m{};
  std::vector<std::vector<Eigen::Vector2d>> way_m;      // Of the tour, leg by leg; empty: unknown.
  std::vector<std::vector<Eigen::Vector2d>> roadmap_m;  // Polylines of the Voronoi roadmap.
};

// What the localizer made of the satellite fixes.
struct GnssCounts {
  std::uint64_t fixes{};
  std::uint64_t refused{};  // Outliers, mostly multipath: the pose did not follow them.
  std::uint64_t resets{};   // The localizer was lost and took the fixes' word.
};

// What the robot met while it drove.
struct MovingFacts {
  int legs{};
  int obstacles_met{};   // Ways that had something in them: gone round, or given up.
  double waited_s{};     // Standing before it.
  double short_max_m{};  // The farthest from its goal that a leg ended which arrived.
};

// What the robot's battery gave, as reckoned from times and watts.
struct EnergyFacts {
  EnergyTimes spent;
  double used_wh{}, left_wh{}, reserve_wh{};
  ForecastError error;  // Of the minutes to the tour's end, foretold at each of its stops.
};

// What Phase II leaves at its end, and why.
struct Leftover {
  planning::StopCertificate certificate;
  std::optional<Eigen::Vector2d> optimistic_at_m;  // From where its optimistic count is seen.
  bool foliage{};  // What blocks now may be found to be foliage later: then nothing is proven.
  // Boundary unseen voxels that no cell can see as the map stands (roofs, pockets: work for a mast
  // or a drone), by planning::ViewVerdict.
  std::array<std::uint64_t, static_cast<std::size_t>(planning::ViewVerdict::visible)>
      never_visible{};

  bool proven() const { return certificate.proven() && !foliage; }
  std::uint64_t never_visible_voxels() const {
    return std::accumulate(never_visible.begin(), never_visible.end(), std::uint64_t{0});
  }
};

// How much of the surface seen so far has the points per m^2 asked for.
struct DensityFacts {
  double goal_ppm2{};              // 0: none was asked for.
  std::uint64_t surface_voxels{};  // Seen-occupied with a seen-empty neighbour.
  std::uint64_t reached_voxels{};
};

// What registration did over the whole run.
struct RegistrationCounts {
  int accepted{}, held_in_part{}, alone{}, refused{};  // Scans, by their last verdict.
  int retaken{};                                       // Scans that were taken again.
  int unheard{};                       // Accepted ones that the localizer would not follow.
  int map_matched{}, map_unmatched{};  // Scans of the robot whose walls were the map's.
  int tours_closed{};
  int pairs{}, pairs_odd{};               // When the last tour closed.
  double moved_max_m{}, moved_max_rad{};  // Of any scan when a tour closed.
};

// Simulation only: the run judged by the world that it could not see.
struct Truth {
  std::uint64_t surface_visible{};  // Surface voxels visible from some reachable ground cell.
  std::uint64_t surface_seen{};     // Of those, seen-occupied.
  double position_error_max_m{};    // Believed against true pose, over all scans.
  double position_error_rms_m{};
  double heading_error_max_rad{};
  double nees_mean{};  // 3 expected when the covariance is honest.
  // Where the localizer had the robot's scans before they were registered.
  double before_error_max_m{}, before_error_max_rad{};
};

// Profiles laid over the walls that are known, on the way.
struct ProfileCounts {
  std::uint64_t used{};
  std::uint64_t refused{};  // They were elsewhere than the localizer can be.
  std::uint64_t unlike{};   // No walls, or others.
};

struct RunRecord {
  std::string mission;
  std::string site;
  std::string robot;
  std::uint64_t seed{};
  nav::SiteMap map;
  std::vector<nav::Repair> repairs;
  std::vector<std::string> notes;  // What the operator should know, in order.
  std::vector<AreaPlan> plans;
  std::vector<ScanRecord> scans;
  std::vector<DroppedStation> dropped;
  std::vector<LeftOutView> left_out;                   // Next best views that were never tried.
  std::vector<std::vector<Eigen::Vector2d>> driven_m;  // Believed tracks, one per leg.
  ScannerConfig scanner;
  double radius_m{};  // Of the robot.
  double margin_m{};  // MissionConfig::margin_m
  planning::VoxelGrid grid;
  double voxel_m{};
  int gain_min_voxels{};
  // Of [phase2].
  double density_min_ppm2{};
  bool looks_through_foliage{};
  double foliage_share_min{};
  GnssCounts gnss;
  ProfileCounts profiles;
  RegistrationCounts registration;
  double mission_s{};
  int resumed{};  // How often it went on after it had ended or been cut off.
  double driven_total_m{};
  MovingFacts moving;
  EnergyFacts energy;
  std::vector<std::uint64_t> set_aside;       // SiteModel::voxels_set_aside at the end,
  std::vector<std::uint64_t> thin_set_aside;  // thin_set_aside
  std::vector<std::uint64_t> foliage;         // and foliage.
  std::string end;                            // Why it ended, in words.
  bool completed{};
  std::optional<Leftover> leftover;
  DensityFacts density;
  std::optional<Truth> truth;
};

}  // namespace mission
