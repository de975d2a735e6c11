// vantage route: the way from one place of a site to another, as the robot would drive it.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "mission/drawing.hpp"
#include "mission/pilot.hpp"
#include "nav/polygons.hpp"
#include "nav/roadmap.hpp"
#include "nav/segment_distance.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

namespace draw = mission::drawing;

struct RouteOptions {
  SiteOptions site;
  std::string from, to;
  std::filesystem::path svg;
  bool json = false;
};

// One end of the way: the option that named it, as written, and the place.
struct WayEnd {
  std::string option, text;
  Eigen::Vector2d at_m{0, 0};

  Refusal refuse(const std::string& why) const {
    return Refusal(fmt::format("{} {}: {}", option, text, why));
  }
};

struct FoundRoute {
  const nav::FreeArea& area;
  nav::Roadmap roads;
  nav::Route route;
  double straight_m{}, time_s{};
};

// Where the robot can stand next to a place where it cannot.
std::optional<Eigen::Vector2d> nearest_standing_m(const mission::Prepared& site,
                                                  const Eigen::Vector2d& at_m) {
  std::optional<Eigen::Vector2d> nearest_m;
  for (const mission::AreaTask& task : site.tasks.tasks)
    for (const nav::SegmentMm& edge : nav::edges(task.area.standable)) {
      const Eigen::Vector2d there_m =
          nav::closest_point({nav::to_m(edge.a), nav::to_m(edge.b)}, at_m);
      if (!nearest_m || (there_m - at_m).norm() < (*nearest_m - at_m).norm()) nearest_m = there_m;
    }
  return nearest_m;
}

const nav::FreeArea& area_holding(const mission::Prepared& site, const WayEnd& end) {
  const nav::PointMm at = nav::to_mm(end.at_m);
  bool drivable = false;
  for (const mission::AreaTask& task : site.tasks.tasks) {
    if (nav::contains(task.area.standable, at)) return task.area;
    drivable = drivable || nav::contains(task.area.drivable, at);
  }
  const auto there_m = nearest_standing_m(site, end.at_m);
  const std::string remedy =
      there_m ? fmt::format("the nearest place where it can stand is {:.2f},{:.2f}", there_m->x(),
                            there_m->y())
              : "there is no place where it can stand: a smaller [body] radius_m may find one";
  throw end.refuse(drivable
                       ? fmt::format("closer to an obstacle than the robot's radius of {} m; {}",
                                     site.config.robot.body.radius_m, remedy)
                       : fmt::format("outside the free space of the site; {}", remedy));
}

double bearing_rad(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) {
  return std::atan2(to_m.y() - from_m.y(), to_m.x() - from_m.x());
}

// Begins and ends along the way, so that no turn on the spot counts that nobody asked for.
double route_time_s(const mission::BodyConfig& body, const nav::Route& route) {
  const auto& way_m = route.points_m;
  if (way_m.size() < 2) return 0;
  const hal::Pose2 from{way_m.front(), bearing_rad(way_m[0], way_m[1])};
  const hal::Pose2 to{way_m.back(), bearing_rad(way_m[way_m.size() - 2], way_m.back())};
  return mission::drive_time_s(body, route, from, to);
}

FoundRoute find_route(const mission::Prepared& site, const WayEnd& from, const WayEnd& to) {
  const nav::FreeArea& area = area_holding(site, from);
  if (const nav::FreeArea& other = area_holding(site, to); &other != &area)
    throw to.refuse(
        fmt::format("in area '{}', and {} in '{}': no road for a robot of {} m radius "
                    "connects them; choose both in one area, or a smaller [body] "
                    "radius_m",
                    other.name, from.option, area.name, site.config.robot.body.radius_m));
  nav::Roadmap roads = nav::Roadmap::build(area, site.config.robot.body.radius_m);
  nav::NoRoute why{};
  auto route = roads.route(from.at_m, to.at_m, &why);
  if (!route)
    throw to.refuse(
        fmt::format("{}; choose another place, or a smaller [body] radius_m", nav::name(why)));
  const double time_s = route_time_s(site.config.robot.body, *route);
  return {area, std::move(roads), std::move(*route), (to.at_m - from.at_m).norm(), time_s};
}

std::string route_words(const FoundRoute& answer) {
  return fmt::format(
      "{:.1f} m in {:.0f} s, {:.2f} m clear at the narrowest, {:.1f} m as the crow "
      "flies",
      answer.route.length_m, answer.time_s, answer.route.clearance_min_m, answer.straight_m);
}

std::string place_disc(const draw::View& view, const Eigen::Vector2d& at_m, const char* css_class) {
  const Eigen::Vector2d px = view.px(at_m);
  return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\" class=\"{}\"/>\n", px.x(), px.y(),
                     css_class);
}

std::string route_picture(const mission::Prepared& site, const FoundRoute& answer) {
  const nav::SiteMap& map = site.site.map;
  draw::Box box;
  box.add(map.boundary);
  box.add(map.obstacles);
  box.add(answer.area.drivable);
  const draw::View view = box.view();
  std::string body = draw::drawn(draw::polygons_path(answer.area.standable, view), "free f0") +
                     draw::outlines(map, view);
  for (const auto& road_m : answer.roads.polylines())
    body += draw::drawn(draw::line_path(road_m, view), "road");
  body += draw::drawn(draw::line_path(answer.route.points_m, view), "driven", route_words(answer));
  body += place_disc(view, answer.route.points_m.front(), "start");
  body += place_disc(view, answer.route.points_m.back(), "station");
  return draw::document(
      view, {.title = "Route on " + map.name,
             .subtitle = route_words(answer),
             .body = body,
             .legend = {draw::legend_line("driven", "route, from the green to the dark disc"),
                        draw::legend_line("road", "roads"),
                        draw::legend_area("free f0", "where the robot can stand")},
             .rules = {}});
}

boost::json::object route_json(const FoundRoute& answer) {
  boost::json::array points, clearances;
  for (const Eigen::Vector2d& point_m : answer.route.points_m)
    points.push_back(boost::json::array{point_m.x(), point_m.y()});
  for (const double clear_m : answer.route.clearance_m) clearances.push_back(clear_m);
  return {{"ok", true},
          {"area", answer.area.name},
          {"length_m", answer.route.length_m},
          {"straight_m", answer.straight_m},
          {"clearance_min_m", answer.route.clearance_m.empty()
                                  ? answer.roads.clearance_m(answer.route.points_m.front())
                                  : answer.route.clearance_min_m},
          {"time_s", answer.time_s},
          {"points_m", std::move(points)},
          {"clearance_m", std::move(clearances)}};
}

int route(const RouteOptions& options) {
  const WayEnd from{"--from", options.from, parse_xy(options.from, "--from")};
  const WayEnd to{"--to", options.to, parse_xy(options.to, "--to")};
  const mission::Prepared site = prepared(options.site, mission::WorldUse::none);
  const FoundRoute answer = find_route(site, from, to);
  if (!options.svg.empty()) write_product(options.svg, route_picture(site, answer));
  tell_remarks(site);
  if (!options.json) {
    fmt::print("{}\n", route_words(answer));
    return kFine;
  }
  boost::json::object object = route_json(answer);
  if (!options.svg.empty()) object["svg"] = options.svg.generic_string();
  add_remarks(object, site);
  print_json(object);
  return kFine;
}

}  // namespace

void add_route_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<RouteOptions>();
  auto* command = app.add_subcommand(
      "route",
      "Finds the way that the robot would drive: how long, how narrow, what time it takes");
  command->footer(
      "Examples:\n"
      "  vantage route --site configs/sites/church --from 5,0 --to 29,-9\n"
      "  vantage route --site path/to/folder --from 0,0 --to 12.5,-8 --svg way.svg --json\n"
      "Exit: 0 fine, 2 refused (every reason is on stderr, one a line).");
  add_site_options(*command, options->site);
  command->add_option("--from", options->from, "X,Y in metres, in the site frame")->required();
  command->add_option("--to", options->to, "The same of where it ends")->required();
  command->add_option("--svg", options->svg, "Draw the way into this file");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return route(*options); }); };
  });
}

}  // namespace vantage
