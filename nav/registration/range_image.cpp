#include "nav/registration/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace nav {
namespace {

constexpr double kBinDeg = 1.5;
constexpr int kColumns = 240, kRows = 120;
constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr float kSlackM = 0.4F, kSlackShare = 0.04F;  // Surfaces slope, scanners scatter.

struct Direction {
  int row, column;
  float range_m;
};

Direction direction_of(const Eigen::Vector3f& p) {
  constexpr double kPerRad = 180 / std::numbers::pi / kBinDeg;
  const float range_m = p.norm();
  const double azimuth = std::atan2(p.y(), p.x()) + std::numbers::pi;
  const double elevation = std::asin(std::clamp(p.z() / range_m, -1.F, 1.F)) + std::numbers::pi / 2;
  return {std::min(kRows - 1, static_cast<int>(elevation * kPerRad)),
          static_cast<int>(azimuth * kPerRad) % kColumns, range_m};
}

}  // namespace

RangeImage::RangeImage(std::span<const Eigen::Vector3f> points_m)
    : bins_(std::size_t{kRows} * kColumns, Bin{kNothing, 0}) {
  for (const auto& p : points_m) {
    if (!(p.squaredNorm() > 0)) continue;
    const Direction d = direction_of(p);
    Bin& bin =
        bins_[static_cast<std::size_t>(d.row) * kColumns + static_cast<std::size_t>(d.column)];
    bin.near_m = std::min(bin.near_m, d.range_m);
    bin.far_m = std::max(bin.far_m, d.range_m);
  }
}

RangeImage::Bin RangeImage::around(int row, int column) const {
  Bin all{kNothing, 0};
  for (int r = std::max(0, row - 1); r <= std::min(kRows - 1, row + 1); ++r) {
    for (int c = column - 1; c <= column + 1; ++c) {
      const auto at = static_cast<std::size_t>(r) * kColumns +
                      static_cast<std::size_t>((c + kColumns) % kColumns);
      all.near_m = std::min(all.near_m, bins_[at].near_m);
      all.far_m = std::max(all.far_m, bins_[at].far_m);
    }
  }
  return all;
}

RangeImage::Sight RangeImage::look(const Eigen::Vector3f& point_m) const {
  if (!(point_m.squaredNorm() > 0)) return Sight::unknown;
  const Direction d = direction_of(point_m);
  const Bin& own =
      bins_[static_cast<std::size_t>(d.row) * kColumns + static_cast<std::size_t>(d.column)];
  if (own.near_m == kNothing) return Sight::unknown;
  const float slack_m = kSlackM + kSlackShare * d.range_m;
  const Bin seen = around(d.row, d.column);
  if (d.range_m < seen.near_m - slack_m) return Sight::in_front;
  return d.range_m > seen.far_m + slack_m ? Sight::behind : Sight::agrees;
}

}  // namespace nav
