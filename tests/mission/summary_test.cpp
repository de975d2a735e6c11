#include "mission/summary.hpp"

#include <gtest/gtest.h>

#include <boost/json.hpp>

#include "mission/json_text.hpp"
#include "tests/support/sample_record.hpp"

namespace mission {
namespace {

namespace json = boost::json;

TEST(Summary, SaysWhatTheRunDid) {
  const RunRecord run = test::sample_record();
  const json::value summary = json::parse(json_pretty(summarise(run, {})));
  EXPECT_EQ(summary.at("mission").as_string(), "fort");
  EXPECT_EQ(summary.at("seed").to_number<int>(), 1);
  EXPECT_TRUE(summary.at("completed").as_bool());
  EXPECT_EQ(summary.at("end").as_string(), run.end);
  EXPECT_EQ(summary.at_pointer("/counts/stations_planned").to_number<int>(), 26);
  EXPECT_EQ(summary.at_pointer("/counts/stations_scanned").to_number<int>(), 25);
  EXPECT_EQ(summary.at_pointer("/counts/next_best_views").to_number<int>(), 8);
  EXPECT_EQ(summary.at_pointer("/counts/dropped").to_number<int>(), 1);
  EXPECT_EQ(summary.at("scans").as_array().size(), run.scans.size());
  EXPECT_EQ(summary.at_pointer("/dropped/0/reason").as_string(), run.dropped[0].reason);
  EXPECT_EQ(summary.at_pointer("/repairs/0/what").as_string(), "closed the open outline");
  EXPECT_EQ(summary.at("notes").as_array().size(), 2U);
}

TEST(Summary, CoverageOfTheAreasAddsUp) {
  const json::value summary = summarise(test::sample_record(), {});
  const json::value& coverage = summary.at("coverage");
  for (const char* key : {"target_m", "coverable_m", "planned_m", "covered_m"}) {
    double sum_m = 0;
    for (const json::value& area : coverage.at("areas").as_array()) {
      sum_m += area.at(key).as_double();
    }
    EXPECT_NEAR(coverage.at(key).as_double(), sum_m, 0.01) << key;
    EXPECT_GT(sum_m, 0);
  }
  EXPECT_NEAR(coverage.at("covered_of_coverable").as_double(),
              coverage.at("covered_m").as_double() / coverage.at("coverable_m").as_double(), 1e-4);
}

TEST(Summary, TellsTheBoundAndTheWeakLinksOfEveryArea) {
  const RunRecord run = test::sample_record();
  const json::value summary = summarise(run, {});
  const json::array& areas = summary.at_pointer("/coverage/areas").as_array();
  ASSERT_EQ(areas.size(), run.plans.size());
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const auto& cover = run.plans[i].cover;
    EXPECT_EQ(areas[i].at("stations_at_least"), cover.stations_at_least);
    EXPECT_EQ(areas[i].at("stations_greedy"), cover.stations_greedy);
    EXPECT_EQ(areas[i].at("bound").as_string(), cover.bound);
    const json::value& overlap = areas[i].at("overlap");
    EXPECT_EQ(overlap.at("links"), cover.overlap.links.size());
    EXPECT_EQ(overlap.at("parts"), 1);
    const json::array& weak = overlap.at("weak_links").as_array();
    ASSERT_EQ(weak.size(), 1u);
    EXPECT_EQ(weak[0].at("stations").as_array()[1], cover.stations.size());  // Counted from 1.
    EXPECT_GT(weak[0].at("shared_m").as_double(), 3);
  }
}

TEST(Summary, ListsEveryUncoveredPieceOverHalfAMetreWithItsReason) {
  const json::value summary = summarise(test::sample_record(), {});
  std::size_t pieces = 0;
  for (const json::value& area : summary.at_pointer("/coverage/areas").as_array()) {
    for (const json::value& piece : area.at("uncovered_over_0.5_m").as_array()) {
      EXPECT_GT(piece.at("length_m").as_double(), 0.5);
      EXPECT_FALSE(piece.at("reason").as_string().empty());
      ++pieces;
    }
  }
  EXPECT_GT(pieces, 5U);
}

TEST(Summary, ScansHaveTheirVoxelsAndStationsTheirWalls) {
  const RunRecord run = test::sample_record();
  const json::value summary = summarise(run, {});
  const json::value& station = summary.at_pointer("/scans/0");
  EXPECT_EQ(station.at("kind").as_string(), "station");
  EXPECT_EQ(station.at_pointer("/after/seen_occupied").to_number<std::uint64_t>(),
            run.scans[0].after.seen_occupied);
  EXPECT_TRUE(station.as_object().contains("adds_m"));
  const json::value& view = summary.at("scans").as_array().back();
  EXPECT_EQ(view.at("kind").as_string(), "next_best_view");
  EXPECT_EQ(view.at("predicted_voxels").to_number<std::uint64_t>(),
            run.scans.back().predicted_voxels);
  EXPECT_EQ(view.at("occupied_gained").to_number<std::int64_t>(),
            static_cast<std::int64_t>(run.scans.back().after.seen_occupied -
                                      run.scans[run.scans.size() - 2].after.seen_occupied));
}

TEST(Summary, GivesTheMapsOffsetAndNullWhereNothingIsKnown) {
  ProductFacts products;
  EXPECT_TRUE(json::value(summarise({}, products)).at_pointer("/files/map_ot_offset_m").is_null());
  products.map_ot_offset_m = Eigen::Vector3d(0.25, -0.125, 0.4);
  const json::value summary = summarise({}, products);
  EXPECT_EQ(summary.at_pointer("/files/map_ot_offset_m"), json::value({0.25, -0.125, 0.4}));
  EXPECT_TRUE(summary.at("truth").is_null());
  EXPECT_TRUE(summary.at("voxels").is_null());
  EXPECT_TRUE(summary.at_pointer("/coverage/covered_of_target").is_null());
}

TEST(Summary, TellsWhatBecameOfTheSatelliteFixes) {
  RunRecord run = test::sample_record();
  run.gnss = {.fixes = 1500, .refused = 40, .resets = 1};
  EXPECT_EQ(json::value(summarise(run, {})).at("gnss"),
            json::value({{"fixes", 1500U}, {"refused", 40U}, {"resets", 1U}}));
}

TEST(Summary, TheSameRunGivesTheSameBytes) {
  EXPECT_EQ(json_pretty(summarise(test::sample_record(), {})),
            json_pretty(summarise(test::sample_record(), {})));
}

}  // namespace
}  // namespace mission
