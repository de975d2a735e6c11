#include "mission/report.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <set>

#include "mission/report_facts.hpp"
#include "mission/report_html.hpp"
#include "tests/support/sample_record.hpp"
#include "tests/support/xml_check.hpp"

namespace mission {
namespace {

using test::XmlCheck;

std::size_t times(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

bool has(std::string_view text, std::string_view part) {
  return times(text, part) > 0;
}

TEST(XmlCheck, KnowsBrokenFromWhole) {
  EXPECT_EQ(XmlCheck::problem_in("<!DOCTYPE html>\n<a b=\"1\"><c/>x &amp; &#39;</a>\n"), "");
  for (const char* broken :
       {"<a>", "<a></b>", "<a><b></a></b>", "<a b=1/>", "<a>&nbsp;</a>", "<a>x < y</a>",
        "<a b=\"<\"/>", "<a/><b/>", "", "<a b=\"1\" b=\"2\"/>", "<a>\x01</a>"}) {
    EXPECT_NE(XmlCheck::problem_in(broken), "") << broken;
  }
}

TEST(Html, EscapesWhatMarkupWouldRead) {
  EXPECT_EQ(html::escaped("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(html::escaped("Höfe ☂ 😀"), "Höfe ☂ 😀");
}

TEST(Html, ReplacesBytesThatAreNoText) {
  EXPECT_EQ(html::escaped("a\xFF"
                          "b\xC3"),
            "a\uFFFDb\uFFFD");
  EXPECT_EQ(html::escaped("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD");  // A surrogate.
  EXPECT_EQ(html::escaped("\xC0\xAF"), "\uFFFD\uFFFD");            // Longer than needed.
  EXPECT_EQ(html::escaped("\x1b[2J"), "\uFFFD[2J");
}

TEST(Html, WritesNumbersForPeople) {
  EXPECT_EQ(html::number(1234567.891, 1), "1,234,567.9");
  EXPECT_EQ(html::number(-0.04, 1), "0.0");
  EXPECT_EQ(html::number(-12.34, 1), "\u221212.3");
  EXPECT_EQ(html::number(std::nan(""), 1), "\u2013");
  EXPECT_EQ(html::percent(0.9876), "98.8 %");
  EXPECT_EQ(html::percent(std::nullopt), "\u2013");
}

TEST(Report, IsWellFormedAndRefersToNothingOutside) {
  const std::string html = report_html(test::sample_record(), {});
  EXPECT_EQ(XmlCheck::problem_in(html), "");
  for (const char* outside : {"http", "//", "src=", "href=", "@import", "<script", "<link"}) {
    EXPECT_FALSE(has(html, outside)) << outside;
  }
  EXPECT_EQ(times(html, "url("), times(html, "url(#"));
}

TEST(Report, NamesEveryStationViewAndDroppedStation) {
  const RunRecord run = test::sample_record();
  const std::string html = report_html(run, {});
  for (const ScanRecord& scan : run.scans) {
    // In the map (as a tip) and in the table of scans.
    EXPECT_TRUE(has(html, fmt::format("<title>Scan {}: {}</title>", scan.number, scan.name)));
    EXPECT_TRUE(has(
        html, fmt::format("<td class=\"n\">{}</td><td class=\"w\">{}", scan.number, scan.name)));
  }
  ASSERT_EQ(run.dropped.size(), 1U);
  EXPECT_TRUE(has(html, "outer 4 dropped: the way was blocked"));
  EXPECT_TRUE(has(html, run.end));
  for (const auto& note : run.notes) EXPECT_TRUE(has(html, note));
  EXPECT_TRUE(has(html, "closed the open outline"));
}

TEST(Report, HasThePapersTablesWithPhaseIFirst) {
  const RunRecord run = test::sample_record(2);
  const std::string html = report_html(run, {});
  EXPECT_TRUE(has(html,
                  "<th class=\"w\">At the end of</th><th class=\"n\">Seen-occupied</th>"
                  "<th class=\"n\">Total unseen</th><th class=\"n\">Boundary unseen</th>"
                  "<th class=\"n\">Visible to NBV</th>"));
  const auto phase1 = html.find("<td class=\"w\">Phase I</td>");
  const auto first = html.find("<td class=\"w\">NBV 1</td>"),
             second = html.find("<td class=\"w\">NBV 2</td>");
  ASSERT_NE(second, std::string::npos);
  EXPECT_LT(phase1, first);
  EXPECT_LT(first, second);
  const ScanRecord& last = run.scans[run.scans.size() - 3];  // The last station of Phase I.
  EXPECT_TRUE(html.substr(phase1).starts_with(
      fmt::format("<td class=\"w\">Phase I</td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
                  html::number(static_cast<double>(last.after.seen_occupied), 0),
                  html::number(static_cast<double>(last.after.unseen), 0))));
}

TEST(Report, NamesTheBoundAndEveryWeakLink) {
  RunRecord run = test::sample_record(0);
  std::string html = report_html(run, {});
  for (const AreaPlan& plan : run.plans) {
    EXPECT_TRUE(has(html, plan.cover.bound));
    const auto texts = weaknesses(plan.cover.overlap);
    ASSERT_EQ(texts.size(), 1U);
    EXPECT_TRUE(has(html, fmt::format("<b>{}</b>: {}", plan.area.name, texts[0])));
  }
  EXPECT_EQ(times(html, "weak link: station"), run.plans.size());
  for (AreaPlan& plan : run.plans)
    for (auto& link : plan.cover.overlap.links) link.bridge = false;
  html = report_html(run, {});
  EXPECT_FALSE(has(html, "weak link: station"));
}

TEST(Report, EscapesEveryNameFromOutside) {
  RunRecord run = test::sample_record(3);
  const std::string evil = "<script>alert(\"x\")</script>&'\xFF";
  run.mission = run.site = run.robot = run.end = evil;
  run.notes = {evil};
  run.repairs = {{evil, evil}};
  for (AreaPlan& plan : run.plans) {
    plan.area.name = plan.area.region = plan.cover.end = evil;
  }
  for (auto& region : run.map.regions) region.name = evil;
  for (ScanRecord& scan : run.scans) scan.name = scan.area = evil;
  for (DroppedStation& station : run.dropped) {
    station.name = station.area = station.reason = evil;
  }
  const std::string html = report_html(run, {});
  EXPECT_EQ(XmlCheck::problem_in(html), "");
  EXPECT_FALSE(has(html, "<script"));
  EXPECT_FALSE(has(html, "\xFF"));
}

TEST(Report, DrawsAnEmptyRecordAndAPlanWithoutScans) {
  EXPECT_EQ(XmlCheck::problem_in(report_html({}, {})), "");
  RunRecord plan = test::sample_record();
  plan.scans.clear();
  plan.driven_m.clear();
  plan.dropped.clear();
  plan.truth.reset();
  plan.completed = false;
  const std::string html = report_html(plan, {});
  EXPECT_EQ(XmlCheck::problem_in(html), "");
  EXPECT_TRUE(has(html, "Ended early."));
  EXPECT_TRUE(has(html, "<title>moat 3</title>"));  // Planned stations stand in for scans.
}

TEST(Report, OneScanAndZeroesDoNotBreakTheCharts) {
  RunRecord run = test::sample_record(0);
  run.scans.resize(1);
  run.scans[0].after = {};
  run.scans[0].sigma_position_m = 0;
  run.gain_min_voxels = 0;
  const std::string html = report_html(run, {});
  EXPECT_EQ(XmlCheck::problem_in(html), "");
  EXPECT_FALSE(has(html, "nan") || has(html, "inf\"") || has(html, "\"-inf"));
}

TEST(Report, TheSameRecordGivesTheSameBytes) {
  EXPECT_EQ(report_html(test::sample_record(), {}), report_html(test::sample_record(), {}));
}

TEST(Report, SixtyScansTakeLessThanASecond) {
  const RunRecord run = test::sample_record(40);
  ASSERT_GE(run.scans.size(), 60U);
  const auto start = std::chrono::steady_clock::now();
  const std::string html = report_html(run, {});
  const std::chrono::duration<double> span = std::chrono::steady_clock::now() - start;
  EXPECT_LT(span.count(), 1.0);
  EXPECT_LT(html.size(), 2'000'000U);
}

// One wall of 10 m seen from 0 to 4 by station 0 and from 3 to 8 by station 1; the rest is grazing.
RunRecord one_wall() {
  AreaPlan plan;
  plan.area.name = "yard";
  plan.walls = {{{0, 0}, {10000, 0}, true}, {{10000, 0}, {10000, 2000}, true}};
  plan.cover.stations.resize(2);
  plan.cover.stations[0].at = {{1000, 5000}, 0.5};
  plan.cover.stations[0].sees = {{0, 0, 4}};
  plan.cover.stations[1].at = {{6000, 5000}, 0.5};
  plan.cover.stations[1].sees = {{0, 3, 8}};
  plan.cover.uncovered = {{{0, 8, 10}, planning::Excluded::grazing},
                          {{1, 0, 2}, planning::Excluded::grazing}};
  plan.cover.target_m = 12;
  plan.cover.coverable_m = plan.cover.covered_m = 8;
  plan.tour = {1, 0};
  RunRecord run;
  run.plans = {plan};
  ScanRecord scan;
  scan.number = 1;
  scan.area = "yard";
  scan.planned = {{1, 5}, 0.5};
  run.scans = {scan};
  return run;
}

TEST(ReportFacts, CountsOnlyWhatScannedStationsCover) {
  const RunRecord run = one_wall();
  const AreaFacts facts = area_facts(run, run.plans[0]);
  EXPECT_EQ(facts.scan_of_station, (std::vector<int>{0, -1}));
  EXPECT_EQ(facts.place_in_tour, (std::vector<int>{2, 1}));
  EXPECT_DOUBLE_EQ(facts.covered_m, 4);
  ASSERT_EQ(facts.gaps.size(), 3U);
  EXPECT_DOUBLE_EQ(facts.gaps[0].piece.from_m, 4);
  EXPECT_DOUBLE_EQ(facts.gaps[0].piece.to_m, 8);
  EXPECT_FALSE(facts.gaps[0].why);  // Its station was not scanned.
  EXPECT_EQ(facts.gaps[1].why, planning::Excluded::grazing);
  EXPECT_EQ(facts.gaps[2].piece.wall, 1);
}

TEST(ReportFacts, JoinsGapsRoundTheCornersOfAWall) {
  const RunRecord run = one_wall();
  const auto stretches = gap_stretches(run.plans[0], area_facts(run, run.plans[0]).gaps);
  ASSERT_EQ(stretches.size(), 2U);
  for (const GapStretch& stretch : stretches) EXPECT_NEAR(stretch.length_m, 4, 1e-9);
  EXPECT_EQ(stretches[1].from_m, Eigen::Vector2d(8, 0));
  EXPECT_EQ(stretches[1].to_m, Eigen::Vector2d(10, 2));
}

TEST(ReportFacts, ANextBestViewIsNotTakenForTheStationItStandsOn) {
  RunRecord run = one_wall();
  run.scans[0].next_best_view = true;
  EXPECT_EQ(area_facts(run, run.plans[0]).scan_of_station, (std::vector<int>{-1, -1}));
}

TEST(ReportFacts, CoverageAddsUpAndKnowsWhenThereIsNothingToCover) {
  Coverage all;
  EXPECT_FALSE(all.of_coverable());
  all += {10, 8, 7, 6};
  all += {10, 4, 4, 3};
  EXPECT_DOUBLE_EQ(*all.of_coverable(), 0.75);
  EXPECT_DOUBLE_EQ(*all.of_target(), 0.45);
}

TEST(ReportFacts, EveryReasonHasItsOwnWordMeaningAndRemedy) {
  using planning::Excluded;
  const std::pair<Excluded, std::string> words[] = {
      {Excluded::occluded, "occluded"},   {Excluded::range_max, "range_max"},
      {Excluded::range_min, "range_min"}, {Excluded::grazing, "grazing"},
      {Excluded::overlap, "overlap"},     {Excluded::field_of_view, "field_of_view"},
      {Excluded::gain, "gain"},           {Excluded::goal, "goal"}};
  std::set<std::string> meanings;
  for (const auto& [reason, word] : words) {
    const Why why = why_text(reason);
    EXPECT_EQ(why.word, word);
    EXPECT_FALSE(why.remedy.empty());
    meanings.emplace(why.meaning);
  }
  EXPECT_EQ(meanings.size(), 8U);
  EXPECT_EQ(why_text(std::nullopt).word, "not_scanned");
}

TEST(ReportFacts, HeadingErrorsGoTheShortWayRound) {
  ScanRecord scan;
  EXPECT_FALSE(pose_error(scan));
  scan.believed.heading_rad = 3.1;
  scan.truth = hal::Pose2{{3, 4}, -3.1};
  EXPECT_NEAR(pose_error(scan)->heading_rad, 2 * std::numbers::pi - 6.2, 1e-12);
  EXPECT_DOUBLE_EQ(pose_error(scan)->position_m, 5);
}

}  // namespace
}  // namespace mission
