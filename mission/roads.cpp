#include "mission/roads.hpp"

#include <algorithm>
#include <utility>

#include "nav/polygons.hpp"

namespace mission {
namespace {

nav::Polygons squares(const std::vector<Eigen::Vector2d>& centers_m, double side_m) {
  std::vector<nav::Ring> rings;
  for (const Eigen::Vector2d& center_m : centers_m) {
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(side_m / 2);
    const nav::PointMm low = nav::to_mm(center_m - half), high = nav::to_mm(center_m + half);
    rings.push_back({low, {high.x, low.y}, high, {low.x, high.y}});
  }
  return nav::normalise(rings);
}

bool same(const nav::Polygons& a, const nav::Polygons& b) {
  return std::ranges::equal(a, b, [](const nav::Polygon& p, const nav::Polygon& q) {
    return p.outer == q.outer && p.holes == q.holes;
  });
}

}  // namespace

Roads::Roads(nav::FreeArea area, double robot_radius_m)
    : area_(std::move(area)),
      mapped_(area_.drivable),
      open_(area_.drivable),
      robot_radius_m_(robot_radius_m),
      roadmap_(nav::Roadmap::build(area_, robot_radius_m)) {}

void Roads::close_for_good(int scan, const std::vector<Eigen::Vector2d>& centers_m, double side_m) {
  if (centers_m.empty()) return;
  closings_.push_back({scan, squares(centers_m, side_m)});
  open_ = nav::subtract(open_, closings_.back().squares);
}

void Roads::close(const std::vector<Eigen::Vector2d>& centers_m, double side_m, int scan) {
  if (centers_m.empty()) return;
  close_for_good(scan, centers_m, side_m);
  rebuild();
}

void Roads::close_anew(const std::map<int, std::vector<Eigen::Vector2d>>& centers_m,
                       double side_m) {
  std::erase_if(closings_, [](const Closing& closing) { return closing.scan != kNoScan; });
  open_ = mapped_;
  for (const Closing& closing : closings_) open_ = nav::subtract(open_, closing.squares);
  for (const auto& [scan, shown_m] : centers_m) close_for_good(scan, shown_m, side_m);
  openings_ += rebuild();
}

void Roads::close_for_now(const std::vector<Eigen::Vector2d>& centers_m, double side_m) {
  std::vector<Eigen::Vector2d> again_m, new_m;
  for (const Eigen::Vector2d& center_m : centers_m)
    (nav::contains(closed_twice_, nav::to_mm(center_m)) ? again_m : new_m).push_back(center_m);
  close_for_good(kNoScan, again_m, side_m);
  if (!new_m.empty()) closed_for_now_ = nav::unite(closed_for_now_, squares(new_m, side_m));
  if (!centers_m.empty()) rebuild();
}

bool Roads::reopen() {
  if (closed_for_now_.empty()) return false;
  closed_twice_ = nav::unite(closed_twice_, nav::intersect(closed_once_, closed_for_now_));
  closed_once_ = nav::unite(closed_once_, closed_for_now_);
  closed_for_now_.clear();
  openings_ += rebuild();
  return true;
}

bool Roads::rebuild() {
  nav::Polygons drivable = closed_for_now_.empty() ? open_ : nav::subtract(open_, closed_for_now_);
  if (same(drivable, area_.drivable)) return false;  // Closed, or open, already.
  area_.drivable = std::move(drivable);
  area_.standable = nav::offset(area_.drivable, -nav::to_mm({robot_radius_m_, 0}).x);
  roadmap_ = nav::Roadmap::build(area_, robot_radius_m_);
  return true;
}

}  // namespace mission
