// Which way a scanner that does not see all around faces for its next best views.
#include <algorithm>
#include <tuple>

#include "mission/site_model.hpp"
#include "planning/best_heading.hpp"
#include "planning/voxel_parallel.hpp"

namespace mission {
namespace {

constexpr std::size_t kViewsAtOnce = 32;

void keep_faced(const planning::HorizontalView& view, const NextView& at,
                std::vector<planning::Voxel>& voxels) {
  std::erase_if(voxels, [&](const planning::Voxel& u) {
    return !view.faces(at.cell.voxel, at.pose.heading_rad, u);
  });
}

void face_to(const planning::HorizontalView& view, const std::vector<planning::Voxel>& voxels,
             NextView& at) {
  const auto [heading_rad, seen] = view.best(at.cell.voxel, voxels);
  at.pose.heading_rad = heading_rad;
  at.voxels = seen;
  at.faced = true;
}

}  // namespace

// Views come by what they would see all around, the most first, and none sees more from one
// heading. So when the best known sees more than the next would all around, it is the best of all;
// the views from there on need not be faced.
std::vector<NextView> SiteModel::faced(std::vector<NextView> views) {
  const planning::HorizontalView view(config_.robot.scanner.fov_deg);
  if (view.all_around() || views.empty()) return views;
  const auto worth = worth_seeing();
  const auto gain_min = static_cast<std::uint32_t>(config_.phase2.gain_min_voxels);
  std::vector<NextView> known;
  std::uint32_t best = 0;
  std::size_t begin = 0;
  while (begin < views.size() && views[begin].voxels >= best) {
    const std::size_t end = std::min(begin + kViewsAtOnce, views.size());
    planning::for_pieces(threads_, end - begin, 1, [&](int, std::size_t i, std::size_t) {
      face_to(view, worth_in_sight(worth, views[begin + i].cell.voxel), views[begin + i]);
    });
    for (; begin < end; ++begin) {
      best = std::max(best, views[begin].voxels);
      if (views[begin].voxels >= gain_min) known.push_back(views[begin]);
    }
  }
  best_voxels_ = best;
  std::ranges::sort(known, {}, [](const NextView& at) {  // Ties as cells_ has them.
    const planning::Voxel& v = at.cell.voxel;
    return std::tuple(-std::int64_t{at.voxels}, at.cell.task, v.y, v.x);
  });
  for (; begin < views.size(); ++begin) {
    views[begin].faced = false;
    known.push_back(views[begin]);
  }
  return known;
}

std::vector<CellTally> SiteModel::faced_tally() {
  std::vector<CellTally> cells = tally();
  const planning::HorizontalView view(config_.robot.scanner.fov_deg);
  if (view.all_around()) return cells;
  const auto worth = worth_seeing();
  planning::for_pieces(threads_, cells.size(), 16, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const planning::Voxel p = cells[i].cell.voxel;
      std::vector<planning::Voxel> voxels = density_.in_sight(planner_map(), p);
      for (const std::uint32_t seen : tally_.visible(p)) voxels.push_back(worth[seen].v);
      cells[i].voxels = view.best(p, voxels).seen;
    }
  });
  return cells;
}

void SiteModel::face(NextView& view) const {
  face_to(planning::HorizontalView(config_.robot.scanner.fov_deg),
          worth_in_sight(worth_seeing(), view.cell.voxel), view);
}

// What is unseen, and what is too thin for a density goal.
std::vector<planning::Voxel> SiteModel::worth_in_sight(
    const std::vector<planning::BoundaryVoxel>& worth, const planning::Voxel& cell) const {
  std::vector<planning::Voxel> voxels = unseen_in_sight(worth, cell);
  for (const planning::Voxel& v : density_.in_sight(planner_map(), cell)) voxels.push_back(v);
  return voxels;
}

std::vector<planning::Voxel> SiteModel::unseen_in_sight(
    const std::vector<planning::BoundaryVoxel>& worth, const planning::Voxel& cell) const {
  std::vector<planning::Voxel> voxels;
  for (const std::uint32_t i :
       planning::visible_from(planner_map(), worth, cell, view_limits(config_.robot.scanner)))
    voxels.push_back(worth[i].v);
  return voxels;
}

void SiteModel::expect(const NextView& view) {
  const planning::HorizontalView horizontal(config_.robot.scanner.fov_deg);
  expected_ = unseen_in_sight(worth_seeing(), view.cell.voxel);
  keep_faced(horizontal, view, expected_);
  auto thin = density_.in_sight(planner_map(), view.cell.voxel);
  keep_faced(horizontal, view, thin);
  density_.expect(std::move(thin));
}

}  // namespace mission
