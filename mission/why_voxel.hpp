// Why a place to stand does not see a voxel: the person's question about Phase II. Pure.
#pragma once

#include <optional>
#include <string>

#include "mission/site_model.hpp"
#include "planning/why.hpp"

namespace mission {

struct VoxelAnswer {
  planning::Voxel voxel;
  planning::VoxelState state{};
  ViewCell cell;
  // Empty: the voxel is no boundary unseen one, so nothing counts it from anywhere.
  std::optional<planning::WhyView> view;

  std::string in_words(const planning::VoxelGrid& grid) const;
};

// The cell is that which holds cell_m, at scanner height. Throws std::invalid_argument, in words
// for the user, for a voxel outside the box, a cell where nobody can stand, or the cell's own
// voxel.
VoxelAnswer why_voxel(const SiteModel& model, const ScannerConfig& scanner,
                      const planning::Voxel& voxel, const Eigen::Vector2d& cell_m);

}  // namespace mission
