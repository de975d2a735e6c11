// How a survey chooses its next best views, and what it says when it stops.
#include <algorithm>

#include "mission/leftover.hpp"
#include "mission/survey.hpp"
#include "mission/view_times.hpp"

namespace mission {
namespace {

namespace json = boost::json;

json::array xy(const Eigen::Vector2d& p) {
  return {p.x(), p.y()};
}

}  // namespace

// What is left when no more views are taken, and whether any could have helped.
void Survey::note_leftover(bool stopped_for_gain) {
  record_.leftover = model_->leftover();
  record_.density = model_->density();
  const Leftover& left = *record_.leftover;
  const planning::StopCertificate& certificate = left.certificate;
  if (stopped_for_gain) record_.end += "; " + in_words(left);
  decide({{"t_s", now_s()},
          {"decision", "stop_certificate"},
          {"pessimistic_max", certificate.pessimistic_max()},
          {"optimistic_voxels", certificate.optimistic_voxels()},
          {"threshold", certificate.threshold_voxels},
          {"proven", left.proven()},
          {"never_visible", left.never_visible_voxels()}});
}

std::vector<NextView> Survey::choose_views() {
  std::vector<NextView> views = model_->next_views();
  if (!record_.scans.empty()) record_.scans.back().visible_to_next = model_->best_voxels();
  json::array ahead;
  for (const ViewAhead& view : model_->views_ahead(
           model_->last_tally(), static_cast<std::size_t>(config_.phase2.views_ahead))) {
    json::object object{{"area", task(view.cell.task).area.name},
                        {"at_m", xy(model_->cell_position_m(view.cell).head<2>())},
                        {"sees_voxels", view.sees_voxels},
                        {"adds_voxels", view.adds_voxels}};
    if (config_.robot.scanner.fov_deg < 360) object["heading_rad"] = view.heading_rad;
    ahead.push_back(std::move(object));
  }
  decide({{"t_s", now_s()},
          {"decision", "next_best_view"},
          {"best_voxels", model_->best_voxels()},
          {"gain_min_voxels", config_.phase2.gain_min_voxels},
          {"views_above", std::ranges::count_if(views, &NextView::faced)},
          {"ahead", std::move(ahead)}});
  return views;
}

std::optional<std::size_t> Survey::choose_view(std::vector<NextView>& views,
                                               const Eigen::Vector2d& from_m) {
  const nav::Roadmap* roads = tasks_.start_area < 0
                                  ? nullptr
                                  : &roads_[static_cast<std::size_t>(tasks_.start_area)].roadmap();
  const ViewTimes times(config_, tasks_, roads, from_m);
  const auto chosen = choose(
      views, times, config_.phase2.choose == "gain_per_minute",
      [this](NextView& view) { model_->face(view); },
      static_cast<std::uint32_t>(config_.phase2.gain_min_voxels));
  if (!chosen) return std::nullopt;
  const NextView& view = views[chosen->view];
  json::object decision{{"t_s", now_s()},
                        {"decision", "view"},
                        {"choose", config_.phase2.choose},
                        {"area", task(view.cell.task).area.name},
                        {"at_m", xy(view.pose.position_m)},
                        {"gain_voxels", view.voxels},
                        {"minutes", nullptr},
                        {"voxels_per_minute", nullptr}};
  if (chosen->takes_min) decision["minutes"] = *chosen->takes_min;
  if (chosen->voxels_per_min) decision["voxels_per_minute"] = *chosen->voxels_per_min;
  decide(decision);
  return chosen->view;
}

}  // namespace mission
