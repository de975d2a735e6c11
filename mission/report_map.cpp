#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "mission/report_html.hpp"
#include "mission/report_parts.hpp"

namespace mission::report {
namespace {

using Eigen::Vector2d;
using html::escaped;

constexpr double kWidthMax_px = 1060, kHeightMax_px = 940, kMargin_px = 16, kFoot_px = 46;
constexpr std::size_t kTints = 6;

// From metres in W (y up) to the SVG's pixels (y down).
class View {
 public:
  View(const Vector2d& low_m, const Vector2d& high_m) : low_m_(low_m), high_m_(high_m) {
    const Vector2d size_m = (high_m - low_m).cwiseMax(1e-3);
    scale_ = std::min((kWidthMax_px - 2 * kMargin_px) / size_m.x(),
                      (kHeightMax_px - 2 * kMargin_px) / size_m.y());
    width_ = std::max(size_m.x() * scale_ + 2 * kMargin_px, 360.0);
    height_ = size_m.y() * scale_ + 2 * kMargin_px + kFoot_px;
  }

  Vector2d px(const Vector2d& at_m) const {
    return {(width_ - (high_m_ - low_m_).x() * scale_) / 2 + (at_m.x() - low_m_.x()) * scale_,
            kMargin_px + (high_m_.y() - at_m.y()) * scale_};
  }
  double width() const { return width_; }
  double height() const { return height_; }
  double px_per_m() const { return scale_; }

 private:
  Vector2d low_m_, high_m_;
  double scale_{}, width_{}, height_{};
};

class Box {
 public:
  void add(const Vector2d& at_m) {
    low_ = low_.cwiseMin(at_m);
    high_ = high_.cwiseMax(at_m);
  }
  void add(const nav::Polygons& polygons) {
    for (const auto& polygon : polygons) {
      for (const auto& point : polygon.outer) add(nav::to_m(point));
    }
  }
  bool empty() const { return low_.x() > high_.x(); }
  View view() const {
    if (empty()) return {{0, 0}, {1, 1}};
    return {low_, high_};
  }

 private:
  Vector2d low_ = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high_ = Vector2d::Constant(-std::numeric_limits<double>::infinity());
};

View view_of(const RunRecord& run) {
  Box box;
  box.add(run.map.boundary);
  box.add(run.map.obstacles);
  for (const auto& region : run.map.regions) box.add(region.area);
  for (const AreaPlan& plan : run.plans) box.add(plan.area.drivable);
  for (const ScanRecord& scan : run.scans) box.add(scan.believed.position_m);
  for (const DroppedStation& station : run.dropped) box.add(station.planned.position_m);
  return box.view();
}

void append_point(std::string& path, char command, const Vector2d& px) {
  fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", command, px.x(), px.y());
}

std::string ring_path(const nav::Ring& ring, const View& view) {
  std::string path;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    append_point(path, i == 0 ? 'M' : 'L', view.px(nav::to_m(ring[i])));
  }
  return path.empty() ? path : path + "Z";
}

std::string polygons_path(const nav::Polygons& polygons, const View& view) {
  std::string path;
  for (const auto& polygon : polygons) {
    path += ring_path(polygon.outer, view);
    for (const auto& hole : polygon.holes) path += ring_path(hole, view);
  }
  return path;
}

// Points closer than a pixel to the last one drawn are left out, the last one stays.
std::string line_path(const std::vector<Vector2d>& line_m, const View& view) {
  std::string path;
  Vector2d last_px(0, 0);
  for (std::size_t i = 0; i < line_m.size(); ++i) {
    const Vector2d px = view.px(line_m[i]);
    if (i > 0 && i + 1 < line_m.size() && (px - last_px).norm() < 1) continue;
    append_point(path, i == 0 ? 'M' : 'L', px);
    last_px = px;
  }
  return path;
}

std::string drawn(const std::string& path, std::string_view css_class,
                  const std::string& tip = {}) {
  if (path.empty()) return "";
  const std::string title = tip.empty() ? "" : html::element("title", tip);
  return fmt::format("<path d=\"{}\" class=\"{}\" fill-rule=\"evenodd\">{}</path>\n", path,
                     css_class, title);
}

std::string piece_path(const AreaPlan& plan, const planning::WallPiece& piece, const View& view) {
  const auto& wall = plan.walls[static_cast<std::size_t>(piece.wall)];
  std::string path;
  append_point(path, 'M', view.px(wall_point_m(wall, piece.from_m)));
  append_point(path, 'L', view.px(wall_point_m(wall, piece.to_m)));
  return path;
}

// Regions get a tint each, in the order of the map; the plans' areas wear their region's.
std::map<std::string, std::size_t> tints(const RunRecord& run) {
  std::map<std::string, std::size_t> result;
  for (const auto& region : run.map.regions) result.emplace(region.name, result.size() % kTints);
  for (const AreaPlan& plan : run.plans) {
    result.emplace(plan.area.region, result.size() % kTints);
  }
  return result;
}

std::string ground(const RunRecord& run, const View& view) {
  std::string out;
  for (const auto& region : run.map.regions) {
    const auto planned = [&region](const AreaPlan& p) { return p.area.region == region.name; };
    if (std::any_of(run.plans.begin(), run.plans.end(), planned)) continue;
    out += drawn(polygons_path(region.area, view), "unplanned",
                 escaped(region.name) + " (not scanned)");
  }
  const auto tint = tints(run);
  for (const AreaPlan& plan : run.plans) {
    out += drawn(polygons_path(plan.area.drivable, view),
                 fmt::format("free f{}", tint.at(plan.area.region)), escaped(plan.area.name));
  }
  out += drawn(polygons_path(run.map.obstacles, view), "solid");
  out += drawn(polygons_path(run.map.keep_out, view), "keep-out", "keep-out");
  return out + drawn(polygons_path(run.map.boundary, view), "boundary");
}

std::string ways(const RunRecord& run, const View& view) {
  std::string roads, driven, tours;
  for (const AreaPlan& plan : run.plans) {
    for (const auto& line : plan.roadmap_m) roads += line_path(line, view);
    std::vector<Vector2d> tour;
    for (const int station : plan.tour) {
      tour.push_back(nav::to_m(plan.cover.stations[static_cast<std::size_t>(station)].at.position));
    }
    tours += line_path(tour, view);
  }
  for (const auto& leg : run.driven_m) driven += line_path(leg, view);
  // Before anything was driven the order of the stations is all there is.
  return drawn(roads, "road") + (driven.empty() ? drawn(tours, "tour") : drawn(driven, "driven"));
}

std::string walls(const Facts& facts, const View& view) {
  std::string other, covered, missed;
  for (std::size_t i = 0; i < facts.areas.size(); ++i) {
    const AreaPlan& plan = facts.record.plans[i];
    for (const planning::Wall& wall : plan.walls) {
      if (wall.target) continue;
      append_point(other, 'M', view.px(nav::to_m(wall.a)));
      append_point(other, 'L', view.px(nav::to_m(wall.b)));
    }
    for (const auto& piece : facts.areas[i].covered) covered += piece_path(plan, piece, view);
    for (const Gap& gap : facts.areas[i].gaps) {
      const double length_m = gap.piece.to_m - gap.piece.from_m;
      missed += drawn(piece_path(plan, gap.piece, view), "missed",
                      fmt::format("{}: {} m not covered. {}", escaped(plan.area.name),
                                  html::number(length_m, 1), escaped(why_text(gap.why).meaning)));
    }
  }
  return drawn(other, "other") + drawn(covered, "covered") + missed;
}

enum class Shape { robot, hand, view, dropped };

// A numbered sign, and the place it stands for.
struct Badge {
  Vector2d at_px{0, 0};
  Vector2d badge_px{0, 0};
  Shape shape{};
  std::string label;
  std::string tip;
};

std::vector<Badge> badges(const RunRecord& run, const View& view) {
  std::vector<Badge> result;
  for (const DroppedStation& station : run.dropped) {
    const Vector2d at = view.px(station.planned.position_m);
    result.push_back({at, at, Shape::dropped, "",
                      escaped(station.name) + " dropped: " + escaped(station.reason)});
  }
  for (const ScanRecord& scan : run.scans) {
    const Vector2d at = view.px(scan.believed.position_m);
    const Shape shape = scan.next_best_view ? Shape::view
                        : scan.by_hand      ? Shape::hand
                                            : Shape::robot;
    result.push_back({at, at, shape, std::to_string(scan.number),
                      fmt::format("Scan {}: {}", scan.number, escaped(scan.name))});
  }
  return result;
}

// Where a plan was drawn before anything was scanned, the stations stand in for the scans.
std::vector<Badge> planned_badges(const RunRecord& run, const View& view) {
  std::vector<Badge> result;
  int number = 0;
  for (const AreaPlan& plan : run.plans) {
    for (const int station : plan.tour) {
      const auto& at = plan.cover.stations[static_cast<std::size_t>(station)].at;
      const Vector2d px = view.px(nav::to_m(at.position));
      result.push_back({px, px, plan.mode == "manual" ? Shape::hand : Shape::robot,
                        std::to_string(++number),
                        fmt::format("{} {}", escaped(plan.area.name), station + 1)});
    }
  }
  return result;
}

// Pushes signs that lie on each other apart until none do, or 300 rounds are over.
void spread(std::vector<Badge>& signs, const View& view) {
  constexpr double kApart_px = 21;
  for (int round = 0; round < 300; ++round) {
    bool moved = false;
    for (std::size_t i = 0; i < signs.size(); ++i) {
      for (std::size_t j = i + 1; j < signs.size(); ++j) {
        Vector2d between = signs[j].badge_px - signs[i].badge_px;
        const double distance = between.norm();
        if (distance >= kApart_px - 0.1) continue;
        const double angle = 2.4 * static_cast<double>(i + j);  // Same place: any fixed direction.
        between = distance > 1e-6 ? Vector2d(between / distance)
                                  : Vector2d(std::cos(angle), std::sin(angle));
        signs[i].badge_px -= between * (kApart_px - distance) / 2;
        signs[j].badge_px += between * (kApart_px - distance) / 2;
        moved = true;
      }
    }
    for (Badge& sign : signs) {
      sign.badge_px = sign.badge_px.cwiseMax(Vector2d(11, 11))
                          .cwiseMin(Vector2d(view.width() - 11, view.height() - 11));
    }
    if (!moved) return;
  }
}

std::string shape_svg(Shape shape, const Vector2d& at) {
  const double x = at.x(), y = at.y();
  switch (shape) {
    case Shape::robot:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9.5\" class=\"station\"/>", x, y);
    case Shape::hand:
      return fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"18\" height=\"18\" rx=\"3\" class=\"station\"/>",
          x - 9, y - 9);
    case Shape::view:
      return fmt::format("<path d=\"M{0:.1f} {1:.1f}l12 12l-12 12l-12 -12Z\" class=\"nbv\"/>", x,
                         y - 12);
    case Shape::dropped:
      return fmt::format(
          "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"8\" class=\"drop\"/><path d=\"M{2:.1f} "
          "{3:.1f}l9 9m0 -9l-9 9\" class=\"cross\"/>",
          x, y, x - 4.5, y - 4.5);
  }
  return "";
}

std::string badge_svg(const Badge& sign) {
  std::string out = "<g>" + html::element("title", sign.tip);
  if ((sign.badge_px - sign.at_px).norm() > 3) {
    out += fmt::format(
        "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{2:.1f}\" y2=\"{3:.1f}\" class=\"leader\"/>"
        "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"2.2\" class=\"at\"/>",
        sign.at_px.x(), sign.at_px.y(), sign.badge_px.x(), sign.badge_px.y());
  }
  out += shape_svg(sign.shape, sign.badge_px);
  if (!sign.label.empty()) {
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"mark\">{}</text>",
                       sign.badge_px.x(), sign.badge_px.y() + 3.7, sign.label);
  }
  return out + "</g>\n";
}

std::string start_svg(const Vector2d& px) {
  return fmt::format(
      "<path d=\"M{:.1f} {:.1f}l9 9h-3v7h-12v-7h-3Z\" "
      "class=\"start\"><title>start</title></path>\n",
      px.x(), px.y() - 9);
}

std::string signs(const RunRecord& run, const View& view) {
  std::vector<Badge> all = badges(run, view);
  if (run.scans.empty()) {
    const auto planned = planned_badges(run, view);
    all.insert(all.end(), planned.begin(), planned.end());
  }
  spread(all, view);
  std::string out;
  if (run.map.start) out += start_svg(view.px(run.map.start->position_m));
  for (const Badge& sign : all) out += badge_svg(sign);
  return out;
}

// 1, 2 or 5 times a power of ten, about a sixth of the map's width.
double scale_length_m(const View& view) {
  const double wanted_m = view.width() / 6 / view.px_per_m();
  const double power = std::pow(10.0, std::floor(std::log10(wanted_m)));
  return wanted_m >= 5 * power ? 5 * power : wanted_m >= 2 * power ? 2 * power : power;
}

std::string scale_and_north(const View& view) {
  const double y = view.height() - 16, length_m = scale_length_m(view);
  const double right = kMargin_px + length_m * view.px_per_m();
  const double north = view.width() - kMargin_px - 10;
  return fmt::format(
      "<path d=\"M{0} {1:.1f}v6H{2:.1f}v-6\" class=\"scale\"/><text x=\"{3:.1f}\" "
      "y=\"{4:.1f}\">{5} "
      "m</text>\n<path d=\"M{6:.1f} {7:.1f}l6 20l-6 -5l-6 5Z\" class=\"needle\"/><text "
      "x=\"{6:.1f}\" "
      "y=\"{8:.1f}\" text-anchor=\"middle\">N</text>\n",
      kMargin_px, y - 6, right, right + 8, y + 3, length_m, north, y - 22, y + 12);
}

std::string legend_item(const std::string& svg, const std::string& words) {
  return "<li><svg viewBox=\"0 0 30 18\">" + svg + "</svg>" + words + "</li>\n";
}

std::string legend_line(std::string_view css_class, const std::string& words) {
  return legend_item(fmt::format("<path d=\"M2 9H28\" class=\"{}\"/>", css_class), words);
}

std::string legend_area(std::string_view css_class, const std::string& words) {
  return legend_item(
      fmt::format("<rect x=\"2\" y=\"2\" width=\"26\" height=\"14\" class=\"{}\"/>", css_class),
      words);
}

std::string legend_sign(Shape shape, const std::string& words) {
  return legend_item(
      "<g transform=\"translate(15 9) scale(0.75)\">" + shape_svg(shape, {0, 0}) + "</g>", words);
}

std::string legend_ground(const RunRecord& run) {
  std::string out;
  for (const auto& [region, tint] : tints(run)) {
    const auto planned = [&name = region](const AreaPlan& p) { return p.area.region == name; };
    const auto plan = std::find_if(run.plans.begin(), run.plans.end(), planned);
    if (plan == run.plans.end()) {
      out += legend_area("unplanned", escaped(region) + " (not scanned)");
    } else {
      out += legend_area(fmt::format("free f{}", tint),
                         escaped(region) + (plan->mode == "manual" ? " (by hand)" : ""));
    }
  }
  if (!run.map.obstacles.empty()) out += legend_area("solid", "obstacle");
  if (!run.map.keep_out.empty()) out += legend_area("keep-out", "keep-out");
  return out;
}

std::string legend_signs(const RunRecord& run) {
  const auto any = [&run](auto test) {
    return std::any_of(run.scans.begin(), run.scans.end(), test);
  };
  std::string out = legend_sign(Shape::robot, "station, numbered by scan");
  if (any([](const ScanRecord& s) { return s.by_hand && !s.next_best_view; })) {
    out += legend_sign(Shape::hand, "station, set up by hand");
  }
  if (any([](const ScanRecord& s) { return s.next_best_view; })) {
    out += legend_sign(Shape::view, "next best view");
  }
  if (!run.dropped.empty()) out += legend_sign(Shape::dropped, "dropped station");
  if (run.map.start) {
    out += legend_item("<path d=\"M15 1l9 9h-3v7h-12v-7h-3Z\" class=\"start\"/>", "start");
  }
  return out;
}

std::string legend(const RunRecord& run) {
  const bool has_other = std::any_of(run.plans.begin(), run.plans.end(), [](const AreaPlan& plan) {
    return std::any_of(plan.walls.begin(), plan.walls.end(),
                       [](const planning::Wall& wall) { return !wall.target; });
  });
  std::string out = legend_line("covered", "wall covered") + legend_line("missed", "not covered");
  if (has_other) out += legend_line("other", "wall that does not count");
  out += legend_line("road", "roadmap");
  out += run.driven_m.empty() ? legend_line("tour", "order of the stations")
                              : legend_line("driven", "driven");
  return "<ul class=\"legend\">\n" + legend_signs(run) + out + legend_ground(run) + "</ul>\n";
}

constexpr std::string_view kHatch =
    "<defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" "
    "patternTransform=\"rotate(45)\"><line x1=\"0\" y1=\"0\" x2=\"0\" y2=\"7\" "
    "class=\"hatch\"/></pattern></defs>\n";

}  // namespace

std::string site_map(const Facts& facts) {
  const RunRecord& run = facts.record;
  const View view = view_of(run);
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" style=\"max-width: {0:.0f}px\" role=\"img\" "
      "aria-label=\"Site map\">\n",
      view.width(), view.height());
  out += kHatch;
  out += ground(run, view) + ways(run, view) + walls(facts, view) + signs(run, view);
  return out + scale_and_north(view) + "</svg>\n" + legend(run);
}

}  // namespace mission::report
