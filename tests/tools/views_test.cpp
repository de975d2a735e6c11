// `vantage rehearse`, `nbv`, `slice` and `why` on one small rehearsed mission.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <boost/json/serialize.hpp>
#include <map>

#include "mission/check_report.hpp"
#include "mission/past_run.hpp"
#include "planning/next_best_view.hpp"
#include "tests/support/xml_check.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

namespace fs = std::filesystem;
namespace json = boost::json;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;

// The courtyard with few beams, so that a mission takes seconds. Rehearsed once for all tests.
class Views : public test::VantageTest {
 protected:
  static void SetUpTestSuite() {
    shared_ = new test::TempFolder;
    std::ofstream(shared_->path() / "r.toml")
        << "[scanner]\nazimuth_step_deg = 0.4\nelevation_step_deg = 0.1667\n[pan]\nangle_max_deg = "
           "360\n";
    write_mission("full", 100);
    rehearsal_ = test::run_program(
        "vantage", "rehearse --json " + mission("full") + " --out " + run_of("full"),
        shared_->path());
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }

  // The map stays as it was when each view was chosen: no tour is closed.
  static void write_mission(const std::string& name, int views_max, const std::string& more = "") {
    std::ofstream(shared_->path() / (name + ".toml"))
        << "robot = 'r.toml'\nsite = '" << site("courtyard") << "'\n"
        << more
        << "[register]\ntour_end = false\n[phase1]\ngain_min = 0.01\n[phase2]\nheight_m = "
           "52.0\nviews_max = "
        << views_max << "\n";
  }
  static std::string mission(const std::string& name) {
    return (shared_->path() / (name + ".toml")).string();
  }
  static std::string run_of(const std::string& name) { return (shared_->path() / name).string(); }

  // The run's decisions of that kind, in order.
  static std::vector<json::value> decisions(const std::string& name, const std::string& kind) {
    std::vector<json::value> views;
    std::ifstream lines(fs::path(run_of(name)) / "decisions.jsonl");
    for (std::string line; std::getline(lines, line);) {
      json::value decision = json::parse(line);
      if (decision.at("decision").as_string() == kind) views.push_back(decision);
    }
    return views;
  }

  // The same map through the library.
  struct Known {
    mission::PastRun past = *mission::read_run(run_of("full"));
    mission::MissionCheck check = mission::check_mission(
        {}, {.site_folder = site("courtyard"), .robot_file = {}, .has_seed = false, .seed = 0});
    mission::SiteModel model = adopted();
    planning::ViewLimits limits = mission::view_limits(check.config.robot.scanner);
    planning::ViewRule rule{limits, model.map().grid().voxel_m};

    mission::SiteModel adopted() {
      mission::adopt(past, check.config);
      const auto tasks = mission::assign_areas(check.config, check.site.map, check.areas).tasks;
      return mission::model_of(past, check.config, check.site.map, tasks, 1);
    }
    bool sees(const planning::BoundaryVoxel& u, const planning::Voxel& p) const {
      return rule.admits(u, p) && planning::clear_between(model.map(), u.v, p);
    }
  };

  inline static test::TempFolder* shared_ = nullptr;
  inline static Outcome rehearsal_;
};

TEST_F(Views, RehearsalSavesStationsAndNextBestViewsAsOnePlan) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto answer = rehearsal_.json();
  EXPECT_TRUE(answer.at("ok").as_bool());
  const auto stations = answer.at("stations").to_number<std::size_t>();
  const auto views = answer.at("next_best_views").to_number<std::size_t>();
  EXPECT_GE(stations, 4u);
  EXPECT_GE(views, 1u);
  EXPECT_EQ(answer.at("plan").as_array().size(), stations + views);
  EXPECT_TRUE(fs::exists(answer.at("plan_file").as_string().c_str()));
}

TEST_F(Views, AMissionWithTheRehearsedPlanVisitsTheSamePlacesAndNeedsFewerViews) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  write_mission("again", 100, "plan = 'full/plan.toml'\n");
  const Outcome outcome = test::run_program(
      "vantaged", mission("again") + " --quiet --out " + run_of("again"), folder_.path());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json::value summary = json::parse(read_text(fs::path(run_of("again")) / "summary.json"));
  std::map<std::string, std::pair<double, double>> planned, visited;
  const auto rehearsed = rehearsal_.json();
  for (const auto& station : rehearsed.at("plan").as_array())
    planned[station.at("name").as_string().c_str()] = {station.at("x_m").to_number<double>(),
                                                       station.at("y_m").to_number<double>()};
  for (const auto& scan : summary.at("scans").as_array())
    if (scan.at("kind").as_string() == "station")
      visited[scan.at("name").as_string().c_str()] = {
          scan.at("planned").at("x_m").to_number<double>(),
          scan.at("planned").at("y_m").to_number<double>()};
  EXPECT_EQ(visited, planned);
  EXPECT_LT(summary.at("counts").at("next_best_views").to_number<std::size_t>(),
            rehearsal_.json().at("next_best_views").to_number<std::size_t>());
}

TEST_F(Views, NbvOfAFinishedRunSaysWhatTheRunSaidLast) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto last = decisions("full", "next_best_view").back();
  const Outcome outcome =
      run("nbv --json --mission " + mission("full") + " --map " + run_of("full"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("best_voxels"), last.at("best_voxels"));
  EXPECT_EQ(answer.at("views_above"), last.at("views_above"));
  EXPECT_TRUE(answer.at("stop").as_bool());
}

// A run that may take one view fewer stops with the map from which the longer run chose its last.
TEST_F(Views, NbvOfAnUnfinishedRunIsTheViewThatTheMissionTakesNext) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto all = decisions("full", "next_best_view"), chosen = decisions("full", "view");
  const int views = rehearsal_.json().at("next_best_views").to_number<int>();
  ASSERT_GE(views, 1);
  ASSERT_EQ(chosen.size(), static_cast<std::size_t>(views));
  for (int taken = 0; taken < std::min(views, 2); ++taken) {
    const std::string name = "short" + std::to_string(taken);
    write_mission(name, taken);
    ASSERT_EQ(test::run_program("vantaged", mission(name) + " --quiet --out " + run_of(name),
                                folder_.path())
                  .code,
              0);
    for (const std::string& map : {run_of(name), run_of(name) + "/map.ot"}) {
      const Outcome outcome = run("nbv --json --k 3 --mission " + mission(name) + " --map " + map);
      ASSERT_EQ(outcome.code, 0) << outcome.err;
      const auto answer = outcome.json();
      const auto& next = all[static_cast<std::size_t>(taken)];
      EXPECT_EQ(answer.at("best_voxels"), next.at("best_voxels"));
      EXPECT_EQ(answer.at("views_above"), next.at("views_above"));
      EXPECT_FALSE(answer.at("stop").as_bool());
      const auto& first = answer.at("next_views").at(0);
      const auto& view = chosen[static_cast<std::size_t>(taken)];
      EXPECT_EQ(first.at("area"), view.at("area"));
      EXPECT_EQ(first.at("x_m"), view.at("at_m").at(0));
      EXPECT_EQ(first.at("y_m"), view.at("at_m").at(1));
      EXPECT_EQ(first.at("sees_voxels"), next.at("best_voxels"));
    }
  }
}

// A narrow scanner, a density goal and foliage: map and summary are enough for the mission's view.
TEST_F(Views, NbvFacesAndCountsAsTheMissionDoesWithANarrowScannerADensityGoalAndFoliage) {
  const std::string robot = (shared_->path() / "narrow.toml").string();
  std::ofstream(robot) << "[scanner]\nfov_deg = 130\nazimuth_step_deg = 0.4\nelevation_step_deg = "
                          "0.1667\n[pan]\nangle_max_deg = 360\n";
  for (const int views : {0, 1}) {
    const std::string name = "narrow" + std::to_string(views);
    std::ofstream(mission(name)) << "robot = 'narrow.toml'\nsite = '" << site("courtyard")
                                 << "'\n[register]\ntour_end = false\n[phase1]\ngain_min = 0.05\n"
                                    "[phase2]\nheight_m = 52.0\n"
                                    "density_min_ppm2 = 60\nfoliage = true\nviews_max = "
                                 << views << "\n";
    ASSERT_EQ(test::run_program("vantaged", mission(name) + " --quiet --out " + run_of(name),
                                folder_.path())
                  .code,
              0);
  }
  const auto next = decisions("narrow1", "next_best_view").front();
  const auto chosen = decisions("narrow1", "view").front();
  const std::string map = " --map " + run_of("narrow0");
  for (const std::string& which :
       {"--mission " + mission("narrow0"), "--site " + site("courtyard")}) {
    const Outcome outcome = run("nbv --json --k 3 " + which + map);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto answer = outcome.json();
    EXPECT_EQ(answer.at("best_voxels"), next.at("best_voxels"));
    const auto& first = answer.at("next_views").at(0);
    EXPECT_EQ(first.at("x_m"), chosen.at("at_m").at(0));
    EXPECT_EQ(first.at("y_m"), chosen.at("at_m").at(1));
    EXPECT_EQ(first.at("sees_voxels"), next.at("best_voxels"));
    EXPECT_EQ(answer.at("next_views").as_array().size(), 3U);
    EXPECT_EQ(answer.at("visiting_by_road").to_number<int>(), 3);
    EXPECT_EQ(answer.at("visiting_order").as_array().size(), 3U);
    EXPECT_GT(answer.at("visiting_road_m").to_number<double>(), 1);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(answer.at("next_views").at(i).at("heading_deg").to_number<double>(),
                  next.at("ahead").at(i).at("heading_rad").to_number<double>() * 180 / M_PI, 1e-9);
    EXPECT_EQ(answer.at("fov_deg").to_number<double>(), 130);
    EXPECT_GT(answer.at("density").at("reached_voxels").to_number<int>(), 1000);
    EXPECT_GT(answer.at("density").at("surface_voxels").to_number<int>(),
              answer.at("density").at("reached_voxels").to_number<int>());
    EXPECT_EQ(answer.at("notes").as_array().size(), 0U) << answer.at("notes");
  }
  // Another robot's scanner sees more from there, and a note says why the answer is another.
  const Outcome wide = run("nbv --json --site " + site("courtyard") + map + " --robot " +
                           (shared_->path() / "r.toml").string());
  ASSERT_EQ(wide.code, 0) << wide.err;
  EXPECT_GT(wide.json().at("best_voxels").to_number<int>(),
            next.at("best_voxels").to_number<int>());
  EXPECT_THAT(wide.out, HasSubstr("fov_deg was 130 in the run and is 360 here"));
}

// Without a mission file, the run itself says where its robot could stand.
TEST_F(Views, RadiusAndMarginAreTheRunsUnlessFilesSayOtherwise) {
  std::ofstream(shared_->path() / "broad.toml")
      << "[body]\nradius_m = 1.9\n[scanner]\nazimuth_step_deg = 0.4\nelevation_step_deg = "
         "0.1667\n[pan]\nangle_max_deg = 360\n";
  write_mission("broad_run", 0);
  const std::string robot = " --robot " + (shared_->path() / "broad.toml").string();
  ASSERT_EQ(run("rehearse " + mission("broad_run") + robot + " --out " + run_of("broad_run")).code,
            0);
  const std::string map = " --map " + run_of("broad_run");
  const auto ask = [&](const std::string& arguments) {
    const Outcome outcome = run("nbv --json " + arguments + map);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.json();
  };
  const auto own = ask("--site " + site("courtyard"));
  const auto same = ask("--mission " + mission("broad_run") + robot);
  const auto slim = ask("--mission " + mission("broad_run"));
  const auto slim_file =
      ask("--site " + site("courtyard") + " --robot " + (shared_->path() / "r.toml").string());
  EXPECT_EQ(own.at("cells"), same.at("cells"));
  EXPECT_EQ(own.at("next_views"), same.at("next_views"));
  EXPECT_LT(own.at("cells").to_number<int>(), slim.at("cells").to_number<int>());
  EXPECT_EQ(slim_file.at("cells"), slim.at("cells"));
  const std::string note = "radius_m was 1.9 in the run and is 0.5 here";
  for (const auto& other : {slim, slim_file})
    EXPECT_THAT(json::serialize(other.at("notes")), HasSubstr(note));
  for (const auto& alike : {own, same})
    EXPECT_THAT(json::serialize(alike.at("notes")), testing::Not(HasSubstr("in the run and is")));
}

// Each count of the CSV from the literal question, voxel by voxel, for a sample of its rows; each
// view's gain from the sets of voxels that it and those before it see.
TEST_F(Views, TallyAndGainsAreWhatEveryVoxelSays) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto csv = (folder_.path() / "tally.csv").string();
  const Outcome outcome = run("nbv --json --k 4 --site " + site("courtyard") + " --map " +
                              run_of("full") + " --tally " + csv);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto answer = outcome.json();

  const Known known;
  const auto& model = known.model;
  const auto worth = model.worth_seeing();
  const auto seen_from = [&](double x_m, double y_m, double z_m) {
    const planning::Voxel p = model.map().grid().voxel_at({x_m, y_m, z_m});
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < worth.size(); ++i)
      if (known.sees(worth[i], p)) seen.push_back(i);
    return seen;
  };

  std::ifstream lines(csv);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "x_m,y_m,z_m,count");
  std::size_t rows = 0, best = 0;
  for (; std::getline(lines, line); ++rows) {
    double x_m{}, y_m{}, z_m{};
    std::size_t count{};
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%zu", &x_m, &y_m, &z_m, &count), 4) << line;
    best = std::max(best, count);
    if (rows % 97 == 0) {
      EXPECT_EQ(seen_from(x_m, y_m, z_m).size(), count) << line;
    }
  }
  EXPECT_EQ(rows, answer.at("cells").to_number<std::size_t>());
  EXPECT_EQ(best, answer.at("best_voxels").to_number<std::size_t>());

  std::vector<bool> taken(worth.size());
  for (const auto& view : answer.at("next_views").as_array()) {
    std::size_t adds = 0;
    const auto seen =
        seen_from(view.at("x_m").to_number<double>(), view.at("y_m").to_number<double>(),
                  view.at("z_m").to_number<double>());
    for (const std::size_t i : seen) {
      adds += taken[i] ? 0 : 1;
      taken[i] = true;
    }
    EXPECT_EQ(view.at("sees_voxels").to_number<std::size_t>(), seen.size());
    EXPECT_EQ(view.at("adds_voxels").to_number<std::size_t>(), adds);
  }
}

// Every boundary voxel asked for from every place to stand.
TEST_F(Views, NeverVisibleIsWhatNoPlaceSeesAndTheCertificateBoundsThemAll) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const Outcome outcome =
      run("nbv --json --site " + site("courtyard") + " --map " + run_of("full"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto answer = outcome.json();
  const Known known;
  const auto frontier = known.model.worth_seeing();
  ASSERT_EQ(known.model.set_aside(), 0u);  // Else the frontier is larger than what is worth it.
  std::uint64_t never = 0;
  for (const auto& u : frontier)
    never += std::ranges::none_of(known.model.cells(), [&](const mission::ViewCell& cell) {
      return known.model.map().at(cell.voxel) == planning::VoxelState::seen_empty &&
             known.sees(u, cell.voxel);
    });
  const auto& told = answer.at("never_visible").as_object();
  EXPECT_EQ(told.at("voxels").to_number<std::uint64_t>(), never);
  std::uint64_t sum = 0;
  for (const auto& [reason, voxels] : told)
    if (reason != "voxels") sum += voxels.to_number<std::uint64_t>();
  EXPECT_EQ(sum, never);
  EXPECT_GT(never, 0u);
  const auto& certificate = answer.at("certificate");
  EXPECT_EQ(certificate.at("pessimistic_voxels"), answer.at("best_voxels"));
  EXPECT_GE(certificate.at("optimistic_voxels").to_number<int>(),
            certificate.at("pessimistic_voxels").to_number<int>());
}

TEST_F(Views, WhyOfAVoxelAgreesWithTheLiteralQuestion) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const Known known;
  const auto frontier = known.model.worth_seeing();
  const auto& cells = known.model.cells();
  const auto& grid = known.model.map().grid();
  std::map<std::string, int> verdicts;
  for (std::size_t i = 0; i < 40; ++i) {
    const auto& u = frontier[i * 7919 % frontier.size()];
    const auto& cell = cells[i * 104729 % cells.size()];
    const Eigen::Vector3d u_m = grid.center_m(u.v), at_m = known.model.cell_position_m(cell);
    const bool by_index = i % 2 == 0;
    const std::string voxel = by_index ? fmt::format("--index {},{},{}", u.v.x, u.v.y, u.v.z)
                                       : fmt::format("{},{},{}", u_m.x(), u_m.y(), u_m.z());
    const Outcome outcome =
        run("why --json --site " + site("courtyard") + " --map " + run_of("full") + " " + voxel +
            fmt::format(" {},{}", at_m.x(), at_m.y()));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto answer = outcome.json();
    EXPECT_EQ(answer.at("voxel").at(2).to_number<int>(), u.v.z);
    const std::string verdict = answer.at("verdict").as_string().c_str();
    EXPECT_EQ(verdict == "visible", known.sees(u, cell.voxel)) << outcome.out;
    EXPECT_EQ(verdict == "blocked", !answer.at("blocker").is_null());
    EXPECT_EQ(verdict == "blocked" || verdict == "visible", known.rule.admits(u, cell.voxel));
    ++verdicts[verdict];
  }
  EXPECT_GE(verdicts.size(), 3u);
}

TEST_F(Views, PicturesAreSelfContained) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto heat = (folder_.path() / "heat.svg").string();
  const auto slice = (folder_.path() / "slice.svg").string();
  ASSERT_EQ(
      run("nbv --site " + site("courtyard") + " --map " + run_of("full") + " --svg " + heat).code,
      0);
  const Outcome sliced = run("slice --json --map " + run_of("full") + " --z 1.5 --svg " + slice);
  ASSERT_EQ(sliced.code, 0) << sliced.err;
  for (const auto& file : {heat, slice}) {
    const std::string text = read_text(file);
    EXPECT_EQ(test::XmlCheck::problem_in(text), "") << file;
    EXPECT_EQ(text.find("var("), std::string::npos);
    EXPECT_THAT(text, HasSubstr(">N</text>"));
  }
  const auto grid = mission::read_run(run_of("full"))->map.grid();
  const auto counts = sliced.json();
  EXPECT_EQ(counts.at("unseen").to_number<int>() + counts.at("seen_empty").to_number<int>() +
                counts.at("seen_occupied").to_number<int>(),
            grid.nx * grid.ny);
  EXPECT_LE(counts.at("z_min_m").to_number<double>(), 1.5);
  EXPECT_GT(counts.at("z_max_m").to_number<double>(), 1.5);
}

TEST_F(Views, WhyNamesTheConstraintAndWhatIsInTheWay) {
  const auto why = [&](const std::string& wall, const std::string& station) {
    const Outcome outcome =
        run("why --json --site " + site("courtyard") + " --wall " + wall + " --station " + station);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.json();
  };
  const auto hidden = why("35.6,15", "-38,-3");
  EXPECT_EQ(hidden.at("reason").as_string(), "occluded");
  EXPECT_FALSE(hidden.at("remedy").as_string().empty());
  const auto seen = why("-38,16.6", "-38,-3");
  EXPECT_TRUE(seen.at("covered").as_bool()) << seen;
  EXPECT_TRUE(seen.at("reason").is_null());
  EXPECT_NEAR(seen.at("range_m").to_number<double>(), 19.6, 0.3);
}

TEST_F(Views, BadInputIsRefusedInWords) {
  ASSERT_EQ(rehearsal_.code, 0) << rehearsal_.err;
  const auto broken = write("broken/map.ot", "# Octomap OcTree file\n").string();
  const auto other = folder_.path() / "other";
  fs::create_directories(other);
  fs::copy_file(fs::path(run_of("full")) / "map.ot", other / "map.ot");
  std::ofstream(other / "summary.json") << "{}";
  const std::string court = " --site " + site("courtyard");
  const std::string full = " --map " + run_of("full");
  const struct {
    std::string arguments;
    std::string error;
  } kWrong[] = {
      {"nbv" + court + " --map none.ot", "cannot read none.ot"},
      {"nbv" + court + " --map " + broken, "map.ot"},
      {"nbv" + court + " --map " + other.string(), "it is not a run's summary"},
      {"nbv --site " + site("church") + full, "is not this mission's"},
      {"nbv" + full, "give --site FOLDER"},
      {"slice --z 900 --svg x.svg" + full, "--z 900 m is outside the map"},
      {"slice --z 1 --svg x.svg --map none.ot", "cannot read none.ot"},
      {"why" + court, "--wall X,Y --station X,Y"},
      {"why" + court + full + " 1,2 0,0", "VOXEL must be X,Y,Z in metres, found '1,2'"},
      {"why" + court + full + " --index 1,2,900 0,0", "lies outside the map's box"},
      {"why" + court + full + " 1,2,3 0,-44", "the scanner can stand nowhere"},
      {"why --wall 1 --station 0,0" + court, "--wall must be X,Y in metres, found '1'"},
      {"why --wall 900,0 --station 0,0" + court, "no wall within 1 m of (900, 0) m"},
      {"why --wall 35.6,15 --station 900,0" + court, "is not in the free space"},
  };
  for (const auto& wrong : kWrong) {
    const Outcome outcome = run(wrong.arguments);
    EXPECT_EQ(outcome.code, 2) << wrong.arguments;
    EXPECT_THAT(outcome.err, HasSubstr(wrong.error)) << wrong.arguments;
  }
}

TEST_F(Views, EveryCommandHelpsWithExamples) {
  for (const std::string command :
       {"check", "keys", "plan", "rehearse", "nbv", "why", "slice", "cover", "tour", "decode"}) {
    const Outcome outcome = run(command + " --help");
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_THAT(outcome.out, HasSubstr("vantage " + command)) << command;
    EXPECT_THAT(outcome.out, HasSubstr("--json")) << command;
  }
}

// The footer's example names no folder.
TEST_F(Views, RehearsalGoesIntoRunsByDefault) {
  write_mission("yard", 0);
  const auto before = fs::current_path();
  fs::current_path(folder_.path());
  const Outcome outcome = run("rehearse --json " + mission("yard"));
  fs::current_path(before);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.json().at("plan_file").as_string(), "runs/yard-rehearsal/plan.toml");
  EXPECT_TRUE(fs::exists(folder_.path() / "runs/yard-rehearsal/summary.json"));
}

// The courtyard as one knows it beforehand: blocks of about the right height, one stairwell in
// another place and the others left out; no balconies, no bridge, no planters, and no ground.
std::string rough_courtyard() {
  const struct {
    double x0_m, y0_m, x1_m, y1_m, top_m;
  } kBlocks[] = {{-50.4, -33.6, 50.4, -17.4, 20}, {-50.4, 16.6, 50.4, 34.4, 40},
                 {44.4, -17.4, 50.4, 16.6, 12},   {-50.4, -17.4, -49.6, 16.6, 4},
                 {-33, -17.4, -28, -11, 20},      {2, 12, 9, 16.6, 40}};
  constexpr int kFaces[][4] = {
      {0, 1, 5, 4}, {1, 3, 7, 5}, {3, 2, 6, 7}, {2, 0, 4, 6}, {4, 5, 7, 6}};
  std::string obj;
  int first = 1;
  for (const auto& b : kBlocks) {
    for (const double z_m : {0.0, b.top_m})
      for (const double y_m : {b.y0_m, b.y1_m})
        for (const double x_m : {b.x0_m, b.x1_m}) obj += fmt::format("v {} {} {}\n", x_m, y_m, z_m);
    for (const auto& f : kFaces)
      obj += fmt::format("f {} {} {} {}\n", first + f[0], first + f[1], first + f[2], first + f[3]);
    first += 8;
  }
  return obj;
}

TEST_F(Views, RehearsalInARoughModelGivesAPlanThatTheRealMissionTours) {
  write_mission("yard", 3);
  const auto model = write("rough.obj", rough_courtyard()).string();
  const auto plan = (shared_->path() / "rough_plan.toml").string();
  const Outcome rehearsed = run("rehearse --json " + mission("yard") + " --model " + model +
                                " --out " + run_of("rough") + " --save " + plan);
  ASSERT_EQ(rehearsed.code, 0) << rehearsed.err;
  const auto rehearsal = rehearsed.json();
  EXPECT_TRUE(rehearsal.at("completed").as_bool());
  EXPECT_EQ(rehearsal.at("plan_file").as_string(), plan);
  EXPECT_THAT(json::serialize(rehearsal.at("notes")), HasSubstr("a level ground was added"));
  EXPECT_THAT(read_text(rehearsal.at("report").as_string().c_str()), HasSubstr("rough.obj"));
  const auto& stations = rehearsal.at("plan").as_array();
  EXPECT_EQ(stations.size(), rehearsal.at("stations").to_number<std::size_t>() +
                                 rehearsal.at("next_best_views").to_number<std::size_t>());

  write_mission("yard_planned", 0, "plan = '" + plan + "'\n");
  ASSERT_EQ(test::run_program("vantaged",
                              mission("yard_planned") + " --quiet --out " + run_of("yard_planned"),
                              folder_.path())
                .code,
            0);
  const json::value real =
      json::parse(read_text(fs::path(run_of("yard_planned")) / "summary.json"));
  EXPECT_TRUE(real.at("completed").as_bool());
  std::size_t told = real.at("dropped").as_array().size();
  for (const auto& scan : real.at("scans").as_array())
    told += std::ranges::any_of(stations, [&](const json::value& station) {
      return station.at("name") == scan.at("name");
    });
  EXPECT_EQ(told, stations.size()) << "each is scanned from, or dropped for a reason";
  EXPECT_GT(real.at("truth").at("seen_of_visible").to_number<double>(), 0.9);
}

TEST_F(Views, RehearsalRefusesAModelThatIsNone) {
  write_mission("yard", 0);
  const auto empty = write("empty.obj", "# nothing\n").string();
  for (const std::string& model : {std::string("none.obj"), empty}) {
    const auto out = folder_.path() / "o";
    const Outcome outcome =
        run("rehearse --json " + mission("yard") + " --model " + model + " --out " + out.string());
    EXPECT_EQ(outcome.code, 2) << model;
    EXPECT_THAT(outcome.err, HasSubstr(model));
    EXPECT_FALSE(fs::exists(out)) << model;
  }
}

TEST_F(Views, RehearsalRefusesASiteWithoutAModel) {
  const auto folder = folder_.path() / "flat";
  fs::create_directories(folder);
  fs::copy_file(site("courtyard") + "/footprint.geojson", folder / "footprint.geojson");
  const auto file = write("m.toml", "site = 'flat'\n").string();
  const Outcome without = run("rehearse " + file + " --out " + (folder_.path() / "o").string());
  EXPECT_EQ(without.code, 2);
  EXPECT_THAT(without.err, HasSubstr("no model.obj"));
  EXPECT_FALSE(fs::exists(folder_.path() / "o"));
}

}  // namespace
