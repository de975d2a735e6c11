// Missions whose scans are laid over each other: the map that they leave is the one that their
// corrected poses give, and scans that contradict the others do not get into it.
#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/json.hpp>
#include <sstream>

#include "mission/main_gate.hpp"
#include "mission/survey.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

using mission::ScanVerdict;

// Keeps what was scanned, and turns a scan by five columns where it is told to, as a pan unit does
// that has lost its zero.
class Recorder final : public hal::Scanner {
 public:
  Recorder(hal::Scanner& scanner, std::set<int> lies) : scanner_(scanner), lies_(std::move(lies)) {}

  hal::Task<hal::Result<hal::ScanCloud>> scan() override {
    auto cloud = co_await scanner_.scan();
    if (!cloud) co_return cloud;
    ++calls_;
    if (lies_.contains(calls_))
      std::ranges::rotate(cloud->ranges_m, cloud->ranges_m.begin() + 5 * cloud->pattern.rows);
    taken_.push_back(*cloud);
    co_return cloud;
  }

  const std::vector<hal::ScanCloud>& taken() const { return taken_; }

 private:
  hal::Scanner& scanner_;
  const std::set<int> lies_;  // Which calls, from 1.
  int calls_{};
  std::vector<hal::ScanCloud> taken_;
};

// A mission on the small crossing whose scans are kept, and the survey as it stands at its end.
// Calls of the scanner in `lies` (from 1) are turned.
class RecordedMission {
 public:
  explicit RecordedMission(std::set<int> lies = {}, int views_max = 2)
      : site_(mission_test::kQuickRobot, views_max),
        ready_(mission_test::crossing(site_)),
        backend_(ready_.config, ready_.tasks, std::move(ready_.sim), 1),
        recorder_(backend_.devices().scanner, std::move(lies)),
        store_(mission::RunStore::open(site_.out()).value()),
        devices_{backend_.devices().drive,     backend_.devices().imu,
                 backend_.devices().gnss,      recorder_,
                 backend_.devices().placement, {}},
        survey_(ready_.config, ready_.site.map, ready_.tasks, 1,
                {backend_.clock(), devices_, store_, progress_, compute_}) {
    bool ended = false;
    boost::asio::co_spawn(backend_.executor(), run(), [&](std::exception_ptr error) {
      ended = true;
      EXPECT_FALSE(error);
    });
    EXPECT_TRUE(backend_.run([&] { return ended; })) << backend_.failure();
  }

  const mission::Survey& survey() const { return survey_; }
  const mission::RunRecord& record() const { return survey_.record(); }
  const std::vector<hal::ScanCloud>& taken() const { return recorder_.taken(); }
  std::filesystem::path folder() const { return site_.out(); }

  // Of the merged scans, from their poses of now, all anew.
  mission::SiteModel filled_anew() const {
    mission::SiteModel model(ready_.config, ready_.site.map, ready_.tasks.tasks, 1);
    for (const mission::ScanRecord& scan : record().scans) {
      if (scan.fit.verdict == ScanVerdict::refused) continue;
      const hal::ScanCloud& cloud = *std::ranges::find(taken(), scan.stamp, &hal::ScanCloud::stamp);
      const auto T_W_S = mission::scanner_pose(scan.believed, scan.ground_z_m,
                                               ready_.config.robot.scanner.height_m);
      model.add(cloud, mission::scan_points(cloud, T_W_S), T_W_S, scan.ground_z_m);
    }
    return model;
  }
  std::vector<boost::json::object> decisions(std::string_view which) const {
    std::vector<boost::json::object> found;
    std::ifstream file(folder() / "decisions.jsonl");
    for (std::string line; std::getline(file, line);) {
      boost::json::object decision = boost::json::parse(line).as_object();
      if (decision.at("decision").as_string() == which) found.push_back(std::move(decision));
    }
    return found;
  }

 private:
  hal::Task<void> run() {
    const auto started = co_await backend_.drivers().started(std::chrono::seconds(60));
    EXPECT_TRUE(started);
    co_await mission::arm(backend_.gate());
    co_await survey_.run();
  }

  mission_test::SmallSite site_;
  mission::Prepared ready_;
  mission::SimBackend backend_;
  Recorder recorder_;
  mission::RunStore store_;
  hal::Devices devices_;
  std::ostream none_{nullptr};
  mission::ProgressPrinter progress_{none_, false};
  hal::ComputeHere compute_;
  mission::Survey survey_;
};

TEST(SurveyRegisters, TheMapIsTheOneThatTheCorrectedPosesGive) {
  const RecordedMission mission;
  const mission::RunRecord& record = mission.record();
  ASSERT_TRUE(record.completed) << record.end;
  ASSERT_GE(record.scans.size(), 4U);
  EXPECT_GE(record.registration.accepted, static_cast<int>(record.scans.size()) / 2);
  ASSERT_GE(record.registration.tours_closed, 1);
  EXPECT_GT(record.registration.moved_max_m, 0.001);  // So it had to be filled anew.
  const mission::SiteModel anew = mission.filled_anew();
  EXPECT_TRUE(anew.map() == mission.survey().model().map());
  EXPECT_EQ(anew.counts().boundary_unseen, record.scans.back().after.boundary_unseen);
  EXPECT_EQ(anew.points_outside_box(), mission.survey().model().points_outside_box());
}

TEST(SurveyRegisters, TheFilesHaveTheCorrectedPoses) {
  const RecordedMission mission;
  for (const mission::ScanRecord& scan : mission.record().scans) {
    const auto file = mission::read_ply(mission.folder() / "scans" /
                                        ("000" + std::to_string(scan.number) + ".ply"));
    ASSERT_TRUE(file);
    EXPECT_LT((file->T_W_S->translation().head<2>() - scan.believed.position_m).norm(), 1e-9);
    EXPECT_EQ(file->W_points_m.size(), scan.points);
  }
}

TEST(SurveyRegisters, EveryDecisionIsOnOneLineWithItsFigures) {
  const RecordedMission mission;
  const auto registered = mission.decisions("registration");
  ASSERT_GE(registered.size(), mission.record().scans.size());
  EXPECT_EQ(registered.front().at("verdict").as_string(), "overlaps none");
  const auto accepted = std::ranges::find_if(
      registered, [](const auto& line) { return line.at("verdict").as_string() == "accepted"; });
  ASSERT_NE(accepted, registered.end());
  const auto& last = *accepted;
  const auto& pair = last.at("against").as_array().at(0).as_object();
  for (const char* figure : {"rms_m", "overlap", "conflict", "cloud_to_cloud_m", "moved_m"})
    EXPECT_TRUE(pair.at(figure).is_double()) << figure;
  EXPECT_EQ(pair.at("shift_m").as_array().size(), 3U);
  const auto closed = mission.decisions("tour_closed");
  ASSERT_FALSE(closed.empty());
  EXPECT_EQ(closed.back().at("scans").as_array().size(), mission.record().scans.size());
}

// The first that is laid over others when all goes well: its number.
int first_accepted() {
  const RecordedMission mission;
  for (const mission::ScanRecord& scan : mission.record().scans)
    if (scan.fit.verdict == ScanVerdict::accepted) return scan.number;
  ADD_FAILURE() << "none is accepted";
  return 1;
}

TEST(SurveyRegisters, AScanThatContradictsTheOthersIsTakenAgain) {
  const int number = first_accepted();
  const RecordedMission mission({number});
  const mission::RunRecord& record = mission.record();
  ASSERT_TRUE(record.completed) << record.end;
  EXPECT_EQ(record.registration.retaken, 1);
  EXPECT_EQ(record.registration.refused, 0);
  EXPECT_EQ(mission.decisions("retake").size(), 1U);
  EXPECT_EQ(record.scans[static_cast<std::size_t>(number) - 1].fit.verdict, ScanVerdict::accepted);
  EXPECT_TRUE(mission.filled_anew().map() == mission.survey().model().map());
}

TEST(SurveyRegisters, AScanThatContradictsTheOthersTwiceIsNotMerged) {
  const int number = first_accepted();
  const RecordedMission mission({number, number + 1});
  const mission::RunRecord& record = mission.record();
  ASSERT_TRUE(record.completed) << record.end;
  EXPECT_EQ(record.registration.retaken, 1);
  EXPECT_EQ(record.registration.refused, 1);
  EXPECT_EQ(record.scans[static_cast<std::size_t>(number) - 1].fit.verdict, ScanVerdict::refused);
  EXPECT_THAT(record.notes, testing::Contains(testing::HasSubstr("was not merged")));
  EXPECT_TRUE(mission.filled_anew().map() == mission.survey().model().map());
}

}  // namespace
