// Where the robot is by what its profile scanner sees: a profile laid over a map of walls, by
// point-to-line ICP in the plane, with a covariance. The map is a footprint, or what scans have
// shown so far.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/values.hpp"

namespace nav {

struct WallSegment {
  Eigen::Vector2d from_m{0, 0}, to_m{0, 0};
};

struct WallMapConfig {
  double cell_m = 0.1;      // Of the table of nearest wall points.
  double reach_m = 1.5;     // Beyond this no wall is near.
  double spacing_m = 0.05;  // Between points along segments.
  double normal_m = 0.35;   // Points are taken for a wall with those so near.
  std::size_t cells_max = 64'000'000;
};

// Points of walls in W and the nearest of them for every cell around.
class WallMap {
 public:
  // Throws std::invalid_argument when the walls span more than config.cells_max cells; points that
  // are not finite are left out.
  WallMap(std::span<const WallSegment> walls, const WallMapConfig& config);
  // Points as scans show them; at most one in a quarter cell is kept.
  WallMap(std::span<const Eigen::Vector2d> W_points_m, const WallMapConfig& config);
  // Both. Where scans show something, what is drawn so near it is left out: it is the same wall,
  // drawn a little beside.
  static constexpr double kShownM = 0.5;
  WallMap(std::span<const WallSegment> walls, std::span<const Eigen::Vector2d> W_points_m,
          const WallMapConfig& config);

  struct Wall {
    Eigen::Vector2d point_m{0, 0};
    Eigen::Vector2d normal{0, 0};  // Zero: no line there.
  };
  // Null where no wall is near.
  const Wall* nearest(const Eigen::Vector2d& W_point_m) const;
  const std::vector<Wall>& walls() const { return walls_; }

 private:
  static std::vector<Wall> drawn(std::span<const WallSegment> walls, double spacing_m);
  void find_normals(const WallMapConfig& config);
  void index(const WallMapConfig& config);
  std::size_t cell_of(const Eigen::Vector2d& W_point_m) const;

  double cell_m_ = 1;
  double reach_m_ = 0;
  Eigen::Vector2d corner_m_{0, 0};
  std::int64_t columns_{}, rows_{};
  std::vector<Wall> walls_;
  std::vector<std::int32_t> nearest_;  // By cell; -1: none.
};

struct ScanMatchConfig {
  int steps_max = 40;
  double reach_start_m = 1.5, reach_end_m = 0.4;
  double noise_floor_m = 0.03;
  // What it begins with; it narrows to the floor. A few beams that tell of a direction alone are
  // heeded then, though they are farther off than the many that do not.
  double noise_start_m = 0.03;
  double kernel_scale = 2.5;     // In robust sigmas (Geman and McClure).
  double correlated_beams = 12;  // So many beams count as one independent measurement.
  double map_sigma_m = 0.03;     // How far walls may be off: no match is better.
  double map_sigma_rad = 0.004;
  double free_below = 0.02;  // Strength below which a direction is held at the guess.
  double free_sigma_m = 3, free_sigma_rad = 0.5;  // What is then claimed for it.
  double fit_within_m = 0.15;
  double fit_min = 0.55;  // Share of beams that must lie on walls.
  std::size_t beams_min = 30;
  // With a lower score than this, so far around the guess others are tried, and the one with the
  // highest is taken; with a lower one still, other headings all around.
  double score_sure = 0.85, score_lost = 0.75;
  double search_m = 0.5, search_rad = 0.2;
  bool searches = true;  // False: only from the guess.
};

struct ScanMatch {
  hal::Pose2 pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // Of (x m, y m, heading rad).
  double fit{};                                              // Share of beams on walls.
  double score{};  // Of all beams: 1 on a wall, less the farther off.
  double rms_m{};  // Of those.
  bool free{};     // Some direction is held where the guess had it: a corridor.
  bool good{};
  std::string reason;  // Why it is not good.
};

// points_m: ends of beams that came back, in the body's frame.
ScanMatch match_scan(const WallMap& map, std::span<const Eigen::Vector2d> B_points_m,
                     const hal::Pose2& guess, const ScanMatchConfig& config = {});

// The ends of a profile's beams between two ranges; T_B_L in the plane.
std::vector<Eigen::Vector2d> profile_points(const hal::Profile& profile, const hal::Pose2& T_B_L,
                                            double near_m, double far_m);

}  // namespace nav
