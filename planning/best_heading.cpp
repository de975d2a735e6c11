#include "planning/best_heading.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace planning {
namespace {

std::int64_t nrad(double angle_rad) {
  return std::llround(angle_rad * 1e9);
}

bool overhead(Voxel p, Voxel u) {
  return p.x == u.x && p.y == u.y;
}

// Within [-pi, pi].
std::int64_t azimuth_nrad(Voxel p, Voxel u) {
  return nrad(std::atan2(u.y - p.y, u.x - p.x));
}

}  // namespace

HorizontalView::HorizontalView(double fov_deg) {
  if (!(fov_deg > 0 && fov_deg <= 360))
    throw std::invalid_argument("fov_deg must be above 0 and at most 360");
  fov_nrad_ = fov_deg < 360 ? nrad(fov_deg * std::numbers::pi / 180) / 2 * 2 : kTurnNrad;
}

bool HorizontalView::faces(Voxel p, double heading_rad, Voxel u) const {
  if (all_around() || overhead(p, u)) return true;
  std::int64_t off = (azimuth_nrad(p, u) - nrad(heading_rad)) % kTurnNrad;
  if (off < 0) off += kTurnNrad;
  return std::min(off, kTurnNrad - off) <= fov_nrad_ / 2;
}

HorizontalView::Best HorizontalView::best(Voxel p, const std::vector<Voxel>& voxels) const {
  if (all_around()) return {0, static_cast<std::uint32_t>(voxels.size())};
  std::vector<std::int64_t> azimuths;
  for (const Voxel u : voxels)
    if (!overhead(p, u)) azimuths.push_back(azimuth_nrad(p, u));
  std::sort(azimuths.begin(), azimuths.end());
  const std::size_t count = azimuths.size();
  // Once more around, so that views across +-pi are found.
  for (std::size_t i = 0; i < count; ++i) azimuths.push_back(azimuths[i] + kTurnNrad);

  std::size_t most = 0, first_of_most = 0;
  for (std::size_t first = 0, end = 0; first < count; ++first) {
    while (end < first + count && azimuths[end] - azimuths[first] <= fov_nrad_) ++end;
    if (end - first > most) most = end - first, first_of_most = first;
  }
  Best best{0, static_cast<std::uint32_t>(voxels.size() - count + most)};
  if (most > 0) {
    std::int64_t middle = (azimuths[first_of_most] + azimuths[first_of_most + most - 1]) / 2;
    if (middle >= kTurnNrad / 2) middle -= kTurnNrad;
    best.heading_rad = static_cast<double>(middle) * 1e-9;
  }
  return best;
}

}  // namespace planning
