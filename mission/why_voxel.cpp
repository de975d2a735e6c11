#include "mission/why_voxel.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace mission {
namespace {

std::string place(const planning::VoxelGrid& grid, const planning::Voxel& v) {
  const Eigen::Vector3d m = grid.center_m(v);
  return fmt::format("voxel {},{},{} at ({:.2f}, {:.2f}, {:.2f}) m", v.x, v.y, v.z, m.x(), m.y(),
                     m.z());
}

std::string_view word(planning::VoxelState state) {
  constexpr std::string_view kWords[] = {"unseen", "seen-empty", "seen-occupied"};
  return kWords[static_cast<std::size_t>(state)];
}

ViewCell cell_at(const SiteModel& model, const Eigen::Vector2d& cell_m) {
  const planning::VoxelGrid& grid = model.map().grid();
  const planning::Voxel column = grid.voxel_at({cell_m.x(), cell_m.y(), grid.W_min_m.z()});
  for (const ViewCell& cell : model.cells())
    if (cell.voxel.x == column.x && cell.voxel.y == column.y) return cell;
  throw std::invalid_argument(fmt::format(
      "the scanner can stand nowhere in the cell of ({}, {}) m; name a place in the free "
      "space, such as `vantage nbv --tally FILE` lists",
      cell_m.x(), cell_m.y()));
}

}  // namespace

VoxelAnswer why_voxel(const SiteModel& model, const ScannerConfig& scanner,
                      const planning::Voxel& voxel, const Eigen::Vector2d& cell_m) {
  const planning::VoxelGrid& grid = model.map().grid();
  if (!grid.contains(voxel))
    throw std::invalid_argument(
        fmt::format("{} lies outside the map's box of {} x {} x {} voxels from ({}, {}, {}) m",
                    place(grid, voxel), grid.nx, grid.ny, grid.nz, grid.W_min_m.x(),
                    grid.W_min_m.y(), grid.W_min_m.z()));
  VoxelAnswer answer{voxel, model.map().at(voxel), cell_at(model, cell_m), std::nullopt};
  if (answer.cell.voxel == voxel)
    throw std::invalid_argument("that voxel holds the scanner itself; name another");
  const planning::BoundaryVoxel u = planning::with_exposed_faces(model.map(), voxel);
  if (answer.state == planning::VoxelState::unseen && u.faces != 0)
    answer.view = planning::why_view(model.map(), u, answer.cell.voxel, view_limits(scanner));
  return answer;
}

std::string VoxelAnswer::in_words(const planning::VoxelGrid& grid) const {
  const std::string what = place(grid, voxel);
  if (state != planning::VoxelState::unseen)
    return fmt::format("{} is {} already: no view is counted for it", what, word(state));
  if (!view)
    return fmt::format(
        "{} is unseen, but no neighbour of it is seen-empty: no view is counted for "
        "it before something beside it has been seen",
        what);
  std::string out =
      fmt::format("{}, from ({:.2f}, {:.2f}) m: {}", what, grid.center_m(cell.voxel).x(),
                  grid.center_m(cell.voxel).y(), planning::text(*view));
  if (view->blocker)
    out += fmt::format(" ({} {})", word(view->blocker_state), place(grid, *view->blocker));
  return out;
}

}  // namespace mission
