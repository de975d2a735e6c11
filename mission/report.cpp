#include "mission/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "mission/leftover.hpp"
#include "mission/progress.hpp"
#include "mission/report_html.hpp"
#include "mission/report_parts.hpp"

namespace mission {
namespace {

using html::escaped;
using html::number;
using html::percent;
using report::Facts;

std::string section(std::string_view title, const std::string& inner) {
  return "<section>\n" + html::element("h2", title) + "\n" + inner + "</section>\n";
}

std::string hint(std::string_view text) {
  return html::element("p", text, "hint") + "\n";
}

std::string figure(const std::string& value, const std::string& label) {
  return "<div class=\"figure\">" + html::element("b", value) + html::element("span", label) +
         "</div>\n";
}

std::size_t views_in(const RunRecord& run) {
  return static_cast<std::size_t>(
      std::count_if(run.scans.begin(), run.scans.end(),
                    [](const ScanRecord& scan) { return scan.next_best_view; }));
}

std::optional<double> surface_share(const RunRecord& run) {
  if (!run.truth || run.truth->surface_visible == 0) return std::nullopt;
  return static_cast<double>(run.truth->surface_seen) /
         static_cast<double>(run.truth->surface_visible);
}

std::string heading(const RunRecord& run) {
  const std::string state = run.completed ? "Completed." : "Ended early.";
  return html::element("h1", escaped(run.mission.empty() ? "Survey" : run.mission)) + "\n" +
         html::element("p",
                       fmt::format("site {}, robot {}, seed {}", escaped(run.site),
                                   escaped(run.robot), run.seed),
                       "sub") +
         "\n<p class=\"outcome" + (run.completed ? "" : " early") + "\">" +
         html::element("b", state) + " " + escaped(run.end) + "</p>\n";
}

std::string key_figures(const Facts& facts) {
  const RunRecord& run = facts.record;
  const std::size_t views = views_in(run), stations = run.scans.size() - views;
  std::string out = figure(std::to_string(run.scans.size()),
                           fmt::format("scans: {} stations, {} next best views", stations, views));
  out += figure(percent(facts.all.of_coverable()), "of the coverable target wall covered");
  if (run.truth) out += figure(percent(surface_share(run)), "of the visible surface voxels seen");
  if (!run.scans.empty()) {
    const VoxelCounts& counts = run.scans.back().after;
    out += figure(count_text(counts.seen_occupied),
                  fmt::format("voxels of {} m seen-occupied", run.voxel_m));
    out += figure(count_text(counts.boundary_unseen), "boundary unseen voxels left");
  }
  out += figure(number(run.driven_total_m, 0) + " m", "driven");
  out += figure(duration_text(run.mission_s), "mission time");
  out += figure(std::to_string(run.dropped.size()), "stations dropped");
  return "<div class=\"figures\">\n" + out + "</div>\n";
}

std::string leftover(const RunRecord& run) {
  const std::string text = leftover_text(run);
  return text.empty() ? "" : html::element("p", escaped(text)) + "\n";
}

std::string voxels(const RunRecord& run) {
  return section(
      "Voxels",
      hint(fmt::format("Counts of the whole map after Phase I and after each next best view (NBV), "
                       "as in the paper's Tables I and II. The last column is what the next view "
                       "would see; below {} voxels no further view is taken.",
                       run.gain_min_voxels)) +
          "<div class=\"pair\">\n" + report::voxel_table(run) + "<div>\n" +
          report::voxel_curves(run) + "</div>\n</div>\n" + leftover(run));
}

std::string walls(const Facts& facts) {
  return section(
      "Wall coverage",
      hint("Target: walls that count. Coverable: what some place to stand could see within the "
           "scanner's limits. Planned: by all stations. Covered: by the stations scanned in "
           "Phase I.") +
          report::coverage_table(facts) + "<h3>What is not covered, and why</h3>\n" +
          report::gap_tables(facts));
}

std::string overlap(const Facts& facts) {
  const std::string table = report::overlap_table(facts);
  if (table.empty()) return "";
  return section(
      "How the scans hold together",
      hint("Two stations are linked if they share enough wall for one scan to be registered "
           "against the other. A weak link is the only one between two groups of stations: if "
           "its scans cannot be matched, nothing but the robot's position joins the groups. Fewer "
           "stations than are provable would not do for the same coverage.") +
          table);
}

std::string registration(const RunRecord& run) {
  const std::string table = report::registration_table(run);
  if (table.empty()) return "";
  const RegistrationCounts& counts = run.registration;
  std::string text = fmt::format(
      "<p>{} scans fit those that they overlap, {} of them with directions left to the localizer; "
      "{} overlap no other, {} were refused, {} were taken twice.",
      counts.accepted + counts.held_in_part, counts.held_in_part, counts.alone, counts.refused,
      counts.retaken);
  if (counts.tours_closed > 0)
    text += fmt::format(
        " When a tour closed, {} pairs held the scans together ({} at odds left out), and moved "
        "them by {} mm and {} deg at most.",
        counts.pairs, counts.pairs_odd, number(1000 * counts.moved_max_m, 1),
        number(counts.moved_max_rad * 180 / std::numbers::pi, 3));
  return section("Registration",
                 hint("Where scans stood, by laying them over each other. Figures of the pair that "
                      "overlaps most; strength 1: surfaces face every way alike, 0: the scan could "
                      "slide. Moved: from where the localizer had it.") +
                     text + "</p>\n" + table);
}

std::string truth(const RunRecord& run) {
  if (!run.truth) return "";
  const Truth& judged = *run.truth;
  std::string text = fmt::format(
      "<p><b>{}</b> of the {} surface voxels visible from some reachable ground cell are "
      "seen-occupied ({}).</p>\n",
      count_text(judged.surface_seen), count_text(judged.surface_visible),
      percent(surface_share(run)));
  text += fmt::format(
      "<p>Position error {} m rms, {} m at most; heading error {} deg at most. Mean normalised "
      "squared pose error {} (3 is expected when the claimed covariance is honest).</p>\n",
      number(judged.position_error_rms_m, 3), number(judged.position_error_max_m, 3),
      number(judged.heading_error_max_rad * 180 / std::numbers::pi, 3),
      number(judged.nees_mean, 2));
  return section("Truth against belief",
                 hint("In simulation only: the run judged by the world that it could not see.") +
                     text + report::pose_error_chart(run) + report::pose_table(run));
}

std::string list(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += "<li>" + item + "</li>\n";
  return "<ul class=\"plain\">\n" + out + "</ul>\n";
}

std::string notes(const RunRecord& run) {
  std::vector<std::string> items;
  for (const std::string& note : run.notes) items.push_back(escaped(note));
  return items.empty() ? "" : section("Notes", list(items));
}

std::string repairs(const RunRecord& run) {
  std::vector<std::string> items;
  for (const auto& repair : run.repairs) {
    items.push_back(html::element("b", escaped(repair.where)) + ": " + escaped(repair.what));
  }
  if (items.empty()) return "";
  return section("Repairs to the map",
                 hint("What was changed before the map was used.") + list(items));
}

std::string files(const RunRecord& run, const ProductFacts& products) {
  std::vector<std::string> items;
  items.push_back(
      fmt::format("scans/0001.ply \u2026: {} scans, points in the site frame, each "
                  "with its pose in the header",
                  run.scans.size()));
  items.push_back(fmt::format("cloud.ply: {} points, the first in each cell of {} m",
                              count_text(products.cloud_points), products.cloud_grid_m));
  if (products.cloud_doublings > 0) {
    items.back() +=
        fmt::format(" (the grid was doubled {} times to keep the cloud within its bound)",
                    products.cloud_doublings);
  }
  std::string map = "map.ot: the voxel map, for octovis";
  if (const auto& offset_m = products.map_ot_offset_m) {
    map +=
        fmt::format("; add {}, {}, {} m to its coordinates to get the site frame",
                    number(offset_m->x(), 3), number(offset_m->y(), 3), number(offset_m->z(), 3));
  }
  items.push_back(std::move(map));
  items.push_back("summary.json and decisions.jsonl: this report's numbers, and every decision");
  return section("Files beside this report", list(items));
}

}  // namespace

std::string report_html(const RunRecord& record, const ProductFacts& products) {
  const Facts facts(record);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n";
  out += "<title>" + escaped(record.mission) + ": survey report</title>\n";
  out += "<style>" + std::string(report::style()) + "</style>\n</head>\n<body>\n<main>\n";
  out += heading(record) + key_figures(facts);
  out += notes(record);
  out += section("Site map", report::site_map(facts));
  out += voxels(record);
  out += walls(facts);
  if (!record.dropped.empty()) {
    out += section("Dropped stations", report::dropped_table(record));
  }
  out += section("Stations of Phase I",
                 hint("In an order in which each overlaps those before it enough. Adds: target "
                      "wall not seen by the stations before it. "
                      "Overlaps: seen by one of them already.") +
                     report::station_table(facts));
  out += overlap(facts);
  out += section("Scans", hint("Poses as believed; times since the mission began. Resolved: of the "
                               "boundary unseen voxels that a next best view was predicted to "
                               "see, those no longer unseen.") +
                              report::scan_table(record));
  out += registration(record);
  out += truth(record) + repairs(record) + files(record, products);
  out +=
      "<footer>Vantage survey report. Metres in the site frame: x east, y north, z up; headings "
      "counter-clockwise from east.</footer>\n</main>\n</body>\n</html>\n";
  return out;
}

}  // namespace mission
