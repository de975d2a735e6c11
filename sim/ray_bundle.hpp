// What a few beams of a laser scanner measure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "sim/range_noise.hpp"
#include "sim/scene.hpp"
#include "sim/world.hpp"

namespace sim {

struct BeamRay {
  Eigen::Vector3d W_origin_m;
  Eigen::Vector3d W_direction;  // Unit.
  std::uint64_t number{};       // Noise depends on (key, number) only.
};

// Fastest when neighbours in the list point nearly the same way. 0 where nothing comes back.
void cast_bundle(const Scene& scene, const ScannerModel& model, std::uint64_t key,
                 std::span<const BeamRay> rays, std::span<float> ranges_m);

// People who stand before what these beams met: nearer than the scanner measures, nothing comes
// back.
void see_people(const World& world, const ScannerModel& model, std::span<const BeamRay> rays,
                std::span<float> ranges_m);

}  // namespace sim
