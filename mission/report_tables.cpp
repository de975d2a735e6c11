#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "mission/progress.hpp"
#include "mission/report_html.hpp"
#include "mission/report_parts.hpp"

namespace mission::report {
namespace {

using html::Align;
using html::Column;
using html::escaped;
using html::number;
using html::percent;
using html::Table;

constexpr double kGapShown_m = 0.5;
constexpr std::size_t kGapsAtOnce = 20;

std::string degrees(double angle_rad, int decimals) {
  return number(angle_rad * 180 / std::numbers::pi, decimals);
}

// Headings as 0 to 360 degrees, counter-clockwise from east.
std::string heading(double heading_rad) {
  const double turn = std::remainder(heading_rad, 2 * std::numbers::pi);
  return degrees(turn < 0 ? turn + 2 * std::numbers::pi : turn, 0);
}

std::string at_text(const Eigen::Vector2d& point_m) {
  return fmt::format("{}, {}", number(point_m.x(), 1), number(point_m.y(), 1));
}

std::vector<std::string> voxel_row(const std::string& label, const ScanRecord& scan) {
  return {label, count_text(scan.after.seen_occupied), count_text(scan.after.unseen),
          count_text(scan.after.boundary_unseen), count_text(scan.visible_to_next)};
}

std::vector<std::string> coverage_row(const std::string& name, const std::string& mode,
                                      const std::string& stations, const std::string& tour,
                                      const Coverage& coverage) {
  return {name,
          mode,
          stations,
          tour,
          number(coverage.target_m, 1),
          number(coverage.coverable_m, 1),
          number(coverage.planned_m, 1),
          number(coverage.covered_m, 1),
          html::element("b", percent(coverage.of_coverable())),
          percent(coverage.of_target())};
}

std::size_t stations_scanned(const AreaFacts& facts) {
  return static_cast<std::size_t>(std::count_if(facts.scan_of_station.begin(),
                                                facts.scan_of_station.end(),
                                                [](int scan) { return scan >= 0; }));
}

struct AreaGap {
  const AreaPlan* plan;
  GapStretch stretch;
};

std::vector<AreaGap> all_gaps(const Facts& facts) {
  std::vector<AreaGap> gaps;
  for (std::size_t i = 0; i < facts.areas.size(); ++i) {
    const AreaPlan& plan = facts.record.plans[i];
    for (const GapStretch& stretch : gap_stretches(plan, facts.areas[i].gaps)) {
      gaps.push_back({&plan, stretch});
    }
  }
  std::stable_sort(gaps.begin(), gaps.end(), [](const AreaGap& a, const AreaGap& b) {
    return a.stretch.length_m > b.stretch.length_m;
  });
  return gaps;
}

// Lengths by reason: what all the gaps, long and short, come from.
std::string gap_reasons(const std::vector<AreaGap>& gaps) {
  struct Sum {
    double length_m{};
    int longer{};
    std::optional<planning::Excluded> why;
  };
  std::map<std::string, Sum> sums;
  for (const AreaGap& gap : gaps) {
    Sum& sum = sums[std::string(why_text(gap.stretch.why).word)];
    sum.length_m += gap.stretch.length_m;
    sum.longer += gap.stretch.length_m > kGapShown_m ? 1 : 0;
    sum.why = gap.stretch.why;
  }
  std::vector<Sum> order;
  for (const auto& [word, sum] : sums) order.push_back(sum);
  std::stable_sort(order.begin(), order.end(),
                   [](const Sum& a, const Sum& b) { return a.length_m > b.length_m; });
  Table table({{"Why it is not covered", Align::text},
               {"Wall m"},
               {"Pieces over 0.5 m"},
               {"What one could do", Align::text}});
  for (const Sum& sum : order) {
    const Why why = why_text(sum.why);
    table.row({escaped(why.meaning), number(sum.length_m, 1), std::to_string(sum.longer),
               escaped(why.remedy)});
  }
  return table.html();
}

std::string gap_list(const std::vector<AreaGap>& gaps, std::size_t from, std::size_t to) {
  Table table({{"Area", Align::word},
               {"From x, y m"},
               {"To x, y m"},
               {"Length m"},
               {"Reason", Align::text}});
  for (std::size_t i = from; i < to; ++i) {
    const GapStretch& stretch = gaps[i].stretch;
    table.row({escaped(gaps[i].plan->area.name), at_text(stretch.from_m), at_text(stretch.to_m),
               number(stretch.length_m, 1), escaped(why_text(stretch.why).meaning)});
  }
  return table.html();
}

std::string scan_cell(const Facts& facts, const AreaPlan& plan, std::size_t area,
                      std::size_t station) {
  const int scan = facts.areas[area].scan_of_station[station];
  if (scan >= 0) return std::to_string(facts.record.scans[static_cast<std::size_t>(scan)].number);
  return plan.tour.empty() || facts.areas[area].place_in_tour[station] == 0 ? "not reachable"
                                                                            : "not scanned";
}

// A station's name says its area; a next best view's does not.
std::string scan_name(const ScanRecord& scan) {
  return escaped(scan.next_best_view ? scan.name + " (" + scan.area + ")" : scan.name);
}

std::string resolved_cell(const ScanRecord& scan) {
  if (!scan.next_best_view) return "";
  return fmt::format("{} / {}", count_text(scan.resolved_voxels),
                     count_text(scan.predicted_voxels));
}

}  // namespace

Facts::Facts(const RunRecord& run, std::vector<AreaFacts> facts)
    : record(run), areas(std::move(facts)) {
  for (std::size_t i = 0; i < areas.size(); ++i) all += coverage_of(run.plans[i], areas[i]);
}

Facts::Facts(const RunRecord& run)
    : Facts(run, [&run] {
        std::vector<AreaFacts> facts;
        for (const AreaPlan& plan : run.plans) facts.push_back(area_facts(run, plan));
        return facts;
      }()) {}

Facts Facts::as_planned(const RunRecord& run) {
  std::vector<AreaFacts> facts;
  for (const AreaPlan& plan : run.plans) facts.push_back(planned_facts(plan));
  return {run, std::move(facts)};
}

std::string voxel_table(const RunRecord& run) {
  Table table({{"At the end of", Align::word},
               {"Seen-occupied"},
               {"Total unseen"},
               {"Boundary unseen"},
               {"Visible to NBV"}});
  const auto is_view = [](const ScanRecord& scan) { return scan.next_best_view; };
  const auto last = std::find_if_not(run.scans.rbegin(), run.scans.rend(), is_view);
  if (last != run.scans.rend()) table.row(voxel_row("Phase I", *last), "strong");
  for (const ScanRecord& scan : run.scans) {
    if (scan.next_best_view) table.row(voxel_row(escaped(scan.name), scan));
  }
  if (table.empty()) return "<p>No scan was taken.</p>\n";
  return table.html();
}

std::string coverage_table(const Facts& facts) {
  Table table({{"Area", Align::word},
               {"Scanned by", Align::word},
               {"Stations"},
               {"Tour m"},
               {"Target m"},
               {"Coverable m"},
               {"Planned m"},
               {"Covered m"},
               {"Of coverable"},
               {"Of target"}});
  std::size_t scanned = 0, planned = 0;
  for (std::size_t i = 0; i < facts.areas.size(); ++i) {
    const AreaPlan& plan = facts.record.plans[i];
    const std::size_t done = stations_scanned(facts.areas[i]);
    scanned += done;
    planned += plan.cover.stations.size();
    table.row(coverage_row(escaped(plan.area.name), plan.mode == "manual" ? "hand" : "robot",
                           fmt::format("{} of {}", done, plan.cover.stations.size()),
                           number(plan.tour_m, 0), coverage_of(plan, facts.areas[i])));
  }
  if (table.empty()) return "<p>No area was planned.</p>\n";
  if (facts.areas.size() > 1) {
    table.row(coverage_row("All", "", fmt::format("{} of {}", scanned, planned), "", facts.all),
              "strong");
  }
  std::string ends;
  for (const AreaPlan& plan : facts.record.plans) {
    if (plan.cover.end.empty()) continue;
    ends += "<li><b>" + escaped(plan.area.name) + "</b>: " + escaped(plan.cover.end) + " " +
            escaped(plan.cover.bound) + "</li>\n";
  }
  return table.html() + (ends.empty() ? "" : "<ul class=\"small\">" + ends + "</ul>\n");
}

std::string overlap_table(const Facts& facts) {
  Table table({{"Area", Align::word},
               {"Stations"},
               {"Provably at least"},
               {"Paper's greedy"},
               {"Links"},
               {"Parts"},
               {"Weak links"}});
  std::string weak;
  for (const AreaPlan& plan : facts.record.plans) {
    const planning::CoverPlan& cover = plan.cover;
    if (cover.stations.empty()) continue;
    table.row({escaped(plan.area.name), std::to_string(cover.stations.size()),
               std::to_string(cover.stations_at_least), std::to_string(cover.stations_greedy),
               std::to_string(cover.overlap.links.size()), std::to_string(cover.overlap.parts),
               std::to_string(cover.overlap.weak_links())},
              cover.overlap.parts > 1 ? "alarm" : "");
    for (const std::string& text : weaknesses(cover.overlap))
      weak += "<li><b>" + escaped(plan.area.name) + "</b>: " + escaped(text) + "</li>\n";
  }
  if (table.empty()) return "";
  return table.html() + (weak.empty() ? "" : "<ul class=\"small\">" + weak + "</ul>\n");
}

std::string gap_tables(const Facts& facts) {
  const std::vector<AreaGap> gaps = all_gaps(facts);
  if (gaps.empty()) return "<p>Every target wall is covered.</p>\n";
  const auto longer =
      static_cast<std::size_t>(std::count_if(gaps.begin(), gaps.end(), [](const AreaGap& gap) {
        return gap.stretch.length_m > kGapShown_m;
      }));
  std::string out = gap_reasons(gaps);
  if (longer == 0) return out;
  const std::size_t shown = std::min(longer, kGapsAtOnce);
  out += fmt::format("<h3>{} of the {} pieces over 0.5 m, longest first</h3>\n",
                     shown == longer ? "All" : std::to_string(shown), longer);
  out += gap_list(gaps, 0, shown);
  if (shown < longer) {
    out += fmt::format("<details><summary>The other {}</summary>\n", longer - shown) +
           gap_list(gaps, shown, longer) + "</details>\n";
  }
  return out;
}

std::string station_table(const Facts& facts) {
  Table table({{"Area", Align::word},
               {"Station"},
               {"On tour"},
               {"Scan"},
               {"x m"},
               {"y m"},
               {"Heading deg"},
               {"Sees m"},
               {"Adds m"},
               {"Overlaps m"},
               {"Overlap"}});
  for (std::size_t area = 0; area < facts.areas.size(); ++area) {
    const AreaPlan& plan = facts.record.plans[area];
    for (std::size_t i = 0; i < plan.cover.stations.size(); ++i) {
      const planning::Station& station = plan.cover.stations[i];
      const Eigen::Vector2d at_m = nav::to_m(station.at.position);
      const int place = facts.areas[area].place_in_tour[i];
      table.row({escaped(plan.area.name), std::to_string(i + 1),
                 place > 0 ? std::to_string(place) : "\u2013", scan_cell(facts, plan, area, i),
                 number(at_m.x(), 1), number(at_m.y(), 1), heading(station.at.heading_rad),
                 number(station.sees_m, 1), number(station.adds_m, 1),
                 number(station.overlaps_m, 1),
                 percent(station.sees_m > 0 ? std::optional(station.overlaps_m / station.sees_m)
                                            : std::nullopt)});
    }
  }
  return table.empty() ? "<p>No station was planned.</p>\n" : table.html();
}

std::string scan_table(const RunRecord& run) {
  Table table({{"Scan"},
               {"Name", Align::word},
               {"By", Align::word},
               {"x m"},
               {"y m"},
               {"Started"},
               {"Done"},
               {"Driven m"},
               {"Points"},
               {"Outside box"},
               {"Occupied gained"},
               {"Resolved / predicted"},
               {"Boundary unseen"}});
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const ScanRecord& scan = run.scans[i];
    table.row({std::to_string(scan.number), scan_name(scan), scan.by_hand ? "hand" : "robot",
               number(scan.believed.position_m.x(), 2), number(scan.believed.position_m.y(), 2),
               duration_text(scan.start_s), duration_text(scan.end_s), number(scan.driven_m, 1),
               count_text(scan.points), count_text(scan.points_outside_box),
               number(static_cast<double>(occupied_gained(run, i)), 0), resolved_cell(scan),
               count_text(scan.after.boundary_unseen)},
              scan.next_best_view ? "view" : "");
  }
  return table.empty() ? "<p>No scan was taken.</p>\n" : table.html();
}

std::string registration_table(const RunRecord& run) {
  Table table({{"Scan"},
               {"Name", Align::word},
               {"Verdict", Align::word},
               {"Fits scans"},
               {"RMS mm"},
               {"Cloud to cloud mm"},
               {"Overlap"},
               {"Strength, shift"},
               {"Strength, turn"},
               {"Moved mm"},
               {"Moved deg"},
               {"Tries"},
               {"", Align::text}});
  for (const ScanRecord& scan : run.scans) {
    const ScanFit& fit = scan.fit;
    if (fit.verdict == ScanVerdict::off) continue;
    const bool has_pair = fit.rms_m > 0;
    const auto figure = [&](double value, int decimals) {
      return has_pair ? number(value, decimals) : std::string("-");
    };
    table.row({std::to_string(scan.number), scan_name(scan), std::string(name(fit.verdict)),
               std::to_string(fit.references), figure(1000 * fit.rms_m, 1),
               figure(1000 * fit.cloud_to_cloud_m, 0), has_pair ? percent(fit.overlap) : "-",
               figure(fit.strength_shift, 2), figure(fit.strength_turn, 2),
               figure(1000 * fit.moved_m, 1), has_pair ? degrees(fit.moved_rad, 3) : "-",
               std::to_string(fit.tries), escaped(fit.reason)},
              fit.verdict == ScanVerdict::refused ? "alarm" : "");
  }
  return table.empty() ? "" : table.html();
}

std::string pose_table(const RunRecord& run) {
  Table table({{"Scan"},
               {"Name", Align::word},
               {"Position error m"},
               {"Claimed 1-sigma m"},
               {"Error in sigma"},
               {"Heading error deg"},
               {"Claimed 1-sigma deg"},
               {"", Align::word}});
  for (const ScanRecord& scan : run.scans) {
    const auto error = pose_error(scan);
    if (!error) continue;
    const double ratio = scan.sigma_position_m > 0 ? error->position_m / scan.sigma_position_m
                                                   : std::numeric_limits<double>::infinity();
    const bool heading_out = error->heading_rad > 3 * scan.sigma_heading_rad;
    const bool out = ratio > 3 || heading_out;
    table.row({std::to_string(scan.number), escaped(scan.name), number(error->position_m, 3),
               number(scan.sigma_position_m, 3), number(ratio, 1), degrees(error->heading_rad, 3),
               degrees(scan.sigma_heading_rad, 3), out ? "beyond 3 sigma" : ""},
              out ? "alarm" : "");
  }
  return table.empty() ? "" : table.html();
}

namespace {

// What became of the wall that only that station would have seen.
std::string in_words(const std::optional<Instead>& instead) {
  if (!instead) return "-";
  std::string text = number(instead->lost_m, 1) + " m of wall that nothing else sees";
  if (instead->lost_m <= 0) return "nothing is lost: others see all that it would have";
  if (instead->stations.empty()) return text + ": no place is worth a scan";
  std::string names;
  for (const std::string& name : instead->stations) names += (names.empty() ? "" : ", ") + name;
  return text + ": " + number(instead->lost_m - instead->left_m, 1) + " m of it from " + names;
}

}  // namespace

std::string dropped_table(const RunRecord& run) {
  Table table({{"Station", Align::word},
               {"Area", Align::word},
               {"x m"},
               {"y m"},
               {"Why it was not scanned", Align::text},
               {"What is scanned instead", Align::text}});
  for (const DroppedStation& station : run.dropped) {
    table.row({escaped(station.name), escaped(station.area),
               number(station.planned.position_m.x(), 1), number(station.planned.position_m.y(), 1),
               escaped(station.reason), escaped(in_words(station.instead))});
  }
  return table.empty() ? "<p>None.</p>\n" : table.html();
}

}  // namespace mission::report
