#include "planning/never_visible.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

// All candidates, ordered by y, and the box that holds them.
class Places {
 public:
  explicit Places(std::vector<Voxel> candidates) : by_y_(std::move(candidates)) {
    std::sort(by_y_.begin(), by_y_.end(), [](Voxel a, Voxel b) {
      return std::array{a.y, a.x, a.z} < std::array{b.y, b.x, b.z};
    });
    for (const Voxel p : by_y_) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y), std::max(high_.z, p.z)};
    }
  }

  ViewVerdict furthest(const BoundaryVoxel& u, const ViewRule& rule) const;

 private:
  // Whether a place in the box is on the outer side of one of the faces.
  bool may_face(const BoundaryVoxel& u) const {
    const auto faces = [&](Face face, bool may) { return (u.faces & face) != 0 && may; };
    return faces(kFaceXMinus, low_.x < u.v.x) || faces(kFaceXPlus, high_.x > u.v.x) ||
           faces(kFaceYMinus, low_.y < u.v.y) || faces(kFaceYPlus, high_.y > u.v.y) ||
           faces(kFaceZMinus, low_.z < u.v.z) || faces(kFaceZPlus, high_.z > u.v.z);
  }

  static constexpr int kFar = std::numeric_limits<int>::max();
  std::vector<Voxel> by_y_;
  Voxel low_{kFar, kFar, kFar}, high_{-kFar, -kFar, -kFar};
};

ViewVerdict Places::furthest(const BoundaryVoxel& u, const ViewRule& rule) const {
  const ViewVerdict limit = may_face(u) ? ViewVerdict::visible : ViewVerdict::faces_away;
  ViewVerdict most = ViewVerdict::too_far;
  // True while it is worth asking on: rows beyond the range are all too far.
  const auto ask = [&](Voxel p) {
    const std::int64_t y = p.y - u.v.y;
    if (y * y > rule.distance2_max()) return false;
    most = std::max(most, verdict_before_occlusion(u, p, rule));
    return most < limit;
  };
  const auto middle =
      std::lower_bound(by_y_.begin(), by_y_.end(), u.v.y, [](Voxel p, int y) { return p.y < y; });
  for (auto p = middle; p != by_y_.end() && ask(*p); ++p) {
  }
  for (auto p = middle; p != by_y_.begin() && most < limit && ask(*(p - 1)); --p) {
  }
  // That nothing lies between cannot be: it would be seen.
  return most == ViewVerdict::visible ? ViewVerdict::blocked : most;
}

}  // namespace

std::vector<NeverVisible> never_visible(const VoxelMap& map,
                                        const std::vector<BoundaryVoxel>& boundary,
                                        const std::vector<Voxel>& candidates,
                                        const ViewLimits& limits, int threads) {
  const std::vector<std::uint8_t> seen = seen_by_any(map, boundary, candidates, limits, threads);
  const ViewRule rule(limits, map.grid().voxel_m);
  const Places places(candidates);
  std::vector<NeverVisible> result;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] == 0) result.push_back({static_cast<std::uint32_t>(i), {}});
  for_pieces(threads, result.size(), 64, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      result[i].reason = places.furthest(boundary[result[i].voxel], rule);
  });
  return result;
}

}  // namespace planning
