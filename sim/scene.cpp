#include "sim/scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace sim {
namespace {

// One builder thread: the tree, and so the winner among equally distant triangles, repeats.
constexpr const char* kDeviceConfig = "threads=1,set_affinity=0";

void require(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree failed with error " + std::to_string(static_cast<int>(error)));
}

RTCGeometry make_geometry(RTCDevice device, const Mesh& mesh, const Eigen::Vector3d& W_origin_m) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               mesh.W_vertices_m.size()));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  require(device);
  for (const Eigen::Vector3d& vertex : mesh.W_vertices_m)
    for (int axis = 0; axis < 3; ++axis)
      *vertices++ = static_cast<float>(vertex[axis] - W_origin_m[axis]);
  for (const auto& triangle : mesh.triangles) indices = std::copy_n(triangle.data(), 3, indices);
  rtcCommitGeometry(geometry);
  return geometry;
}

RTCRayHit make_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double near_m,
                   double far_m) {
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(from.x());
  query.ray.org_y = static_cast<float>(from.y());
  query.ray.org_z = static_cast<float>(from.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());
  query.ray.tnear = static_cast<float>(near_m);
  query.ray.tfar = static_cast<float>(far_m);
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return query;
}

// The part of a polygon on one side of height z; a triangle cut twice has at most five corners.
struct Corners {
  std::array<Eigen::Vector3d, 6> at;
  int count = 0;
};

Corners cut(const Corners& polygon, double z_m, double side) {
  Corners kept;
  for (int i = 0; i < polygon.count; ++i) {
    const Eigen::Vector3d& a = polygon.at[i];
    const Eigen::Vector3d& b = polygon.at[(i + 1) % polygon.count];
    const double inside_a = side * (a.z() - z_m);
    const double inside_b = side * (b.z() - z_m);
    if (inside_a >= 0) kept.at[kept.count++] = a;
    if ((inside_a > 0 && inside_b < 0) || (inside_a < 0 && inside_b > 0))
      kept.at[kept.count++] = a + (b - a) * (inside_a / (inside_a - inside_b));
  }
  return kept;
}

// Distance in the plane from a point to a convex polygon, 0 inside. Upright polygons are segments.
double distance_m(const Eigen::Vector2d& point, const Corners& polygon) {
  double nearest_m = std::numeric_limits<double>::infinity();
  bool left = true;
  bool right = true;
  for (int i = 0; i < polygon.count; ++i) {
    const Eigen::Vector2d a = polygon.at[i].head<2>();
    const Eigen::Vector2d edge = polygon.at[(i + 1) % polygon.count].head<2>() - a;
    const Eigen::Vector2d to_point = point - a;
    const double turn = edge.x() * to_point.y() - edge.y() * to_point.x();
    left = left && turn > 0;
    right = right && turn < 0;
    const double length2 = edge.squaredNorm();
    const double along = length2 > 0 ? std::clamp(to_point.dot(edge) / length2, 0.0, 1.0) : 0;
    nearest_m = std::min(nearest_m, (to_point - along * edge).norm());
  }
  return left || right ? 0 : nearest_m;
}

struct ClearanceQuery {
  const Scene& scene;
  Eigen::Vector2d W_point;
  double low_z_m, high_z_m;
  double nearest_m;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<ClearanceQuery*>(arguments->userPtr);
  const auto triangle = query.scene.corners_m(arguments->primID);
  Corners polygon;
  for (const Eigen::Vector3d& corner : triangle) polygon.at[polygon.count++] = corner;
  polygon = cut(cut(polygon, query.low_z_m, 1), query.high_z_m, -1);
  if (polygon.count > 0)
    query.nearest_m = std::min(query.nearest_m, distance_m(query.W_point, polygon));
  return false;  // The query's own radius stays.
}

}  // namespace

void Scene::Release::operator()(RTCDeviceTy* device) const {
  rtcReleaseDevice(device);
}

void Scene::Release::operator()(RTCSceneTy* scene) const {
  rtcReleaseScene(scene);
}

Scene::Scene(const Mesh& mesh) : W_vertices_m_(mesh.W_vertices_m), triangles_(mesh.triangles) {
  if (mesh.triangles.empty()) throw std::invalid_argument("a scene needs triangles");
  W_origin_m_ = mesh.bounds_m().center();
  device_.reset(rtcNewDevice(kDeviceConfig));
  if (!device_) require(nullptr);
  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry geometry = make_geometry(device_.get(), mesh, W_origin_m_);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
  require(device_.get());
}

std::optional<Hit> Scene::cast(const Eigen::Vector3d& W_from, const Eigen::Vector3d& W_direction,
                               double near_m, double far_m) const {
  RTCRayHit query = make_ray(W_from - W_origin_m_, W_direction, near_m, far_m);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.ray.tfar, query.hit.primID};
}

int Scene::first_clear(std::span<const Sight> W_segments, double near_m) const {
  constexpr int kSights = 16;
  const auto count = static_cast<int>(W_segments.size());
  if (count > kSights) throw std::length_error("first_clear takes at most 16 segments");
  if (count == 0) return -1;
  RTCRay16 rays;
  alignas(64) int valid[kSights];
  for (int i = 0; i < kSights; ++i) {
    valid[i] = i < count ? -1 : 0;
    const Sight& sight = W_segments[i < count ? i : 0];
    const Eigen::Vector3d way = sight.to - sight.from;
    const double length_m = way.norm();
    const RTCRay ray = make_ray(sight.from - W_origin_m_, way / length_m, near_m, length_m).ray;
    rays.org_x[i] = ray.org_x;
    rays.org_y[i] = ray.org_y;
    rays.org_z[i] = ray.org_z;
    rays.dir_x[i] = ray.dir_x;
    rays.dir_y[i] = ray.dir_y;
    rays.dir_z[i] = ray.dir_z;
    rays.tnear[i] = ray.tnear;
    rays.tfar[i] = ray.tfar;
    rays.time[i] = 0;
    rays.mask[i] = ~0u;
    rays.id[i] = rays.flags[i] = 0;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, scene_.get(), &context, &rays);
  for (int i = 0; i < count; ++i)
    if (!(rays.tfar[i] < 0)) return i;
  return -1;
}

std::vector<double> Scene::heights_below(const Eigen::Vector3d& W_from, double depth_m) const {
  constexpr double kApart_m = 1e-3;  // Surfaces closer than this count once.
  std::vector<double> heights_m;
  for (double near_m = 0; near_m <= depth_m;) {
    const auto hit = cast(W_from, -Eigen::Vector3d::UnitZ(), near_m, depth_m);
    if (!hit) break;
    heights_m.push_back(W_from.z() - hit->distance_m);
    near_m = hit->distance_m + kApart_m;
  }
  return heights_m;
}

double Scene::clearance_m(const Eigen::Vector2d& W_point, double low_z_m, double high_z_m,
                          double limit_m) const {
  ClearanceQuery query{*this, W_point, low_z_m, high_z_m, limit_m};
  const double half_m = (high_z_m - low_z_m) / 2;
  const Eigen::Vector3d middle =
      Eigen::Vector3d(W_point.x(), W_point.y(), low_z_m + half_m) - W_origin_m_;
  RTCPointQuery sphere{};
  sphere.x = static_cast<float>(middle.x());
  sphere.y = static_cast<float>(middle.y());
  sphere.z = static_cast<float>(middle.z());
  sphere.radius = static_cast<float>(std::hypot(limit_m, half_m)) + 1e-3f;  // Float error's share.
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.get(), &sphere, &context, visit_triangle, &query);
  return query.nearest_m;
}

std::array<Eigen::Vector3d, 3> Scene::corners_m(std::uint32_t triangle) const {
  const auto& t = triangles_[triangle];
  return {W_vertices_m_[t[0]], W_vertices_m_[t[1]], W_vertices_m_[t[2]]};
}

}  // namespace sim
