// The beams of a scan as exact segments, and how far each is believed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/values.hpp"
#include "planning/voxel_map.hpp"

namespace planning {

// A point on the lattice of 1/1024 voxel: floor(1024 q) for a point at q voxels from the box's
// corner, taken as the middle of its lattice cell. Coordinates here count 1/2048 voxel and are
// always odd, so a point never lies on a face between voxels and q and its lattice point share a
// voxel. A segment between two such points lies in no face plane; where it passes through an edge
// or a corner it meets the open voxels before and after and no others.
struct LatticePoint {
  std::int64_t x{}, y{}, z{};

  auto operator<=>(const LatticePoint&) const = default;
};
inline constexpr int kLatticeShift = 11;  // Voxel of a coordinate: coordinate >> kLatticeShift.

inline Voxel voxel_of(const LatticePoint& p) {
  return {static_cast<int>(p.x >> kLatticeShift), static_cast<int>(p.y >> kLatticeShift),
          static_cast<int>(p.z >> kLatticeShift)};
}

// Whether the segment meets the inside of the voxel. Exact for coordinates within +-2^30.
bool meets(const LatticePoint& from, const LatticePoint& to, Voxel v);

// The start and end points of all beams of one scan: sines and cosines of the pattern once per
// column and row, or each beam's own origin and direction.
class BeamFan {
 public:
  // Throws std::invalid_argument for a pattern or pose that has no meaning in this grid, and for
  // beams that are not one for each of the pattern's, not of length 1 or start further than
  // kOffsetMax from the scanner. Refers to the scan.
  BeamFan(const VoxelGrid& grid, const hal::ScanCloud& scan, const Eigen::Isometry3d& T_W_S);

  static constexpr double kOffsetMax_m = 2;

  // Where the beam starts.
  LatticePoint start(std::uint32_t column, std::uint32_t row) const {
    return beams_ == nullptr ? scanner_ : at(beam(column, row), 0);
  }
  // Where the beam is after range_m.
  LatticePoint end(std::uint32_t column, std::uint32_t row, float range_m) const {
    if (beams_ != nullptr) return at(beam(column, row), range_m);
    const Direction& h = columns_[column];
    const double along_m = range_m * rows_[row].cos;
    const double up_m = range_m * rows_[row].sin;
    return {on_lattice(base_[0] + (along_m * h[0] + up_m * up_[0])),
            on_lattice(base_[1] + (along_m * h[1] + up_m * up_[1])),
            on_lattice(base_[2] + (along_m * h[2] + up_m * up_[2]))};
  }
  // How fast the beam climbs in W: metres per metre of range.
  double climb(std::uint32_t column, std::uint32_t row) const {
    if (beams_ != nullptr) return W_up_S_.dot(beam(column, row).S_direction.cast<double>());
    return (rows_[row].cos * columns_[column][2] + rows_[row].sin * up_[2]) * lattice_m_;
  }
  // How much higher in W than the scanner the beam starts.
  double start_up_m(std::uint32_t column, std::uint32_t row) const {
    return beams_ == nullptr ? 0 : W_up_S_.dot(beam(column, row).S_origin_m.cast<double>());
  }

  // No beam leaves the pattern's direction by more than this, nor starts further from the scanner.
  double deviation_max_rad() const { return deviation_max_rad_; }
  double offset_max_m() const { return offset_max_m_; }

 private:
  using Direction = std::array<double, 3>;  // 1/1024 voxels per metre, in W.
  struct Elevation {
    double cos, sin;
  };
  static std::int64_t on_lattice(double q) {
    auto floor = static_cast<std::int64_t>(q);
    floor -= static_cast<double>(floor) > q;
    return 2 * floor + 1;
  }

  const hal::Beam& beam(std::uint32_t column, std::uint32_t row) const {
    return beams_[std::size_t{column} * rows_.size() + row];
  }
  LatticePoint at(const hal::Beam& beam, float range_m) const {
    const Eigen::Vector3d q =
        lattice_S_ * (beam.S_origin_m.cast<double>() + range_m * beam.S_direction.cast<double>());
    return {on_lattice(base_[0] + q.x()), on_lattice(base_[1] + q.y()),
            on_lattice(base_[2] + q.z())};
  }
  void measure_beams(const hal::ScanCloud& scan);

  std::vector<Direction> columns_;
  std::vector<Elevation> rows_;
  Direction up_{};
  Direction base_{};
  double lattice_m_{};
  LatticePoint scanner_;
  const hal::Beam* beams_ = nullptr;  // Null: the pattern's.
  Eigen::Matrix3d lattice_S_;         // From metres in S to lattice steps in W.
  Eigen::Vector3d W_up_S_;
  double deviation_max_rad_ = 0, offset_max_m_ = 0;
};

// How far to believe each beam that came back with nothing, in metres; 0 for beams with a return
// (of any range). Size and order as ranges_m.
//
// Why: a beam without return says "empty up to range_max_m" only where there was nothing to hit.
// Real scanners also lose beams on real surfaces: at grazing angles, on glass, on wet or black
// paint. Such drop-outs sit among neighbours that did return; carving through them would tunnel
// into the building and declare its inside seen. So a beam without return is carved only up to the
// nearest return within `window` columns and rows of it, and up to range_max_m when there is none:
// sky is empty in all directions at once. Columns wrap around only if the pattern is a full circle.
// window = 0 believes all (planning as in the paper's own counts).
std::vector<float> trusted_no_returns(const hal::ScanCloud& scan, int window, double range_max_m,
                                      int threads = 1);

// Every beam's reach: the range to its return if that is within limits, what is believed of
// a beam without return (window, ground and wall rule of `config`), 0 if it says nothing.
// Beam i has a return to be marked exactly if ranges_m[i] > 0 and reach_m[i] > 0.
struct BeamReach {
  std::vector<float> reach_m;
  InsertReport counted;  // Only the counts of beams.
};
BeamReach beam_reach(const hal::ScanCloud& scan, const VoxelGrid& grid,
                     const Eigen::Isometry3d& T_W_S, const BeamFan& fan,
                     const InsertConfig& config);

}  // namespace planning
