#include "nav/terrain.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace nav {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kReachMinM = 0.5, kReachMaxM = 0.7;
constexpr int kHeightsMin = 5;

// The cells beside a step are never among those that a slope is taken over, nor what lies behind
// them: two cells of a step lie between, and kReachMaxM does not reach across them.
double reach_m(const TerrainLimits& limits) {
  return std::clamp(limits.footprint_m, kReachMinM, kReachMaxM);
}

// How many points each cell has in each bin.
class Histogram {
 public:
  Histogram(const RasterGrid& grid, double overhead_m)
      : bins_(static_cast<std::size_t>(std::ceil((overhead_m - kLowestM) / kBinM))),
        counts_(grid.size() * bins_, 0) {}

  void add(std::size_t cell, double height_m) {
    const double bin = std::floor((height_m - kLowestM) / kBinM);
    if (bin >= static_cast<double>(bins_)) return;
    std::uint16_t& count = counts_[cell * bins_ + static_cast<std::size_t>(std::max(bin, 0.0))];
    count = static_cast<std::uint16_t>(std::min(count + 1, 0xFFFF));
  }

  float ground_m(std::size_t cell) const {
    const std::uint16_t* counts = &counts_[cell * bins_];
    int in_band = 0;
    for (std::size_t bin = 0; bin < bins_; ++bin) {
      in_band += counts[bin];
      if (bin >= kBandBins) in_band -= counts[bin - kBandBins];
      if (in_band >= kSupportMin) return mean_m(counts, bin);
    }
    return kUnknown;
  }

 private:
  // The first band that is full enough ends where one did; it may begin a little lower than its
  // lowest point. Then it goes on above: a band begins at its lowest point.
  float mean_m(const std::uint16_t* counts, std::size_t last) const {
    std::size_t first = last + 1 > kBandBins ? last + 1 - kBandBins : 0;
    while (counts[first] == 0) ++first;
    double points = 0, sum_m = 0;
    for (std::size_t bin = first; bin < std::min(first + kBandBins, bins_); ++bin) {
      points += counts[bin];
      sum_m += counts[bin] * (kLowestM + kBinM * (static_cast<double>(bin) + 0.5));
    }
    return static_cast<float>(sum_m / points);
  }

  std::size_t bins_;
  std::vector<std::uint16_t> counts_;
};

class Judge {
 public:
  Judge(const std::vector<float>& heights_m, const RasterGrid& grid, const TerrainLimits& limits)
      : heights_m_(heights_m), grid_(grid), limits_(limits), rise_(std::tan(limits.slope_max_rad)) {
    for (const float height_m : heights_m)
      ground_.push_back(std::isnan(height_m) ? Ground::unknown : Ground::drivable);
  }

  std::vector<Ground> run() {
    for (int y = 0; y < grid_.ny; ++y)
      for (int x = 0; x < grid_.nx; ++x) {
        mark_step(x, y, 1, 0);
        mark_step(x, y, 0, 1);
      }
    std::vector<Ground> judged = ground_;
    for (int y = 0; y < grid_.ny; ++y)
      for (int x = 0; x < grid_.nx; ++x)
        if (ground_[grid_.index(x, y)] == Ground::drivable && is_steep(x, y))
          judged[grid_.index(x, y)] = Ground::slope;
    return judged;
  }

 private:
  bool is_known(int x, int y) const { return !std::isnan(heights_m_[grid_.index(x, y)]); }

  // From the cell to the next known one that way.
  void mark_step(int x, int y, int dx, int dy) {
    if (!is_known(x, y)) return;
    for (int n = 1; n <= kGapCells + 1 && grid_.contains(x + n * dx, y + n * dy); ++n) {
      if (!is_known(x + n * dx, y + n * dy)) continue;
      const double rise_m =
          std::abs(heights_m_[grid_.index(x, y)] - heights_m_[grid_.index(x + n * dx, y + n * dy)]);
      if (rise_m > std::max(limits_.step_max_m, rise_ * n * grid_.cell_m))
        for (int k = 0; k <= n; ++k) ground_[grid_.index(x + k * dx, y + k * dy)] = Ground::step;
      return;
    }
  }

  bool is_steep(int x, int y) const {
    const double reach_cells = reach_m(limits_) / grid_.cell_m;
    const int reach = static_cast<int>(reach_cells);
    int count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // Of x and y in cells, and the height.
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        if (i * i + j * j > reach_cells * reach_cells || !grid_.contains(x + i, y + j)) continue;
        const std::size_t cell = grid_.index(x + i, y + j);
        if (ground_[cell] != Ground::drivable) continue;
        const Eigen::Vector3d at(i, j, heights_m_[cell]);
        ++count;
        sum += at;
        squares += at * at.transpose();
      }
    if (count < kHeightsMin) return false;
    const Eigen::Matrix3d spread = squares - sum * sum.transpose() / count;
    const double determinant = spread.topLeftCorner<2, 2>().determinant();
    if (determinant < 0.5) return false;  // They lie in a line.
    const Eigen::Vector2d per_cell =
        spread.topLeftCorner<2, 2>().inverse() * spread.topRightCorner<2, 1>();
    return per_cell.norm() / grid_.cell_m > rise_;
  }

  const std::vector<float>& heights_m_;
  const RasterGrid& grid_;
  const TerrainLimits& limits_;
  const double rise_;
  std::vector<Ground> ground_;
};

}  // namespace

std::vector<float> ground_heights(const std::vector<Eigen::Vector3f>& W_points_m,
                                  const Eigen::Vector2d& W_scanner_m, const RasterGrid& grid,
                                  const TerrainLimits& limits) {
  Histogram histogram(grid, limits.overhead_m);
  const double range2_m2 = limits.range_max_m * limits.range_max_m;
  for (const Eigen::Vector3f& W_point_m : W_points_m) {
    const Eigen::Vector2d W_at_m = W_point_m.head<2>().cast<double>();
    if ((W_at_m - W_scanner_m).squaredNorm() > range2_m2) continue;
    const Eigen::Vector2d q = (W_at_m - grid.W_min_m) / grid.cell_m;
    const int x = static_cast<int>(std::floor(q.x())), y = static_cast<int>(std::floor(q.y()));
    if (grid.contains(x, y))
      histogram.add(grid.index(x, y), static_cast<double>(W_point_m.z()) - limits.ground_z_m);
  }
  std::vector<float> heights_m(grid.size());
  for (std::size_t cell = 0; cell < grid.size(); ++cell) heights_m[cell] = histogram.ground_m(cell);
  return heights_m;
}

std::vector<Ground> judge_ground(const std::vector<float>& heights_m, const RasterGrid& grid,
                                 const TerrainLimits& limits) {
  return Judge(heights_m, grid, limits).run();
}

}  // namespace nav
