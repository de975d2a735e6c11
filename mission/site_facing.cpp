// Which way a scanner that does not see all around faces for its next best views.
#include <algorithm>

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

}  // namespace

// Views come by what they would see all around, the most first, and none sees more from one
// heading. So when the best known sees no less than the next would all around, it is the best of
// all; the views from there on are left out for now.
std::vector<NextView> SiteModel::faced(std::vector<NextView> views) {
  const planning::HorizontalView view(config_.robot.scanner.fov_deg);
  views_left_out_ = false;
  if (view.all_around() || views.empty()) return views;
  const auto worth = worth_seeing();
  std::vector<NextView> known;
  std::uint32_t best = 0;
  std::size_t begin = 0;
  while (begin < views.size() && views[begin].voxels > best) {
    const std::size_t end = std::min(begin + kViewsAtOnce, views.size());
    planning::for_pieces(threads_, end - begin, 1, [&](int, std::size_t i, std::size_t) {
      NextView& at = views[begin + i];
      std::vector<planning::Voxel> voxels = unseen_in_sight(worth, at.cell.voxel);
      for (const planning::Voxel& v : density_.in_sight(planner_map(), at.cell.voxel))
        voxels.push_back(v);
      const auto [heading_rad, seen] = view.best(at.cell.voxel, voxels);
      at.pose.heading_rad = heading_rad;
      at.voxels = seen;
    });
    for (; begin < end; ++begin) {
      best = std::max(best, views[begin].voxels);
      if (views[begin].voxels >= static_cast<std::uint32_t>(config_.phase2.gain_min_voxels))
        known.push_back(views[begin]);
    }
  }
  views_left_out_ = begin < views.size();
  best_voxels_ = best;
  std::ranges::stable_sort(known, std::ranges::greater{}, &NextView::voxels);
  return known;
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
