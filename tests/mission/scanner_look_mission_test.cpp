// Whole missions of robots whose only eye is the scanner of their scans, among people and without
// satellites.
#include <gtest/gtest.h>

#include <cmath>

#include "hal/angles.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

using namespace std::chrono_literals;

// As it ships, with so many people about; its file ends with [sim].
std::string robot_text(const std::string& name, int people, bool satellites) {
  const auto folder = std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs" / "robots";
  std::ifstream file(folder / name);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string metadata = "\"os1_32.json\"";
  if (const auto at = text.find(metadata); at != std::string::npos)
    text.replace(at, metadata.size(), '"' + (folder / "os1_32.json").string() + '"');
  return text + "people = " + std::to_string(people) + "\n" +
         (satellites ? "" : "gnss_outage = \"site\"\n");
}

struct Mission {
  mission::RunOutcome outcome;
  std::string decisions;
  int collisions{};
  double nearest_person_m = 1e9;
};

Mission run(const std::string& robot, int people, bool satellites) {
  const mission_test::SmallSite site(robot_text(robot, people, satellites));
  const mission::Prepared ready = mission_test::crossing(site);
  for (const auto& error : ready.errors) ADD_FAILURE() << error.text();
  Mission mission;
  mission.outcome = site.run([&](mission::SimBackend& backend) {
    ASSERT_LT(backend.clock().now(), hal::Time(3h)) << "it hangs";
    const sim::World& world = backend.world();
    mission.collisions = world.collisions();
    if (std::abs(world.rolling().forward_mps) < 0.05) return;
    for (const sim::Walker& walker : world.people())
      mission.nearest_person_m = std::min(
          mission.nearest_person_m, (walker.position_m() - world.robot().pose.position_m).norm() -
                                        world.config().radius_m - walker.person().radius_m);
  });
  std::ifstream file(site.out() / "decisions.jsonl");
  mission.decisions = {std::istreambuf_iterator<char>(file), {}};
  return mission;
}

class ScannerLooks : public testing::TestWithParam<const char*> {};

TEST_P(ScannerLooks, SurveysAmongPeopleWithoutTouchingAnybodyTheSameAgain) {
  const Mission one = run(GetParam(), 6, true);
  EXPECT_EQ(one.outcome.failure, "");
  EXPECT_TRUE(one.outcome.record.completed) << one.outcome.record.end;
  EXPECT_EQ(one.collisions, 0);
  EXPECT_GT(one.nearest_person_m, 0.0);
  EXPECT_GE(one.outcome.record.scans.size(), 3U);
  EXPECT_GT(one.outcome.record.moving.waited_s, 0) << "nobody came in its way";
  std::printf("%s: %d ways with something in them, waited %.1f s, nearest %.2f m\n", GetParam(),
              one.outcome.record.moving.obstacles_met, one.outcome.record.moving.waited_s,
              one.nearest_person_m);
  const Mission two = run(GetParam(), 6, true);
  EXPECT_GT(one.decisions.size(), 500U);
  EXPECT_EQ(one.decisions, two.decisions);
}

TEST_P(ScannerLooks, ArrivesWhereItMeansToWithoutSatellites) {
  const Mission one = run(GetParam(), 0, false);
  EXPECT_EQ(one.outcome.failure, "");
  EXPECT_TRUE(one.outcome.record.completed) << one.outcome.record.end;
  EXPECT_EQ(one.collisions, 0);
  int arrived = 0;
  for (const auto& scan : one.outcome.record.scans) {
    if (!scan.arrived || !scan.truth) continue;
    ++arrived;
    EXPECT_LE((scan.arrived->position_m - scan.truth->position_m).norm(), 0.30) << scan.name;
    EXPECT_LE(std::abs(hal::wrapped(scan.arrived->heading_rad - scan.truth->heading_rad)),
              hal::radians(1.5))
        << scan.name;
  }
  EXPECT_GE(arrived, 3);
  std::printf("%s: %d matches\n", GetParam(), static_cast<int>(one.outcome.record.profiles.used));
  EXPECT_GT(one.outcome.record.profiles.used, 10U);
}

INSTANTIATE_TEST_SUITE_P(All, ScannerLooks,
                         testing::Values("bunker_vlp16.toml", "scout_ouster.toml"),
                         [](const auto& param) {
                           const std::string name = param.param;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
