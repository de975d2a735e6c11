// What Phase II leaves: could any view still help, and what can none of them see?
#include "mission/site_model.hpp"
#include "planning/never_visible.hpp"

namespace mission {

std::vector<planning::Voxel> SiteModel::standing_cells() const {
  std::vector<planning::Voxel> standing;
  for (const ViewCell& cell : cells_)
    if (planner_map().at(cell.voxel) == planning::VoxelState::seen_empty)
      standing.push_back(cell.voxel);
  return standing;
}

std::vector<planning::Voxel> SiteModel::never_visible_voxels() const {
  std::vector<planning::Voxel> voxels;
  for (const planning::NeverVisible& voxel :
       planning::never_visible(planner_map(), boundary_, standing_cells(),
                               view_limits(config_.robot.scanner), threads_))
    voxels.push_back(boundary_[voxel.voxel].v);
  return voxels;
}

// Cells that were asked for once are never asked for again, voxels outside the site or set aside
// never count again, and the known ground is never seen-empty: the certificate's premises.
Leftover SiteModel::leftover() const {
  const planning::ViewLimits limits = view_limits(config_.robot.scanner);
  std::vector<planning::Voxel> open;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if (!excluded_[i]) open.push_back(cells_[i].voxel);
  planning::OptimisticConfig optimistic;
  optimistic.never_empty = ground_;
  optimistic.counts = [this](planning::Voxel v) { return is_in_site(v) && !is_set_aside(v); };
  optimistic.threads = threads_;
  Leftover left;
  left.foliage = config_.phase2.foliage;
  left.certificate = planning::stop_certificate(
      planner_map(), worth_seeing(), open, limits,
      static_cast<std::uint32_t>(config_.phase2.gain_min_voxels), optimistic);
  if (const auto& best = left.certificate.optimistic)
    left.optimistic_at_m = map_.grid().center_m(open[best->candidate]).head<2>();
  for (const planning::NeverVisible& voxel :
       planning::never_visible(planner_map(), boundary_, standing_cells(), limits, threads_))
    ++left.never_visible[static_cast<std::size_t>(voxel.reason)];
  return left;
}

}  // namespace mission
