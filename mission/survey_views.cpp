// How a survey chooses its next best views, and what it says when it stops.
#include <fmt/format.h>

#include <algorithm>
#include <map>

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

// Views to which no road leads now leave all at once, before the robot is sent to each of them only
// to find out. They count again when roads are open again.
void Survey::leave_out(std::vector<NextView>& views, const Eigen::Vector2d& from_m,
                       ViewsLeftOut& left_out) {
  if (tasks_.start_area < 0) return;
  bring_back();
  const Roads& roads = roads_[static_cast<std::size_t>(tasks_.start_area)];
  std::vector<Eigen::Vector2d> at_m;
  for (const NextView& view : views) at_m.emplace_back(view.pose.position_m);
  const std::vector<nav::NoRoute> whys = roads.roadmap().why_not(from_m, at_m);
  std::map<std::string, int> counts;  // By reason.
  std::vector<NextView> within;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const int t = views[i].cell.task;
    const bool here = t == tasks_.start_area;
    if (task(t).mode == AreaMode::manual || (here && whys[i] == nav::NoRoute::none)) {
      within.push_back(views[i]);
      continue;
    }
    ++counts[here ? std::string(nav::name(whys[i])) : "the robot is in another area"];
    left_out.views.push_back(views[i]);
    left_out_.push_back(views[i]);
    model_->exclude(views[i].cell.voxel);
  }
  if (left_out.views.empty()) return;
  left_out_now_ = true;
  views = std::move(within);
  left_out.closed_for_now = roads.is_closed_for_now();
  left_out_at_ = roads.openings();
  json::object reasons;
  for (const auto& [reason, count] : counts) reasons[reason] = count;
  decide({{"t_s", now_s()},
          {"decision", "views_left_out"},
          {"views", left_out.views.size()},
          {"from_m", xy(from_m)},
          {"reasons", std::move(reasons)},
          {"roads_closed_for_now", left_out.closed_for_now}});
}

// What was left out counts again once roads have opened. False: none have.
bool Survey::count_again() {
  if (left_out_.empty() ||
      roads_[static_cast<std::size_t>(tasks_.start_area)].openings() == left_out_at_)
    return false;
  for (const NextView& view : left_out_) model_->include(view.cell.voxel);
  left_out_.clear();
  return true;
}

void Survey::bring_back() {
  const std::size_t views = left_out_.size();
  if (count_again())
    decide({{"t_s", now_s()}, {"decision", "views_brought_back"}, {"views", views}});
}

// Where views were left out: what was closed for now may have gone. False: nothing opened.
bool Survey::open_roads() {
  return !left_out_.empty() && roads_[static_cast<std::size_t>(tasks_.start_area)].reopen();
}

std::string Survey::why_no_view() const {
  std::string reason =
      fmt::format("no next best view would see {} or more unseen voxels (the best sees {})",
                  config_.phase2.gain_min_voxels, model_->best_voxels());
  if (model_->set_aside() > 0)
    reason += fmt::format("; {} voxels stayed unseen after two tries each", model_->set_aside());
  if (!left_out_.empty())
    reason += fmt::format("; {} places were left out, as no road leads there", left_out_.size());
  return reason;
}

void Survey::note_left_out() {
  for (const NextView& view : left_out_)
    record_.left_out.push_back({task(view.cell.task).area.name, view.pose, view.voxels});
  if (!left_out_.empty())
    record_.notes.push_back(fmt::format(
        "{} places for next best views were left out, as no road led there: what only they see "
        "stays unseen; a person may scan there",
        left_out_.size()));
}

std::optional<std::size_t> Survey::choose_view(std::vector<NextView>& views,
                                               const Eigen::Vector2d& from_m,
                                               ViewsLeftOut& left_out) {
  const nav::Roadmap* roads = tasks_.start_area < 0
                                  ? nullptr
                                  : &roads_[static_cast<std::size_t>(tasks_.start_area)].roadmap();
  const ViewTimes times(config_, tasks_, roads, from_m);
  const bool per_minute = config_.phase2.choose == "gain_per_minute";
  const auto pick = [&] {
    return choose(
        views, times, per_minute, [this](NextView& view) { model_->face(view); },
        static_cast<std::uint32_t>(config_.phase2.gain_min_voxels));
  };
  auto chosen = pick();
  const bool none_reached = per_minute ? !chosen : chosen && !chosen->takes_min;
  if (none_reached) {
    leave_out(views, from_m, left_out);
    chosen = pick();
  }
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
