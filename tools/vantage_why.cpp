// vantage why: why a place on a wall, or a voxel, is not seen from somewhere.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "mission/report_facts.hpp"
#include "mission/why_voxel.hpp"
#include "mission/why_wall.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct WhyOptions {
  SiteOptions site;
  std::filesystem::path map;
  std::string wall, station, voxel, cell;
  double heading_deg{};
  bool index = false;  // `voxel` is indices, not metres.
  bool json = false;
};

boost::json::array xy(const Eigen::Vector2d& point_m) {
  return {point_m.x(), point_m.y()};
}

boost::json::object wall_json(const mission::WallAnswer& answer) {
  const auto& why = answer.why.excluded;
  boost::json::object out{{"ok", true},
                          {"area", answer.area},
                          {"wall_from_m", xy(nav::to_m(answer.wall.a))},
                          {"wall_to_m", xy(nav::to_m(answer.wall.b))},
                          {"counts", answer.wall.target},
                          {"at_m", xy(answer.at_m)},
                          {"off_m", answer.off_m},
                          {"range_m", answer.why.distance_m},
                          {"angle_deg", answer.why.angle_deg},
                          {"covered", !why.has_value()},
                          {"reason", nullptr},
                          {"remedy", nullptr},
                          {"blocked_at_m", nullptr},
                          {"words", answer.in_words()}};
  if (why) {
    out["reason"] = mission::why_text(why).word;
    out["remedy"] = mission::why_text(why).remedy;
  }
  if (answer.blocker) out["blocked_at_m"] = xy(answer.why.W_occluder_m);
  return out;
}

int why_wall(const WhyOptions& options) {
  const Eigen::Vector2d wall_m = parse_xy(options.wall, "--wall");
  const Eigen::Vector2d station_m = parse_xy(options.station, "--station");
  const mission::Prepared site = prepared(options.site, mission::WorldUse::none);
  const mission::WallAnswer answer =
      mission::why_wall(site.config, site.site.map, site.tasks.tasks, wall_m,
                        {station_m, options.heading_deg * std::numbers::pi / 180});
  if (options.json) {
    print_json(wall_json(answer));
  } else {
    fmt::print("{}\n", answer.in_words());
    if (answer.why.excluded) fmt::print("  {}\n", mission::why_text(answer.why.excluded).remedy);
  }
  return kFine;
}

boost::json::array indices(const planning::Voxel& v) {
  return {v.x, v.y, v.z};
}

boost::json::object voxel_json(const mission::VoxelAnswer& answer,
                               const planning::VoxelGrid& grid) {
  constexpr std::string_view kStates[] = {"unseen", "seen_empty", "seen_occupied"};
  boost::json::object out{{"ok", true},
                          {"voxel", indices(answer.voxel)},
                          {"state", kStates[static_cast<std::size_t>(answer.state)]},
                          {"cell", indices(answer.cell.voxel)},
                          {"boundary", answer.view.has_value()},
                          {"verdict", nullptr},
                          {"distance_m", nullptr},
                          {"angle_deg", nullptr},
                          {"blocker", nullptr},
                          {"blocker_state", nullptr},
                          {"words", answer.in_words(grid)}};
  if (!answer.view) return out;
  out["verdict"] = planning::name(answer.view->verdict);
  out["distance_m"] = answer.view->distance_m;
  out["angle_deg"] = answer.view->angle_deg;
  if (!answer.view->blocker) return out;
  out["blocker"] = indices(*answer.view->blocker);
  out["blocker_state"] = kStates[static_cast<std::size_t>(answer.view->blocker_state)];
  return out;
}

planning::Voxel voxel_of(const WhyOptions& options, const planning::VoxelGrid& grid) {
  const std::vector<double> at = parse_numbers(options.voxel, 3, "VOXEL");
  if (!options.index) return grid.voxel_at({at[0], at[1], at[2]});
  for (const double index : at)
    if (index != std::floor(index) || std::abs(index) > 1e9)
      throw Refusal(
          fmt::format("VOXEL must be three whole numbers with --index, found '{}'", options.voxel));
  return {static_cast<int>(at[0]), static_cast<int>(at[1]), static_cast<int>(at[2])};
}

int why_voxel(const WhyOptions& options) {
  const PastSite past = past_site(options.site, options.map);
  const planning::VoxelGrid& grid = past.model.map().grid();
  const mission::VoxelAnswer answer =
      mission::why_voxel(past.model, past.site.config.robot.scanner, voxel_of(options, grid),
                         parse_xy(options.cell, "CELL"));
  if (options.json) {
    boost::json::object object = voxel_json(answer, grid);
    add_remarks(object, past.site);
    print_json(object);
  } else {
    tell_remarks(past.site);
    fmt::print("{}\n", answer.in_words(grid));
  }
  return kFine;
}

int why(const WhyOptions& options) {
  const bool voxel = !options.voxel.empty() && !options.cell.empty() && !options.map.empty();
  const bool wall = !options.wall.empty() && !options.station.empty();
  if (voxel == wall)
    throw Refusal(
        "say what and from where: --wall X,Y --station X,Y, or --map MAP VOXEL CELL (one of both)");
  return voxel ? why_voxel(options) : why_wall(options);
}

}  // namespace

void add_why_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<WhyOptions>();
  auto* command = app.add_subcommand(
      "why", "Says why a place on a wall, or a voxel, is not seen from somewhere");
  command->footer(
      "Examples:\n"
      "  vantage why --site configs/sites/church --wall 12,3.5 --station 20,-4\n"
      "  vantage why --site configs/sites/church --map runs/church 3.5,-2,4.5 20,-4\n"
      "  vantage why --site configs/sites/church --map runs/church --index 6,11,5 20,-4\n"
      "For a voxel without --mission, scanner, robot radius and margin are the run's.\n"
      "Exit: 0 answered, 2 refused (every reason is on stderr, one a line).");
  add_site_options(*command, options->site);
  command->add_option("--wall", options->wall, "A place on a wall: X,Y in metres");
  command->add_option("--station", options->station, "Where the scanner stands: X,Y in metres");
  command->add_option("--heading", options->heading_deg,
                      "Of the scanner, degrees from east; matters below 360 deg field of view");
  command->add_option("--map", options->map, "map.ot, or the folder of the run");
  command->add_option("voxel", options->voxel, "A voxel: X,Y,Z in metres, or indices with --index");
  command->add_option("cell", options->cell, "Where the scanner stands: X,Y in metres");
  command->add_flag("--index", options->index, "VOXEL is indices into the map, from 0");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return why(*options); }); };
  });
}

}  // namespace vantage
