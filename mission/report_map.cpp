#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "mission/drawing.hpp"
#include "mission/plan.hpp"
#include "mission/report_html.hpp"
#include "mission/report_parts.hpp"

namespace mission::report {
namespace {

using drawing::append_point;
using drawing::drawn;
using drawing::Legend;
using drawing::legend_area;
using drawing::legend_line;
using drawing::LegendItem;
using drawing::line_path;
using drawing::polygons_path;
using drawing::View;
using Eigen::Vector2d;
using html::escaped;

constexpr std::size_t kTints = 6;

View view_of(const RunRecord& run) {
  drawing::Box box;
  box.add(run.map.boundary);
  box.add(run.map.obstacles);
  for (const auto& region : run.map.regions) box.add(region.area);
  for (const AreaPlan& plan : run.plans) box.add(plan.area.drivable);
  for (const ScanRecord& scan : run.scans) box.add(scan.believed.position_m);
  for (const DroppedStation& station : run.dropped) box.add(station.planned.position_m);
  return box.view();
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
    if (plan.way_m.empty()) tours += line_path(tour, view);
    for (const auto& leg : plan.way_m) tours += line_path(leg, view);
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
                        std::to_string(++number), escaped(station_name(plan, station))});
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

LegendItem legend_sign(Shape shape, const std::string& words) {
  return {"<g transform=\"translate(15 9) scale(0.75)\">" + shape_svg(shape, {0, 0}) + "</g>",
          words};
}

void add_ground(const RunRecord& run, Legend& legend) {
  for (const auto& [region, tint] : tints(run)) {
    const auto planned = [&name = region](const AreaPlan& p) { return p.area.region == name; };
    const auto plan = std::find_if(run.plans.begin(), run.plans.end(), planned);
    if (plan == run.plans.end()) {
      legend.push_back(legend_area("unplanned", escaped(region) + " (not scanned)"));
    } else {
      legend.push_back(legend_area(fmt::format("free f{}", tint),
                                   escaped(region) + (plan->mode == "manual" ? " (by hand)" : "")));
    }
  }
  if (!run.map.obstacles.empty()) legend.push_back(legend_area("solid", "obstacle"));
  if (!run.map.keep_out.empty()) legend.push_back(legend_area("keep-out", "keep-out"));
}

void add_signs(const RunRecord& run, Legend& legend) {
  const auto any = [&run](auto test) {
    return std::any_of(run.scans.begin(), run.scans.end(), test);
  };
  const auto by_hand = [](const ScanRecord& s) { return s.by_hand && !s.next_best_view; };
  const bool plan_by_hand =
      run.scans.empty() && std::any_of(run.plans.begin(), run.plans.end(), [](const AreaPlan& p) {
        return p.mode == "manual" && !p.tour.empty();
      });
  legend.push_back(legend_sign(Shape::robot, run.scans.empty() ? "station, numbered as visited"
                                                               : "station, numbered by scan"));
  if (any(by_hand) || plan_by_hand)
    legend.push_back(legend_sign(Shape::hand, "station, set up by hand"));
  if (any([](const ScanRecord& s) { return s.next_best_view; }))
    legend.push_back(legend_sign(Shape::view, "next best view"));
  if (!run.dropped.empty()) legend.push_back(legend_sign(Shape::dropped, "dropped station"));
  if (run.map.start)
    legend.push_back({"<path d=\"M15 1l9 9h-3v7h-12v-7h-3Z\" class=\"start\"/>", "start"});
}

Legend legend_of(const RunRecord& run) {
  const bool has_other = std::any_of(run.plans.begin(), run.plans.end(), [](const AreaPlan& plan) {
    return std::any_of(plan.walls.begin(), plan.walls.end(),
                       [](const planning::Wall& wall) { return !wall.target; });
  });
  Legend legend;
  add_signs(run, legend);
  legend.push_back(legend_line("covered", "wall covered"));
  legend.push_back(legend_line("missed", "not covered"));
  if (has_other) legend.push_back(legend_line("other", "wall that does not count"));
  legend.push_back(legend_line("road", "roadmap"));
  const bool way_known = std::any_of(run.plans.begin(), run.plans.end(),
                                     [](const AreaPlan& p) { return !p.way_m.empty(); });
  legend.push_back(run.driven_m.empty() ? legend_line("tour", way_known ? "way of the tour"
                                                                        : "order of the stations")
                                        : legend_line("driven", "driven"));
  add_ground(run, legend);
  return legend;
}

std::string layers(const Facts& facts, const View& view) {
  const RunRecord& run = facts.record;
  return ground(run, view) + ways(run, view) + walls(facts, view) + signs(run, view);
}

}  // namespace

std::string site_map(const Facts& facts) {
  const View view = view_of(facts.record);
  return drawing::figure(view, "Site map", layers(facts, view)) +
         drawing::legend_html(legend_of(facts.record));
}

std::string site_map_svg(const Facts& facts, const std::string& title,
                         const std::string& subtitle) {
  const View view = view_of(facts.record);
  return drawing::document(view, {.title = title,
                                  .subtitle = subtitle,
                                  .body = layers(facts, view),
                                  .legend = legend_of(facts.record),
                                  .rules = ""});
}

}  // namespace mission::report
