// Why a view does not see a voxel: the answer to the operator's question, with its numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planning/next_best_view.hpp"

namespace planning {

// What becomes of a voxel at a place, in the order in which it is asked: range, then the angle at
// which an exposed face is met, then what lies between. Later is further.
enum class ViewVerdict {
  too_far,
  too_near,
  faces_away,  // The place is on the inner side of every exposed face.
  grazing,     // A face is seen from its outer side, but at too flat an angle.
  sparse,      // At a fair angle, but with fewer points than ViewLimits::density_min_ppm2.
  blocked,
  visible
};
std::string_view name(ViewVerdict verdict);  // "too_far"

// Range and angle only: `visible` where ViewRule::admits(u, p).
ViewVerdict verdict_before_occlusion(const BoundaryVoxel& u, Voxel p, const ViewRule& rule);

struct WhyView {
  ViewVerdict verdict{};
  double distance_m{};  // Between the centres.
  // Between the beam and the normal of the exposed face that p sees least flatly; above 90 deg if
  // all face away.
  double angle_deg{};
  std::optional<Voxel> blocker;  // The first from p's side.
  VoxelState blocker_state{};    // unseen or seen_occupied
  ViewLimits limits;
};

// Whether p sees u, as Counts(p) has it, and if not what stands against it first. u: at least one
// exposed face; both inside the box, and not the same. Throws std::invalid_argument otherwise.
WhyView why_view(const VoxelMap& map, const BoundaryVoxel& u, Voxel p, const ViewLimits& limits);

// u as boundary_unseen() lists it; without faces if nothing beside it is seen-empty. Any state.
BoundaryVoxel with_exposed_faces(const VoxelMap& map, Voxel u);

// "out of range: 112.4 m away, the scanner reaches 100.0 m"
std::string text(const WhyView& why);

}  // namespace planning
