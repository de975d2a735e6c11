// Whole missions by the shipped program: what the README promises.
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/json.hpp>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>

#include "run_mission.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using missions::MissionRun;

double number(const boost::json::value& value) {
  return value.to_number<double>();
}

class Sites : public testing::TestWithParam<std::string> {};

// The judge in tests/sim shares no code with the simulation's own. It asks every so many voxels.
void expect_judged_alike(const std::string& site, const MissionRun& run,
                         const std::filesystem::path& cells) {
  const MissionRun judged = missions::judge(missions::configs() / "sites" / site / "model.obj",
                                            run.folder, cells, site == "fort" ? 40 : 10);
  EXPECT_EQ(judged.exit_code, 0) << judged.output;
  std::printf("%s: %s", site.c_str(), judged.output.c_str());
}

// One run per site serves all claims about it: a mission costs most of a minute.
TEST_P(Sites, AreSurveyedToTheEnd) {
  const std::string site = GetParam();
  const test::TempFolder folder;
  const auto cells = folder.path() / "cells.csv";
  const MissionRun run = missions::run(missions::configs() / "missions" / (site + ".toml"), site,
                                       {"--judge-cells", cells.string()});
  ASSERT_EQ(run.exit_code, 0) << run.output;
  ASSERT_TRUE(run.summary.is_object()) << run.output;
  RecordProperty("wall_s", std::to_string(run.wall_s));
  RecordProperty("peak_rss_mib", std::to_string(run.peak_rss_mib));
  EXPECT_TRUE(run.summary.at("completed").as_bool());
  EXPECT_LT(run.peak_rss_mib, 2048);
  std::printf("%s: %.1f s, %.0f MiB, %s\n", site.c_str(), run.wall_s, run.peak_rss_mib,
              run.summary.at("end").as_string().c_str());

  // Phase I: the share of what any station could cover that the plan covers, per area.
  const double goal = site == "fort" ? 0.98 : 0.95;
  for (const auto& area : run.object("coverage").at("areas").as_array()) {
    const double coverable_m = number(area.at("coverable_m"));
    EXPECT_GE(number(area.at("planned_m")), goal * coverable_m) << area.at("name").as_string();
    EXPECT_GT(coverable_m, 0) << area.at("name").as_string();
  }

  // The columns of the paper's tables: occupied rises; on the fort, boundary unseen falls over the
  // mission and over Phase II. (A single view over a roof can open more frontier than it closes.)
  const auto& scans = run.summary.at("scans").as_array();
  double occupied = 0, boundary_most = 0, boundary_after_phase1 = 0, boundary_after = -1;
  for (const auto& scan : scans) {
    const auto& after = scan.at("after").as_object();
    EXPECT_GE(number(after.at("seen_occupied")), occupied);
    occupied = number(after.at("seen_occupied"));
    // Over the museum's yard many beams go to the sky.
    EXPECT_GE(number(scan.at("points")), site == "fort" ? 1e6 : 9e5);
    boundary_after = number(after.at("boundary_unseen"));
    boundary_most = std::max(boundary_most, boundary_after);
    if (scan.at("kind").as_string() == "station") boundary_after_phase1 = boundary_after;
  }
  if (site == "fort") {
    EXPECT_LT(boundary_after, boundary_most / 2);
    EXPECT_LT(boundary_after, boundary_after_phase1);
  }

  // Judged by the mesh that the mission never saw.
  const auto& truth = run.object("truth");
  EXPECT_GE(number(truth.at("seen_of_visible")), 0.95);
  EXPECT_LT(number(truth.at("position_error_max_m")), 0.15);

  for (const char* product : {"cloud.ply", "map.ot", "decisions.jsonl", "report.html"})
    EXPECT_GT(std::filesystem::file_size(run.folder / product), 0U) << product;
  if (site == "fort" || site == "courtyard") expect_judged_alike(site, run, cells);
  std::filesystem::remove_all(run.folder);
}

INSTANTIATE_TEST_SUITE_P(Shipped, Sites,
                         testing::Values("fort", "tower", "courtyard", "church", "museum"),
                         [](const auto& param) { return param.param; });

// The site's mission with paths that hold anywhere.
std::string mission_text(const std::string& site) {
  std::string text = missions::read_text(missions::configs() / "missions" / (site + ".toml"));
  for (std::size_t at; (at = text.find("\"../")) != std::string::npos;)
    text.replace(at, 4, "\"" + missions::configs().string() + "/");
  return text;
}

// Its robot with a quarter of the beams, so that a mission takes a third of the time.
void thin_out(std::string& mission, const std::filesystem::path& folder) {
  const auto key = mission.find("robot = ");
  const auto begin = mission.find('"', key) + 1, end = mission.find('"', begin);
  std::string robot = missions::read_text(mission.substr(begin, end - begin));
  for (const auto& [was, is] : {std::pair{"azimuth_step_deg = 0.1", "azimuth_step_deg = 0.4"},
                                std::pair{"angle_max_deg = 185.0", "angle_max_deg = 360.0"}}) {
    ASSERT_NE(robot.find(was), std::string::npos) << was;
    robot.replace(robot.find(was), std::string(was).size(), is);
  }
  std::ofstream(folder / "thin.toml") << robot;
  mission.replace(begin, end - begin, (folder / "thin.toml").string());
}

TEST(Missions, RepeatByteForByteWithTheSameSeedAndAnyNumberOfThreads) {
  const test::TempFolder folder;
  std::string text = mission_text("courtyard");
  thin_out(text, folder.path());
  const auto mission = folder.path() / "courtyard.toml";
  std::ofstream(mission) << text;
  const MissionRun one = missions::run(mission, "repeat-1", {"--threads", "1"});
  const MissionRun two = missions::run(mission, "repeat-2", {"--threads", "2"});
  ASSERT_EQ(one.exit_code, 0) << one.output;
  ASSERT_EQ(two.exit_code, 0) << two.output;
  const std::string decisions = missions::read_text(one.folder / "decisions.jsonl");
  EXPECT_GT(decisions.size(), 1000U);
  EXPECT_EQ(decisions, missions::read_text(two.folder / "decisions.jsonl"));
  EXPECT_EQ(missions::read_text(one.folder / "summary.json"),
            missions::read_text(two.folder / "summary.json"));
  const MissionRun other = missions::run(mission, "repeat-3", {"--seed", "99"});
  ASSERT_EQ(other.exit_code, 0) << other.output;
  EXPECT_NE(decisions, missions::read_text(other.folder / "decisions.jsonl"));
  for (const MissionRun* run : {&one, &two, &other}) std::filesystem::remove_all(run->folder);
}

// A scanner that sees 120 deg turns to what its next best views are for.
TEST(Missions, NarrowScannersFaceWhatTheyAreToSee) {
  const auto configs = missions::configs();
  const auto folder =
      std::filesystem::temp_directory_path() / ("vantage-narrow-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "narrow.toml") << "[scanner]\nfov_deg = 120.0\n";
  std::ofstream(folder / "mission.toml")
      << "robot = \"narrow.toml\"\nsite = \"" << (configs / "sites" / "courtyard").string()
      << "\"\n[phase2]\nheight_m = 52.0\ngain_min_voxels = 60\nviews_max = 8\n";
  const MissionRun run = missions::run(folder / "mission.toml", "narrow", {"--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.output;
  double predicted = 0, resolved = 0;
  std::set<double> headings;
  for (const auto& scan : run.summary.at("scans").as_array()) {
    if (scan.at("kind").as_string() == "station") continue;
    predicted += number(scan.at("predicted_voxels"));
    resolved += number(scan.at("resolved_voxels"));
    headings.insert(number(scan.at("planned").at("heading_deg")));
  }
  EXPECT_GE(headings.size(), 3U);
  EXPECT_GE(resolved, 0.7 * predicted);
  EXPECT_GT(predicted, 0);
  std::filesystem::remove_all(run.folder);
  std::filesystem::remove_all(folder);
}

// The site's mission without filling the map anew when a tour closes, which takes half of its time
// and is asked for elsewhere; perhaps with another threshold.
std::filesystem::path variant(const std::string& site, std::optional<int> gain_min_voxels,
                              const std::filesystem::path& folder, bool thin = false) {
  std::string text = mission_text(site);
  if (thin) thin_out(text, folder);
  if (gain_min_voxels) {
    const auto key = text.find("gain_min_voxels");
    const std::string threshold = "gain_min_voxels = " + std::to_string(*gain_min_voxels);
    text.replace(key, text.find('\n', key) - key, threshold + "\nviews_max = 1000");
  }
  const auto file = folder / (site + ".toml");
  std::ofstream(file) << text << "\n[register]\ntour_end = false\n";
  return file;
}

void expect_any_seed_survived(const std::string& site, int seeds, bool thin) {
  const test::TempFolder folder;
  const auto mission = variant(site, {}, folder.path(), thin);
  for (int seed = 1000; seed < 1000 + seeds; ++seed) {
    const MissionRun run =
        missions::run(mission, "seeds", {"--seed", std::to_string(seed), "--quiet"});
    ASSERT_EQ(run.exit_code, 0) << "seed " << seed << ": " << run.output;
    EXPECT_TRUE(run.summary.at("completed").as_bool()) << "seed " << seed;
    EXPECT_GE(number(run.object("truth").at("seen_of_visible")), 0.95) << "seed " << seed;
    std::filesystem::remove_all(run.folder);
  }
}

bool nightly() {
  return std::getenv("VANTAGE_NIGHTLY") != nullptr;
}

TEST(Missions, SurviveOtherSeeds) {
  expect_any_seed_survived("courtyard", nightly() ? 100 : 8, /*thin=*/true);
}
TEST(Missions, SurviveTwentySeedsOnTheFort) {
  if (!nightly()) GTEST_SKIP() << "takes a quarter of an hour: set VANTAGE_NIGHTLY";
  expect_any_seed_survived("fort", 20, /*thin=*/false);
}

// Broken input is refused with exit 2, says where and why, and writes nothing.
struct Broken {
  const char* name;
  const char* footprint;  // Written into a site folder of its own; empty: no file.
  const char* phase2;     // Appended to the mission.
  const char* says;       // A part of the message.
};

const Broken kBroken[] = {
    {"NoFootprint", "", "", "footprint.geojson"},
    {"NotJson", "{\"type\": \"FeatureCollection\", ", "", "footprint.geojson:1"},
    {"BowTie", R"({"type":"Polygon","coordinates":[[[0,0],[20,20],[20,0],[0,20],[0,0]]]})", "",
     "cross"},
    {"RegionWithoutFreeSpace",
     R"({"type":"FeatureCollection","features":[
       {"type":"Feature","properties":{},"geometry":{"type":"Polygon","coordinates":[[[0,0],[9,0],[9,9],[0,9],[0,0]]]}},
       {"type":"Feature","properties":{"role":"region","name":"yard"},"geometry":{"type":"Polygon","coordinates":[[[2,2],[7,2],[7,7],[2,7],[2,2]]]}},
       {"type":"Feature","properties":{"role":"region","name":"street"},"geometry":{"type":"Polygon","coordinates":[[[10,0],[30,0],[30,9],[10,9],[10,0]]]}}]})",
     "[regions]\nyard = \"manual\"\n", "yard"},
    {"ZeroVoxels", R"({"type":"Polygon","coordinates":[[[0,0],[9,0],[9,9],[0,9],[0,0]]]})",
     "[phase2]\nvoxel_m = 0\n", "voxel_m"},
};

class BrokenInput : public testing::TestWithParam<Broken> {};

TEST_P(BrokenInput, IsRefusedAndNothingIsWritten) {
  const Broken& broken = GetParam();
  const auto base = std::filesystem::temp_directory_path() /
                    ("vantage-broken-" + std::to_string(getpid()) + "-" + broken.name);
  std::filesystem::create_directories(base / "site");
  if (*broken.footprint) std::ofstream(base / "site" / "footprint.geojson") << broken.footprint;
  std::ofstream(base / "site" / "model.obj") << "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n";
  std::ofstream(base / "mission.toml") << "site = \"site\"\n" << broken.phase2;
  const MissionRun run = missions::run(base / "mission.toml", std::string("broken-") + broken.name);
  EXPECT_EQ(run.exit_code, 2) << run.output;
  EXPECT_NE(run.output.find(broken.says), std::string::npos) << run.output;
  EXPECT_FALSE(std::filesystem::exists(run.folder));
  std::filesystem::remove_all(base);
}

INSTANTIATE_TEST_SUITE_P(Missions, BrokenInput, testing::ValuesIn(kBroken),
                         [](const auto& param) { return std::string(param.param.name); });

// The mission with another threshold: what it sees of what can be seen.
double seen_at_threshold(const std::string& site, int voxels) {
  const test::TempFolder folder;
  const MissionRun run = missions::run(variant(site, voxels, folder.path()),
                                       site + "-" + std::to_string(voxels), {"--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.output;
  std::filesystem::remove_all(run.folder);
  return run.exit_code == 0 ? number(run.object("truth").at("seen_of_visible")) : 0;
}

// The paper's threshold, 100 voxels, leaves small pockets; the other missions have it anyway. Five
// voxels leave next to none.
TEST(Missions, SeeNinetyFivePercentAtThePapersThreshold) {
  if (!nightly()) GTEST_SKIP() << "takes two minutes: set VANTAGE_NIGHTLY";
  EXPECT_GE(seen_at_threshold("fort", 100), 0.95);
  EXPECT_GE(seen_at_threshold("tower", 100), 0.95);
}
TEST_P(Sites, AreSeenToNinetyNinePercentAtTheLowThreshold) {
  const std::string site = GetParam();
  if (!nightly() && (site == "fort" || site == "tower"))
    GTEST_SKIP() << "takes two minutes: set VANTAGE_NIGHTLY";
  EXPECT_GE(seen_at_threshold(GetParam(), 5), 0.99);
}

}  // namespace
