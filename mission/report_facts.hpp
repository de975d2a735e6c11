// What summary and report both derive from a run's record. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mission/record.hpp"

namespace mission {

// A part of a target wall that no scan of Phase I covered. Without a reason of the plan's it was to
// be covered by a station that was not scanned.
struct Gap {
  planning::WallPiece piece;
  std::optional<planning::Excluded> why;
};

// Gaps that run on round the corners of an outline, for one reason.
struct GapStretch {
  Eigen::Vector2d from_m{0, 0}, to_m{0, 0};  // In W.
  double length_m{};
  std::optional<planning::Excluded> why;
};

// Phase I of one area as it went.
struct AreaFacts {
  std::vector<int> scan_of_station;          // Index into RunRecord::scans; -1: not scanned.
  std::vector<int> place_in_tour;            // 1, 2, ...; 0: not on the tour.
  std::vector<planning::WallPiece> covered;  // By the stations scanned; disjoint, by wall.
  std::vector<Gap> gaps;                     // The rest of the target walls; disjoint, by wall.
  double covered_m{};
};

AreaFacts area_facts(const RunRecord& record, const AreaPlan& plan);

// The same as though every station of the tour were scanned; scan_of_station is -1 all the same.
AreaFacts planned_facts(const AreaPlan& plan);

// The area's gaps joined where they continue, longest first.
std::vector<GapStretch> gap_stretches(const AreaPlan& plan, const std::vector<Gap>& gaps);

// Wall lengths over one area or all.
struct Coverage {
  double target_m{};
  double coverable_m{};
  double planned_m{};  // By all planned stations.
  double covered_m{};  // By those scanned.

  std::optional<double> of_coverable() const;  // Empty when there is nothing to cover.
  std::optional<double> of_target() const;
  Coverage& operator+=(const Coverage& other);
};

Coverage coverage_of(const AreaPlan& plan, const AreaFacts& facts);

// An end point of a wall piece in W.
Eigen::Vector2d wall_point_m(const planning::Wall& wall, double along_m);

// A short word for files ("range_max", "not_scanned"), what it means, and what one could do.
struct Why {
  std::string_view word;
  std::string_view meaning;
  std::string_view remedy;
};
// Without a reason: its station was not scanned.
Why why_text(std::optional<planning::Excluded> reason);

// How many voxels the scan with this index turned seen-occupied.
std::int64_t occupied_gained(const RunRecord& record, std::size_t scan);

// How far the scan's believed pose is from its true one; empty outside simulation.
struct PoseError {
  double position_m{};
  double heading_rad{};  // >= 0
};
std::optional<PoseError> pose_error(const ScanRecord& scan);

}  // namespace mission
