#include "planning/why.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "hal/angles.hpp"
#include "nav/words.hpp"

namespace planning {
namespace {

struct OutwardNormal {
  Face face;
  Voxel step;
};
constexpr std::array<OutwardNormal, 6> kNormals{{{kFaceXMinus, {-1, 0, 0}},
                                                 {kFaceXPlus, {1, 0, 0}},
                                                 {kFaceYMinus, {0, -1, 0}},
                                                 {kFaceYPlus, {0, 1, 0}},
                                                 {kFaceZMinus, {0, 0, -1}},
                                                 {kFaceZPlus, {0, 0, 1}}}};

std::int64_t dot(Voxel a, Voxel b) {
  return std::int64_t{a.x} * b.x + std::int64_t{a.y} * b.y + std::int64_t{a.z} * b.z;
}

Voxel from_to(Voxel u, Voxel p) {
  return {p.x - u.x, p.y - u.y, p.z - u.z};
}

// How far the place lies on the outer side of the face that it sees least flatly, in voxels.
std::int64_t most_outward(const BoundaryVoxel& u, Voxel d) {
  std::int64_t most = INT64_MIN;
  for (const auto& [face, step] : kNormals)
    if ((u.faces & face) != 0) most = std::max(most, dot(step, d));
  return most;
}

std::string blocked_text(const WhyView& why) {
  const Voxel v = why.blocker.value_or(Voxel{});
  const std::string at = "voxel (" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " +
                         std::to_string(v.z) + ")";
  return "blocked by " + at +
         (why.blocker_state == VoxelState::unseen
              ? ", which no scan has seen yet: it may be air or not"
              : ", where a scan has seen something");
}

}  // namespace

std::string_view name(ViewVerdict verdict) {
  constexpr std::string_view kNames[] = {"too_far", "too_near", "faces_away", "grazing",
                                         "sparse",  "blocked",  "visible"};
  return kNames[static_cast<std::size_t>(verdict)];
}

ViewVerdict verdict_before_occlusion(const BoundaryVoxel& u, Voxel p, const ViewRule& rule) {
  const Voxel d = from_to(u.v, p);
  const std::int64_t distance2 = dot(d, d), outward = most_outward(u, d);
  if (distance2 > rule.distance2_max()) return ViewVerdict::too_far;
  if (distance2 < rule.distance2_min()) return ViewVerdict::too_near;
  if (outward <= 0) return ViewVerdict::faces_away;
  if (!rule.along_normal(outward * outward, distance2)) return ViewVerdict::grazing;
  const std::int64_t horizontal2 = distance2 - std::int64_t{d.z} * d.z;
  if (!rule.dense(outward * outward, distance2, horizontal2)) return ViewVerdict::sparse;
  return ViewVerdict::visible;
}

WhyView why_view(const VoxelMap& map, const BoundaryVoxel& u, Voxel p, const ViewLimits& limits) {
  if (!map.grid().contains(u.v) || !map.grid().contains(p))
    throw std::invalid_argument("why: voxel and place must be inside the voxel box");
  if ((u.faces & 63) == 0 || u.v == p)
    throw std::invalid_argument("why: need a voxel with an exposed face, and another place");
  const ViewRule rule(limits, map.grid().voxel_m);
  const Voxel d = from_to(u.v, p);
  const double distance = std::sqrt(static_cast<double>(dot(d, d)));
  WhyView why;
  why.limits = limits;
  why.distance_m = distance * map.grid().voxel_m;
  const double cosine = static_cast<double>(most_outward(u, d)) / distance;
  why.angle_deg = hal::degrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
  why.verdict = verdict_before_occlusion(u, p, rule);
  if (why.verdict != ViewVerdict::visible) return why;
  why.blocker = first_between(map, p, u.v);
  if (!why.blocker) return why;
  why.verdict = ViewVerdict::blocked;
  why.blocker_state = map.at(*why.blocker);
  return why;
}

BoundaryVoxel with_exposed_faces(const VoxelMap& map, Voxel u) {
  unsigned faces = 0;
  for (const auto& [face, step] : kNormals)
    if (map.at({u.x + step.x, u.y + step.y, u.z + step.z}) == VoxelState::seen_empty) faces |= face;
  return {u, static_cast<std::uint8_t>(faces)};
}

std::string text(const WhyView& why) {
  const std::string far = nav::in_m(why.distance_m) + " away", angle = nav::in_deg(why.angle_deg);
  switch (why.verdict) {
    case ViewVerdict::too_far:
      return "out of range: " + far + ", the scanner reaches " + nav::in_m(why.limits.range_max_m);
    case ViewVerdict::too_near:
      return "too near: " + far + ", the scanner measures from " +
             nav::in_m(why.limits.range_min_m) + " on";
    case ViewVerdict::faces_away:
      return "faces away: the beam would come from behind (" + angle + " from the outward normal)";
    case ViewVerdict::grazing:
      return "too flat: the beam meets it at " + angle + " from the normal, the limit is " +
             nav::in_deg(why.limits.grazing_max_deg);
    case ViewVerdict::sparse:
      return "too sparse: " + far + ", at " + angle + " from the normal, a scan puts fewer than " +
             nav::decimal(why.limits.density_min_ppm2, 0) + " points per m2 on it";
    case ViewVerdict::blocked:
      return blocked_text(why);
    case ViewVerdict::visible:
      break;
  }
  return "visible: " + far + ", at " + angle + " from the normal";
}

}  // namespace planning
