// vantage nbv: what Phase II would do next in the map that a run left behind.
#include <fmt/format.h>

#include <boost/json/value_from.hpp>
#include <memory>
#include <numbers>
#include <optional>

#include "mission/leftover.hpp"
#include "mission/past_run.hpp"
#include "mission/view_times.hpp"
#include "mission/voxel_drawing.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct NbvOptions {
  SiteOptions site;
  std::filesystem::path map, tally, svg;
  int count = 5;
  bool json = false;
};

// What the answer is made of.
struct Views {
  mission::Prepared site;
  std::filesystem::path map_file;
  mission::SiteModel model;
  std::vector<mission::CellTally> cells;  // From the best heading of each.
  std::vector<mission::ViewAhead> ahead;
  mission::ViewTrip trip;  // To these, from the start.
  mission::Leftover leftover;
  std::uint32_t best_voxels{};
  std::size_t above{};  // Cells that see enough.

  int threshold() const { return site.config.phase2.gain_min_voxels; }
  bool stop() const { return above == 0; }
  bool all_around() const { return site.config.robot.scanner.fov_deg >= 360; }
  // What is counted, in words.
  std::string counted() const {
    return site.config.phase2.density_min_ppm2 > 0 ? "boundary and too thinly sampled voxels"
                                                   : "boundary voxels";
  }
  const std::string& area_of(const mission::ViewCell& cell) const {
    return site.tasks.tasks[static_cast<std::size_t>(cell.task)].area.name;
  }
};

mission::ViewTrip trip_to(const std::vector<mission::ViewAhead>& views,
                          const mission::SiteModel& model, const mission::Prepared& site) {
  std::vector<mission::ViewPlace> places;
  for (const mission::ViewAhead& view : views)
    places.push_back({view.cell.task, model.cell_position_m(view.cell).head<2>()});
  const int start_area = site.tasks.start_area;
  std::optional<nav::Roadmap> roads;
  if (start_area >= 0)
    roads = nav::Roadmap::build(site.tasks.tasks[static_cast<std::size_t>(start_area)].area,
                                site.config.robot.body.radius_m);
  return mission::shortest_trip(places, start_area, roads ? &*roads : nullptr,
                                site.tasks.start.position_m);
}

Views look(const NbvOptions& options) {
  PastSite past = past_site(options.site, options.map);
  Views views{std::move(past.site), past.map_file, std::move(past.model), {}, {}, {}, {}, 0, 0};
  const std::vector<mission::CellTally> around = views.model.tally();
  views.cells = views.all_around() ? around : views.model.faced_tally();
  views.ahead = views.model.views_ahead(around, static_cast<std::size_t>(options.count));
  views.trip = trip_to(views.ahead, views.model, views.site);
  views.leftover = views.model.leftover();
  for (const mission::CellTally& cell : views.cells) {
    views.best_voxels = std::max(views.best_voxels, cell.voxels);
    views.above += cell.voxels >= static_cast<std::uint32_t>(views.threshold());
  }
  return views;
}

boost::json::object certificate_json(const planning::StopCertificate& certificate) {
  return {{"proven", certificate.proven()},
          {"pessimistic_voxels", certificate.pessimistic_max()},
          {"optimistic_voxels", certificate.optimistic_voxels()},
          {"threshold_voxels", certificate.threshold_voxels}};
}

// By reason, with the total.
boost::json::object never_visible_json(const mission::Leftover& left) {
  boost::json::object by_reason{{"voxels", left.never_visible_voxels()}};
  for (std::size_t i = 0; i < left.never_visible.size(); ++i)
    by_reason[planning::name(static_cast<planning::ViewVerdict>(i))] = left.never_visible[i];
  return by_reason;
}

double degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

boost::json::value density_json(const mission::SiteModel& model) {
  const mission::DensityFacts density = model.density();
  if (!(density.goal_ppm2 > 0)) return nullptr;
  return {{"goal_points_per_m2", density.goal_ppm2},
          {"surface_voxels", density.surface_voxels},
          {"reached_voxels", density.reached_voxels}};
}

boost::json::object views_json(const Views& views) {
  boost::json::array ahead;
  for (const mission::ViewAhead& view : views.ahead) {
    const Eigen::Vector3d at_m = views.model.cell_position_m(view.cell);
    ahead.push_back(boost::json::object{{"area", views.area_of(view.cell)},
                                        {"x_m", at_m.x()},
                                        {"y_m", at_m.y()},
                                        {"z_m", at_m.z()},
                                        {"heading_deg", degrees(view.heading_rad)},
                                        {"sees_voxels", view.sees_voxels},
                                        {"adds_voxels", view.adds_voxels}});
  }
  const mission::VoxelCounts counts = views.model.counts();
  return {{"ok", true},
          {"site", views.site.site.map.name},
          {"map", views.map_file.generic_string()},
          {"voxel_m", views.model.map().grid().voxel_m},
          {"gain_min_voxels", views.threshold()},
          {"boundary_unseen", counts.boundary_unseen},
          {"set_aside", views.model.set_aside()},
          {"cells", views.cells.size()},
          {"best_voxels", views.best_voxels},
          {"views_above", views.above},
          {"stop", views.stop()},
          {"fov_deg", views.site.config.robot.scanner.fov_deg},
          {"foliage_voxels", views.model.foliage().size()},
          {"density", density_json(views.model)},
          {"next_views", std::move(ahead)},
          {"visiting_order", boost::json::value_from(views.trip.order)},
          {"visiting_by_road", views.trip.by_road},
          {"visiting_road_m", views.trip.road_m},
          {"certificate", certificate_json(views.leftover.certificate)},
          {"never_visible", never_visible_json(views.leftover)}};
}

std::string verdict(const Views& views) {
  if (views.stop())
    return fmt::format("stop: the best cell sees {} {}, below the threshold of {}",
                       views.best_voxels, views.counted(), views.threshold());
  return fmt::format("go on: {} cells see {} {} or more, the best {}", views.above,
                     views.threshold(), views.counted(), views.best_voxels);
}

void print_views(const Views& views) {
  fmt::print("{}\n", verdict(views));
  fmt::print("  {} cells asked; {} boundary unseen voxels, {} set aside after two tries\n",
             views.cells.size(), views.model.counts().boundary_unseen, views.model.set_aside());
  if (const mission::DensityFacts density = views.model.density(); density.goal_ppm2 > 0)
    fmt::print("  {} of {} surface voxels have the {} points per m2 asked for\n",
               density.reached_voxels, density.surface_voxels, density.goal_ppm2);
  if (const std::size_t foliage = views.model.foliage().size(); foliage > 0)
    fmt::print("  views look through {} voxels of foliage\n", foliage);
  if (!views.ahead.empty())
    fmt::print("  #       x m       y m {}    sees     adds  area\n",
               views.all_around() ? "" : "  faces ");
  for (std::size_t i = 0; i < views.ahead.size(); ++i) {
    const mission::ViewAhead& view = views.ahead[i];
    const Eigen::Vector3d at_m = views.model.cell_position_m(view.cell);
    const std::string faces =
        views.all_around() ? "" : fmt::format("{:4.0f} deg", degrees(view.heading_rad));
    fmt::print("{:3} {:9.2f} {:9.2f} {} {:7} {:8}  {}\n", i + 1, at_m.x(), at_m.y(), faces,
               view.sees_voxels, view.adds_voxels, views.area_of(view.cell));
  }
}

void print_trip(const mission::ViewTrip& trip) {
  if (trip.order.size() < 2) return;
  if (trip.by_road == 0) {
    fmt::print("  no road leads from the start to any of them\n");
    return;
  }
  std::string order;
  for (const std::size_t view : trip.order) order += fmt::format(" {}", view + 1);
  fmt::print("  visit them in the order{}: {:.0f} m of road from the start", order, trip.road_m);
  if (trip.by_road < trip.order.size())
    fmt::print("; no road leads to the last {}", trip.order.size() - trip.by_road);
  fmt::print("\n");
}

void print_leftover(const mission::Leftover& left) {
  fmt::print("  {}\n", mission::in_words(left));
  if (left.never_visible_voxels() == 0) return;
  fmt::print("  {} boundary voxels that no cell can see, work for a mast or a drone:",
             left.never_visible_voxels());
  for (std::size_t i = 0; i < left.never_visible.size(); ++i)
    if (left.never_visible[i] > 0)
      fmt::print(" {} {}", planning::name(static_cast<planning::ViewVerdict>(i)),
                 left.never_visible[i]);
  fmt::print("\n");
}

std::string tally_csv(const Views& views) {
  std::string text = "x_m,y_m,z_m,count\n";
  for (const mission::CellTally& cell : views.cells) {
    const Eigen::Vector3d at_m = views.model.cell_position_m(cell.cell);
    text += fmt::format("{},{},{},{}\n", at_m.x(), at_m.y(), at_m.z(), cell.voxels);
  }
  return text;
}

std::string heat_svg(const Views& views) {
  mission::HeatMap heat{
      .title = views.site.site.map.name + ": what a scan from each place would see",
      .subtitle = verdict(views),
      .grid = views.model.map().grid(),
      .cells = views.cells,
      .views = {},
      .never_seen = views.model.never_visible_voxels()};
  if (views.stop()) heat.views_are = "best place left, below the threshold";
  for (const mission::ViewAhead& view : views.ahead)
    heat.views.push_back({views.model.cell_position_m(view.cell).head<2>(),
                          fmt::format("sees {}, adds {}", view.sees_voxels, view.adds_voxels)});
  return mission::heat_map_svg(views.site.site.map, heat);
}

int nbv(const NbvOptions& options) {
  const Views views = look(options);
  if (!options.tally.empty()) write_product(options.tally, tally_csv(views));
  if (!options.svg.empty()) write_product(options.svg, heat_svg(views));
  if (options.json) {
    boost::json::object answer = views_json(views);
    add_remarks(answer, views.site);
    print_json(answer);
  } else {
    tell_remarks(views.site);
    print_views(views);
    print_trip(views.trip);
    print_leftover(views.leftover);
  }
  return kFine;
}

}  // namespace

void add_nbv_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<NbvOptions>();
  auto* command = app.add_subcommand(
      "nbv", "Works out the next best views from the voxel map that a run left behind");
  command->footer(
      "Examples:\n"
      "  vantage nbv --mission configs/missions/fort.toml --map runs/fort\n"
      "  vantage nbv --site path/to/folder --map runs/mine/map.ot --k 3 --json\n"
      "  vantage nbv --site path/to/folder --map runs/mine --tally out.csv --svg heat.svg\n"
      "  vantage nbv --site path/to/folder --map runs/mine --robot configs/robots/narrow.toml\n"
      "Without --mission, voxels, threshold, scanner, its field of view, density goal, foliage, "
      "robot\n"
      "radius and margin are the run's; with one, notes say where it differs from the run.\n"
      "Exit: 0 fine, 2 refused (every reason is on stderr, one a line).");
  add_site_options(*command, options->site);
  command->add_option("--map", options->map, "map.ot, or the folder of the run")->required();
  command->add_option("--k", options->count, "How many views to name")->check(CLI::Range(1, 100));
  command->add_option("--tally", options->tally,
                      "Write what every cell counts: x_m,y_m,z_m,count (CSV)");
  command->add_option("--svg", options->svg, "Draw the counts over the ground into this file");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return nbv(*options); }); };
  });
}

}  // namespace vantage
