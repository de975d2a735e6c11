// A survey whose only road is blocked for a while: what lies behind is left out, and seen once the
// road is open again.
#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/json.hpp>
#include <fstream>
#include <sstream>

#include "mission/survey.hpp"
#include "sim/sim_clock.hpp"
#include "tests/support/direct_devices.hpp"
#include "tests/support/random_yard.hpp"
#include "tests/support/temp_folder.hpp"

namespace reopened_roads_tests {
namespace {

using namespace std::chrono_literals;

constexpr double kCrowdAtM = 15;

// A lane of 30 m x 10 m with a shed at its far end, one station before the crowd that stands
// shoulder to shoulder across it, and views behind. Scans look over people's heads.
struct Lane {
  mission::MissionConfig config;
  nav::SiteMap map;
  mission::SiteTasks tasks;
  sim::Mesh mesh = sim_test::plain(100);
  std::vector<sim::Person> crowd;

  explicit Lane(double leaves_after_s) {
    map.name = "lane";
    map.boundary = nav::normalise({support::rectangle_mm(0, 0, 30, 10)});
    map.obstacles = nav::normalise({support::rectangle_mm(21, 4, 3, 3)});
    nav::FreeArea area;
    area.name = area.region = "lane";
    area.drivable = nav::subtract(map.boundary, map.obstacles);
    area.standable = nav::offset(area.drivable, -500);
    map.regions = {{"lane", area.drivable, 0}};
    tasks.tasks = {{area, mission::AreaMode::robot}};
    tasks.start = {{3, 5}, 0};
    tasks.start_area = 0;
    sim_test::add_box(mesh, {21, 4, 0}, {24, 7, 3});
    config.name = "lane";
    config.phase2 = {.height_m = 6, .height_max_m = 6, .gain_min_voxels = 10, .views_max = 4};
    config.robot.scanner.azimuth_step_deg = config.robot.scanner.elevation_step_deg = 2;
    config.robot.scanner.range_max_m = 30;
    config.robot.scanner.scan_s = 10;
    mission::SavedStation station;
    station.area = "lane";
    station.x_m = station.y_m = 5;
    config.plan.stations.push_back(station);
    for (int i = 0; i < 14; ++i)
      crowd.push_back({.way_m = {{kCrowdAtM, 0.3 + 0.7 * i}, {kCrowdAtM, 40 + 0.7 * i}, {90, 90}},
                       .speed_mps = 1,
                       .start_s = leaves_after_s});
  }
};

struct Outcome {
  mission::RunRecord record;
  std::vector<boost::json::object> decisions;
  int collisions{};

  std::vector<boost::json::object> all(std::string_view kind) const {
    std::vector<boost::json::object> found;
    for (const boost::json::object& each : decisions)
      if (each.at("decision").as_string() == kind) found.push_back(each);
    return found;
  }
  int scans_behind() const {
    return static_cast<int>(std::ranges::count_if(
        record.scans, [](const auto& scan) { return scan.believed.position_m.x() > kCrowdAtM; }));
  }
  std::string text() const {
    std::string lines;
    for (const boost::json::object& each : decisions) {
      const auto kind = each.at("decision").as_string();
      if (kind == "leg" || kind == "drop" || kind.find("views") != kind.npos || kind == "end")
        lines += boost::json::serialize(each) + "\n";
    }
    return lines;
  }
};

Outcome run(double leaves_after_s) {
  Lane lane(leaves_after_s);
  const sim::Scene scene(lane.mesh);
  boost::asio::io_context io;
  sim::SimClock clock(io);
  sim::WorldConfig world_config;
  world_config.threads = 1;
  world_config.people = lane.crowd;
  world_config.scanner.azimuth_step_rad = world_config.scanner.elevation_step_rad = 0.0349;
  world_config.scanner.range_max_m = 30;
  world_config.scanner.scan_s = 10;
  sim::World world(scene, world_config);
  EXPECT_TRUE(world.put_robot(lane.tasks.start, 0));
  direct::Robot robot(world, clock);
  hal::Devices devices = robot.seeing_devices();
  const test::TempFolder folder;
  mission::RunStore store = mission::RunStore::open(folder.path() / "run").value();
  std::ostringstream quiet;
  mission::ProgressPrinter progress(quiet, false);
  hal::ComputeHere compute;
  mission::Survey survey(lane.config, lane.map, lane.tasks, 1,
                         {clock, devices, store, progress, compute});
  bool ended = false;
  boost::asio::co_spawn(io, survey.run(), [&](std::exception_ptr problem) {
    ended = true;
    EXPECT_FALSE(problem);
  });
  clock.run([&] { return ended || clock.now() > hal::Time(2h); });
  EXPECT_TRUE(ended);
  (void)store.finish();
  Outcome outcome{survey.record(), {}, world.collisions()};
  std::ifstream file(folder.path() / "run" / "decisions.jsonl");
  for (std::string line; std::getline(file, line);)
    outcome.decisions.push_back(boost::json::parse(line).as_object());
  return outcome;
}

TEST(ReopenedRoads, AreTakenOnceTheyAreOpenAndWhatLiesBehindIsSeen) {
  const Outcome outcome = run(120);
  EXPECT_TRUE(outcome.record.completed) << outcome.record.end;
  EXPECT_EQ(outcome.collisions, 0);
  const auto left_out = outcome.all("views_left_out");
  ASSERT_FALSE(left_out.empty()) << outcome.text();
  EXPECT_TRUE(left_out.front().at("roads_closed_for_now").as_bool());
  EXPECT_FALSE(outcome.all("views_brought_back").empty()) << outcome.text();
  EXPECT_GE(outcome.scans_behind(), 1) << outcome.text();
  EXPECT_TRUE(outcome.record.left_out.empty()) << outcome.text();
}

TEST(ReopenedRoads, AreGivenUpWhereTheyStayBlocked) {
  const Outcome outcome = run(1e6);
  EXPECT_TRUE(outcome.record.completed) << outcome.record.end;
  EXPECT_EQ(outcome.collisions, 0);
  EXPECT_EQ(outcome.scans_behind(), 0) << outcome.text();
  EXPECT_FALSE(outcome.record.left_out.empty()) << outcome.text();
  for (const mission::LeftOutView& view : outcome.record.left_out)
    EXPECT_GT(view.planned.position_m.x(), kCrowdAtM - 1.5);
}

}  // namespace
}  // namespace reopened_roads_tests
