// Ground that a robot cannot drive on though no wall stands there: too steep, a kerb, the edge of a
// pit. From the points of one scan, so that what is amiss with the poses of several makes no step.
#pragma once

#include <cstdint>
#include <vector>

#include "nav/raster.hpp"

namespace nav {

struct TerrainLimits {
  double slope_max_rad{};
  double step_max_m{};   // Up or down.
  double footprint_m{};  // Radius of the circle that a slope is taken over; 0.5 to 0.7 m count.
  double range_max_m{};  // Points farther from the scanner, in the plane, are left out.
  double overhead_m{};   // Points higher than this over ground_z_m hang over the ground.
  double ground_z_m{};   // Under the scanner.
};

// Heights over ground_z_m are counted in bins of 1 cm. The ground of a cell is the lowest band of
// kBandBins bins that holds kSupportMin points or more: its height is the mean of their bins'
// middles. What lies below the lowest bin counts in that.
inline constexpr double kBinM = 0.01, kLowestM = -4;
inline constexpr int kBandBins = 5, kSupportMin = 3;
// Over so many cells of which nothing is known two cells are still compared: behind the edge of a
// pit lies ground that the scanner does not see.
inline constexpr int kGapCells = 3;

// Per cell of the grid, over ground_z_m; not a number: unknown.
std::vector<float> ground_heights(const std::vector<Eigen::Vector3f>& W_points_m,
                                  const Eigen::Vector2d& W_scanner_m, const RasterGrid& grid,
                                  const TerrainLimits& limits);

enum class Ground : std::uint8_t { unknown, drivable, step, slope };

// Two known cells in a row or column with at most kGapCells unknown ones between, and nothing
// known, are a step when their heights differ by more than step_max_m and by more than slope_max
// explains over their distance: both and all between them are `step`. `slope`: the plane that fits
// best the known heights around, steps left out, is steeper than slope_max_rad; five heights that
// do not lie in a line are needed. A slope that rises by more than step_max_m from cell to cell
// within its limit is no step.
std::vector<Ground> judge_ground(const std::vector<float>& heights_m, const RasterGrid& grid,
                                 const TerrainLimits& limits);

}  // namespace nav
