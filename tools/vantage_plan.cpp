// vantage plan: Phase I without a robot and without a world.
#include <fmt/format.h>

#include <memory>

#include "mission/json_text.hpp"
#include "mission/plan_preview.hpp"
#include "tools/vantage_command.hpp"
#include "tools/vantage_cover.hpp"

namespace vantage {
namespace {

struct PlanOptions {
  SiteOptions site;
  std::filesystem::path svg, out;
  std::string bound;
  double bound_s = 60;
  bool json = false;
};

// The format goes by the name: the plan file (TOML), or everything (JSON).
void write_plan(const std::filesystem::path& file, const mission::PlanPreview& preview,
                const boost::json::object& as_json) {
  if (file.extension() == ".toml")
    write_product(file, mission::plan_text(mission::plan_of(preview)));
  else if (file.extension() == ".json")
    write_product(file, mission::json_pretty(as_json));
  else
    throw Refusal(
        fmt::format("--out '{}' must end in .toml (stations for a mission's `plan`) or "
                    ".json (everything)",
                    file.string()));
}

// What an integer programme says of every area, beside the planner's own proof.
void add_exact(const PlanOptions& options, const mission::Prepared& site,
               const mission::PlanPreview& preview, boost::json::object& as_json,
               std::string& text) {
  auto& areas = as_json["areas"].as_array();
  for (std::size_t i = 0; i < preview.record.plans.size(); ++i) {
    const mission::AreaPlan& area = preview.record.plans[i];
    const tools::CbcCover exact =
        tools::exact_cover(area, site.config.robot.scanner, options.bound_s,
                           mission::threads_or_all(options.site.threads));
    areas[i].as_object()["cbc"] = {{"stations", exact.sets.size()}, {"at_least", exact.at_least}};
    text += fmt::format("\n{}: CBC covers as much with {} stations, overlap aside; at least {}\n",
                        area.area.name, exact.sets.size(), exact.at_least);
  }
}

int plan(const PlanOptions& options) {
  const mission::Prepared site = prepared(options.site, mission::WorldUse::none);
  const mission::PlanPreview preview = mission::preview_plan(
      site.config, site.site.map, site.tasks, mission::threads_or_all(options.site.threads));
  boost::json::object as_json = mission::preview_json(site.config, preview);
  std::string text = mission::preview_text(site.config, preview);
  if (options.bound == "cbc") add_exact(options, site, preview, as_json, text);
  add_remarks(as_json, site);
  if (!options.out.empty()) write_plan(options.out, preview, as_json);
  if (!options.svg.empty()) write_product(options.svg, mission::preview_svg(preview));
  tell_remarks(site);
  if (options.json)
    print_json(as_json);
  else
    fmt::print("{}", text);
  return kFine;
}

}  // namespace

void add_plan_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<PlanOptions>();
  auto* command = app.add_subcommand(
      "plan",
      "Plans the stations of a site: where, what each adds, how long, what stays uncovered");
  command->footer(
      "Examples:\n"
      "  vantage plan --site configs/sites/church\n"
      "  vantage plan --mission configs/missions/fort.toml --svg fort.svg --json > fort.json\n"
      "  vantage plan --site path/to/folder --robot configs/robots/avenue.toml --out plan.toml\n"
      "A plan.toml may be edited and named by a mission: plan = \"plan.toml\".\n"
      "Exit: 0 fine, 2 refused (every reason is on stderr, one a line).");
  add_site_options(*command, options->site);
  command->add_option("--svg", options->svg, "Draw the plan into this file");
  command->add_option("--out", options->out,
                      "Write the plan: .toml for a mission's `plan`, .json for everything");
  command->add_option("--bound", options->bound, "Also ask an integer programme how few would do")
      ->check(CLI::IsMember({"cbc"}));
  command->add_option("--bound-s", options->bound_s, "Seconds that it may take for each area")
      ->check(CLI::Range(0.1, 86'400.0));
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return plan(*options); }); };
  });
}

}  // namespace vantage
