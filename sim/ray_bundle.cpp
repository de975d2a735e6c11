#include "sim/ray_bundle.hpp"

#include <embree3/rtcore.h>

#include <algorithm>

namespace sim {
namespace {

constexpr std::size_t kPacket = 16;

void aim(const Scene& scene, const ScannerModel& model, std::span<const BeamRay> rays,
         RTCRayHit16& packet, int* valid) {
  for (std::size_t i = 0; i < kPacket; ++i) {
    valid[i] = i < rays.size() ? -1 : 0;
    const BeamRay& ray = rays[std::min(i, rays.size() - 1)];
    const Eigen::Vector3f origin = (ray.W_origin_m - scene.origin_m()).cast<float>();
    packet.ray.org_x[i] = origin.x();
    packet.ray.org_y[i] = origin.y();
    packet.ray.org_z[i] = origin.z();
    packet.ray.dir_x[i] = static_cast<float>(ray.W_direction.x());
    packet.ray.dir_y[i] = static_cast<float>(ray.W_direction.y());
    packet.ray.dir_z[i] = static_cast<float>(ray.W_direction.z());
    packet.ray.tnear[i] = 0;
    packet.ray.tfar[i] = static_cast<float>(model.range_max_m);
    packet.ray.time[i] = 0;
    packet.ray.mask[i] = ~0u;
    packet.ray.id[i] = packet.ray.flags[i] = 0;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

}  // namespace

void cast_bundle(const Scene& scene, const ScannerModel& model, std::uint64_t key,
                 std::span<const BeamRay> rays, std::span<float> ranges_m) {
  const RangeNoise noise(model);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const auto some = rays.subspan(first, std::min(kPacket, rays.size() - first));
    RTCRayHit16 packet;
    alignas(64) int valid[kPacket];
    aim(scene, model, some, packet, valid);
    rtcIntersect16(valid, scene.embree(), &context, &packet);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const Eigen::Vector3f normal(packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]);
      const Eigen::Vector3f along(packet.ray.dir_x[i], packet.ray.dir_y[i], packet.ray.dir_z[i]);
      ranges_m[first + i] =
          packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
              ? 0.0F
              : noise.reported_m(packet.ray.tfar[i], normal, along, mix(key + some[i].number));
    }
  }
}

void see_people(const World& world, const ScannerModel& model, std::span<const BeamRay> rays,
                std::span<float> ranges_m) {
  if (world.people().empty()) return;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double range_m = world.range_to_people_m(rays[i].W_origin_m, rays[i].W_direction);
    const bool before = ranges_m[i] == 0 || range_m < static_cast<double>(ranges_m[i]);
    if (!before || range_m > model.range_max_m) continue;
    ranges_m[i] = range_m < model.range_min_m ? 0.0F : static_cast<float>(range_m);
  }
}

}  // namespace sim
