// Next best views that no road leads to: left out at once, not tried one by one.
#include <gmock/gmock.h>

#include <boost/json.hpp>
#include <fstream>
#include <map>
#include <sstream>

#include "mission/run_history.hpp"
#include "tests/mission/killed_run.hpp"
#include "tests/mission/mission_site.hpp"

namespace views_left_out_tests {
namespace {

using mission::RunOutcome;
using testing::HasSubstr;

// A house in a yard that a fence divides which no map shows; behind it stands a shed.
class DividedYard {
 public:
  explicit DividedYard(const std::string& choose = "gain") {
    std::ofstream model(site_.folder() / "model.obj", std::ios::app);
    add_box(model, {8.6, -12, 0}, {8.8, 18, 1});
    add_box(model, {11, 1, 0}, {13.5, 5, 3});
    std::ofstream(site_.folder() / "mission.toml")
        << "robot = \"robot.toml\"\nsite = \".\"\nmargin_m = 10.0\n[phase1]\ncandidates = 100\n"
           "[phase2]\nheight_m = 10.0\nheight_max_m = 10.0\ngain_min_voxels = 4\nviews_max = 6\n"
        << "choose = \"" << choose << "\"\n";
  }

  RunOutcome run(bool resume = false) const { return resume ? site_.go_on() : site_.run(); }
  std::vector<boost::json::value> decisions(const std::string& kind) const {
    std::ifstream file(site_.out() / "decisions.jsonl");
    std::vector<boost::json::value> all;
    for (std::string line; std::getline(file, line);) {
      const boost::json::value decision = boost::json::parse(line);
      if (decision.at("decision").as_string() == kind) all.push_back(decision);
    }
    return all;
  }
  boost::json::value summary() const { return boost::json::parse(site_.summary()); }
  std::filesystem::path out() const { return site_.out(); }

 private:
  void add_box(std::ofstream& model, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (const double z : {low.z(), high.z()})
      model << "v " << low.x() << ' ' << low.y() << ' ' << z << "\nv " << high.x() << ' ' << low.y()
            << ' ' << z << "\nv " << high.x() << ' ' << high.y() << ' ' << z << "\nv " << low.x()
            << ' ' << high.y() << ' ' << z << '\n';
    for (int i = 0; i < 4; ++i) {
      const int a = corner_ + i, b = corner_ + (i + 1) % 4;
      model << "f " << a << ' ' << b << ' ' << b + 4 << "\nf " << a << ' ' << b + 4 << ' ' << a + 4
            << '\n';
    }
    corner_ += 8;
  }

  mission_test::SmallSite site_;
  int corner_ = 13;  // Of the next box.
};

int views_dropped(const mission::RunRecord& record) {
  return static_cast<int>(std::ranges::count_if(
      record.dropped, [](const auto& drop) { return drop.name.starts_with("NBV"); }));
}

class ViewsByChoice : public testing::TestWithParam<const char*> {};

TEST_P(ViewsByChoice, BehindABarrierLeaveAllAtOnce) {
  const DividedYard yard(GetParam());
  const RunOutcome outcome = yard.run();
  ASSERT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.record.completed);
  EXPECT_EQ(views_dropped(outcome.record), 0);
  EXPECT_GT(outcome.record.left_out.size(), 10U);
  std::size_t told = 0;
  for (const auto& decision : yard.decisions("views_left_out")) {
    std::size_t counted = 0;
    for (const auto& [reason, count] : decision.at("reasons").as_object())
      counted += count.to_number<std::size_t>();
    EXPECT_EQ(counted, decision.at("views").to_number<std::size_t>());
    told += counted;
  }
  for (const auto& decision : yard.decisions("views_brought_back"))
    told -= decision.at("views").to_number<std::size_t>();
  EXPECT_EQ(told, outcome.record.left_out.size());
  EXPECT_LE(yard.decisions("views_left_out").size(), 6U) << "one by one";
  for (const mission::LeftOutView& view : outcome.record.left_out)
    EXPECT_GT(view.planned.position_m.x(), 8) << "on this side of the fence";
  EXPECT_THAT(outcome.record.notes, testing::Contains(HasSubstr("no road led there")));
  EXPECT_EQ(yard.summary().at("left_out").as_array().size(), outcome.record.left_out.size());
}

INSTANTIATE_TEST_SUITE_P(LeftOut, ViewsByChoice, testing::Values("gain", "gain_per_minute"));

TEST(ViewsLeftOut, AreThoseOfARunThatWasNotCut) {
  const DividedYard whole, cut;
  ASSERT_EQ(whole.run().failure, "");
  ASSERT_TRUE(mission_test::killed_at_file(".map.ot.part", [&] { return cut.run(); }));
  const auto path = cut.out() / "journal.sqlite";
  const auto events = mission::JournalFile::open(path).value().read().value();
  EXPECT_GT(std::ranges::count(events, "left_out", &mission::JournalEvent::kind), 0);
  const RunOutcome again = cut.run(true);
  ASSERT_EQ(again.failure, "");
  EXPECT_TRUE(whole.summary().at("left_out") == cut.summary().at("left_out"));
  EXPECT_EQ(whole.summary().at("end").as_string(), cut.summary().at("end").as_string());
  EXPECT_TRUE(mission::read_file(whole.out() / "map.ot").value() ==
              mission::read_file(cut.out() / "map.ot").value());
}

// What one run says of itself, read again.
TEST(ViewsLeftOut, AreReadFromTheJournalAsTheyWereWritten) {
  mission::ViewsLeftOut event;
  event.closed_for_now = true;
  for (int i = 0; i < 3; ++i) {
    mission::NextView view;
    view.cell = {{i, 2 * i, 1}, i % 2};
    view.pose = {{0.1 * i, 3}, 0.5};
    view.voxels = static_cast<std::uint32_t>(40 + i);
    event.views.push_back(view);
  }
  const mission::EventText text = mission::event_of(event);
  mission::JournalEvent kept;
  kept.number = 1;
  kept.kind = text.kind;
  kept.text = text.text;
  const auto history = mission::read_history({kept}, "journal.sqlite").value();
  ASSERT_EQ(history.steps.size(), 1U);
  const auto& same = std::get<mission::ViewsLeftOut>(history.steps.front());
  EXPECT_TRUE(same.closed_for_now);
  ASSERT_EQ(same.views.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(same.views[i].cell.voxel, event.views[i].cell.voxel);
    EXPECT_EQ(same.views[i].cell.task, event.views[i].cell.task);
    EXPECT_EQ(same.views[i].pose.position_m, event.views[i].pose.position_m);
    EXPECT_EQ(same.views[i].voxels, event.views[i].voxels);
  }
}

}  // namespace
}  // namespace views_left_out_tests
