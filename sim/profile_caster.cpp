#include "sim/profile_caster.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "sim/parallel.hpp"
#include "sim/range_noise.hpp"

namespace sim {
namespace {

constexpr std::uint32_t kTile = 4;  // Packets of 4 neighbouring beams of 4 turns after each other,
constexpr std::uint32_t kPacket = kTile * kTile;  // or of so many beams of a single turn.

// A turn about the pan axis.
struct PanTurn {
  double cos = 1, sin = 0;

  static PanTurn of(double pan_rad) { return {std::cos(pan_rad), std::sin(pan_rad)}; }
  PanTurn then(const PanTurn& next) const {
    return {cos * next.cos - sin * next.sin, sin * next.cos + cos * next.sin};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return {cos * p.x() - sin * p.y(), sin * p.x() + cos * p.y(), p.z()};
  }
};

// What a beam meets.
struct Met {
  float distance_m{};  // Infinite: nothing.
  Eigen::Vector3f normal{0, 0, 0}, direction{0, 0, 0};
};

}  // namespace

struct ProfileCaster::Impl {
  const Scene& scene;
  const ScannerModel model;
  const RangeNoise noise;
  const std::uint64_t seed;
  Eigen::Vector3d P_origin_m;
  std::vector<Eigen::Vector3d> P_directions;

  // Up to kTile turns from `first`.
  struct Strip {
    const Impl& of;
    const Eigen::Isometry3d T_W_S;
    std::span<const MirrorTurn> turns;
    std::uint64_t keys[kTile];
    PanTurn steps[kTile];  // The pan axis from beam to beam of each turn.

    std::uint32_t width() const { return turns.size() == 1 ? kPacket : kTile; }  // Beams.
    void aim(std::uint32_t beam, RTCRayHit16& rays, int* valid) const;
    // Calls meets(place among the turns, beam, what it meets) for each beam of each turn.
    template <class Meets>
    void cast(const Meets& meets) const;
  };

  std::uint64_t key(std::uint64_t turn) const { return mix(mix(seed) ^ turn); }
  float reported_m(const Met& met, std::uint64_t bits) const {
    return std::isinf(met.distance_m)
               ? 0.0F
               : noise.reported_m(met.distance_m, met.normal, met.direction, bits);
  }
  void cast_still(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns,
                  std::span<float> ranges_m);
  void cast_strip(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns,
                  float* ranges_m) const;

  // What the beams meet from where turns were cast last with the pan axis standing: until either
  // turns, only the noise is another.
  Eigen::Isometry3d T_W_S_still;
  double pan_still_rad = 0;
  std::vector<Met> met_still;  // Empty: not cast yet.

  std::unique_ptr<ChunkWork<std::function<void(std::size_t)>>> begun;
};

ProfileCaster::ProfileCaster(const Scene& scene, const ScannerModel& model, const MirrorArc& arc,
                             const Eigen::Isometry3d& T_P_L, std::uint64_t seed) {
  std::vector<Eigen::Vector3d> directions;
  for (std::uint32_t i = 0; i < arc.beams; ++i) {
    const double angle = arc.angle_first_rad + i * arc.angle_step_rad;
    directions.emplace_back(T_P_L.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
  }
  impl_ = std::make_unique<Impl>(Impl{scene,
                                      model,
                                      RangeNoise(model),
                                      seed,
                                      T_P_L.translation(),
                                      std::move(directions),
                                      {},
                                      0,
                                      {},
                                      nullptr});
}

ProfileCaster::~ProfileCaster() = default;

void ProfileCaster::Impl::Strip::aim(std::uint32_t beam, RTCRayHit16& rays, int* valid) const {
  const auto beams = static_cast<std::uint32_t>(of.P_directions.size());
  PanTurn pan;
  Eigen::Vector3f origin;
  for (std::uint32_t i = 0; i < kPacket; ++i) {
    const std::uint32_t turn =
        std::min<std::uint32_t>(i / width(), static_cast<std::uint32_t>(turns.size()) - 1);
    const std::uint32_t b = std::min(beam + i % width(), beams - 1);
    valid[i] = i / width() < turns.size() && beam + i % width() < beams ? -1 : 0;
    const MirrorTurn& of_turn = turns[turn];
    const double turned_rad = of_turn.pan_end_rad - of_turn.pan_first_rad;
    // Of the first beam of a packet from its angle, of those behind it from the one before.
    if (i % width() == 0)
      pan = PanTurn::of(of_turn.pan_first_rad + turned_rad * b / beams);
    else if (valid[i] != 0 && turned_rad != 0)
      pan = pan.then(steps[turn]);
    if (i % width() == 0 || turned_rad != 0)
      origin = (T_W_S * (pan * of.P_origin_m) - of.scene.origin_m()).cast<float>();
    const Eigen::Vector3f direction = (T_W_S.linear() * (pan * of.P_directions[b])).cast<float>();
    rays.ray.org_x[i] = origin.x();
    rays.ray.org_y[i] = origin.y();
    rays.ray.org_z[i] = origin.z();
    rays.ray.dir_x[i] = direction.x();
    rays.ray.dir_y[i] = direction.y();
    rays.ray.dir_z[i] = direction.z();
    rays.ray.tnear[i] = 0;
    rays.ray.tfar[i] = static_cast<float>(of.model.range_max_m);
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = ~0u;
    rays.ray.id[i] = rays.ray.flags[i] = 0;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

template <class Meets>
void ProfileCaster::Impl::Strip::cast(const Meets& meets) const {
  const auto beams = static_cast<std::uint32_t>(of.P_directions.size());
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (std::uint32_t beam = 0; beam < beams; beam += width()) {
    RTCRayHit16 rays;
    alignas(64) int valid[kPacket];
    aim(beam, rays, valid);
    rtcIntersect16(valid, of.scene.embree(), &context, &rays);
    for (std::uint32_t i = 0; i < kPacket; ++i) {
      if (!valid[i]) continue;
      const bool any = rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      meets(i / width(), beam + i % width(),
            Met{any ? rays.ray.tfar[i] : std::numeric_limits<float>::infinity(),
                {rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]},
                {rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]}});
    }
  }
}

void ProfileCaster::Impl::cast_still(const Eigen::Isometry3d& T_W_S,
                                     std::span<const MirrorTurn> turns, std::span<float> ranges_m) {
  const std::size_t beams = P_directions.size();
  const double pan_rad = turns.front().pan_first_rad;
  if (met_still.empty() || pan_still_rad != pan_rad || T_W_S_still.matrix() != T_W_S.matrix()) {
    met_still.resize(beams);
    T_W_S_still = T_W_S;
    pan_still_rad = pan_rad;
    const Strip one{*this, T_W_S, turns.first(1), {}, {}};
    one.cast([&](std::uint32_t, std::uint32_t beam, const Met& met) { met_still[beam] = met; });
  }
  for (std::size_t turn = 0; turn < turns.size(); ++turn) {
    const std::uint64_t bits = key(turns[turn].number);
    for (std::size_t beam = 0; beam < beams; ++beam)
      ranges_m[turn * beams + beam] = reported_m(met_still[beam], mix(bits + beam));
  }
}

// Up to kTile turns.
void ProfileCaster::Impl::cast_strip(const Eigen::Isometry3d& T_W_S,
                                     std::span<const MirrorTurn> turns, float* ranges_m) const {
  const std::size_t beams = P_directions.size();
  Strip one{*this, T_W_S, turns, {}, {}};
  for (std::size_t i = 0; i < turns.size(); ++i) {
    one.keys[i] = key(turns[i].number);
    one.steps[i] =
        PanTurn::of((turns[i].pan_end_rad - turns[i].pan_first_rad) / static_cast<double>(beams));
  }
  one.cast([&](std::uint32_t turn, std::uint32_t beam, const Met& met) {
    ranges_m[turn * beams + beam] = reported_m(met, mix(one.keys[turn] + beam));
  });
}

void ProfileCaster::begin(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns,
                          int helpers, std::span<float> ranges_m) {
  drop();
  const bool still = std::ranges::all_of(turns, [&](const MirrorTurn& turn) {
    return turn.pan_first_rad == turns.front().pan_first_rad &&
           turn.pan_end_rad == turn.pan_first_rad;
  });
  if (still) return impl_->cast_still(T_W_S, turns, ranges_m);
  const std::function<void(std::size_t)> cast_one = [=, &of = *impl_](std::size_t strip) {
    const std::size_t first = strip * kTile;
    const std::size_t count = std::min<std::size_t>(kTile, turns.size() - first);
    of.cast_strip(T_W_S, turns.subspan(first, count), &ranges_m[first * of.P_directions.size()]);
  };
  impl_->begun = std::make_unique<ChunkWork<std::function<void(std::size_t)>>>(
      (turns.size() + kTile - 1) / kTile, helpers, cast_one);
}

void ProfileCaster::finish() {
  if (const auto begun = std::exchange(impl_->begun, nullptr)) begun->finish();
}

void ProfileCaster::drop() {
  impl_->begun.reset();
}

void ProfileCaster::cast(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns,
                         int threads, std::span<float> ranges_m) {
  begin(T_W_S, turns, threads - 1, ranges_m);
  finish();
}

}  // namespace sim
