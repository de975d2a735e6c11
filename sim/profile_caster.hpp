// What a profile scanner on a pan unit measures, mirror turn by mirror turn: every beam from where
// the pan axis stands at its own time.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>

#include "hal/values.hpp"
#include "sim/scan.hpp"
#include "sim/scene.hpp"

namespace sim {

// The beams of one turn in the scanner's frame L: in its xy plane, counter-clockwise from x.
struct MirrorArc {
  std::uint32_t beams{};
  double angle_first_rad{}, angle_step_rad{};
};

// One mirror turn. Between its first beam and the one after its last the pan axis turns evenly.
struct MirrorTurn {
  std::uint64_t number{};  // Noise depends on (seed, number, beam) only.
  double pan_first_rad{}, pan_end_rad{};
};

class ProfileCaster {
 public:
  // T_P_L: from the scanner's frame to that of the pan axis (S turned). Of the model, the ranges,
  // their noise and the losses count. The scene must outlive it.
  ProfileCaster(const Scene& scene, const ScannerModel& model, const MirrorArc& arc,
                const Eigen::Isometry3d& T_P_L, std::uint64_t seed);
  ~ProfileCaster();

  // ranges_m: turns x beams, one turn after the other; 0 where nothing comes back. The answer does
  // not depend on `threads`, nor on what was cast before. For one thread at a time.
  void cast(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns, int threads,
            std::span<float> ranges_m);
  // The same in two steps: begun by `helpers` threads while this one does something else. One at a
  // time; turns and ranges_m must stay until it is finished or dropped.
  void begin(const Eigen::Isometry3d& T_W_S, std::span<const MirrorTurn> turns, int helpers,
             std::span<float> ranges_m);
  void finish();
  void drop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
