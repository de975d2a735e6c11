// Runs that are cut off and gone on with: what was acknowledged is kept, and nothing is done twice.
#include "mission/resume.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/json.hpp>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <set>

#include "hal/angles.hpp"
#include "mission/beams_file.hpp"
#include "tests/mission/killed_run.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

namespace fs = std::filesystem;
using mission::RunOutcome;
using mission_test::Killer;
using testing::HasSubstr;

// Four houses at a crossing, and the program run on them as vantaged runs it.
class Crossing {
 public:
  Crossing() : site_(mission_test::kQuickRobot, 2) { (void)mission_test::crossing(site_); }

  fs::path out() const { return site_.out(); }
  fs::path folder() const { return site_.folder(); }

  RunOutcome run(bool resume, const std::vector<std::string>& skip = {},
                 const std::function<void(mission::SimBackend&)>& watch = {}) const {
    mission::Prepared ready = site_.prepared();
    for (const auto& error : ready.errors) ADD_FAILURE() << error.text();
    return mission::run_in_simulation(ready, {.out = out(),
                                              .resume = resume,
                                              .skip = skip,
                                              .judge_cells = {},
                                              .threads = 1,
                                              .progress = nullptr,
                                              .terminal = false,
                                              .watch = watch});
  }

  // In a process of its own, which is killed after so long; false: it ended before.
  bool run_and_kill(bool resume, std::chrono::microseconds after) const {
    const pid_t child = start(resume, [] {});
    const auto until = std::chrono::steady_clock::now() + after;
    int status = 0;
    while (std::chrono::steady_clock::now() < until)
      if (usleep(500), waitpid(child, &status, WNOHANG) == child) return ended(status);
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return ended(status);
  }

  // The same, killed by what `break_it` has set up.
  bool run_until_killed(bool resume, const std::function<void()>& break_it) const {
    const pid_t child = start(resume, break_it);
    int status = 0;
    waitpid(child, &status, 0);
    return ended(status);
  }

  // The same, killed as it turns round: where it stands, with a scan at least, or as it goes on.
  bool run_until_killed_turning(bool resume, double turn_rad) const {
    const pid_t child = fork();
    if (child == 0) {
      std::optional<hal::Pose2> stood;
      (void)run(resume, {}, [&](mission::SimBackend& backend) {
        const hal::Pose2 pose = backend.world().robot().pose;
        if (!stood || (!resume && (pose.position_m - stood->position_m).norm() > 0.02))
          stood = pose;
        const double turned_rad = hal::wrapped(pose.heading_rad - stood->heading_rad);
        if (std::abs(turned_rad) > turn_rad && fs::exists(out() / "scans" / "0001.beams"))
          kill(getpid(), SIGKILL);
      });
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return ended(status);
  }

  mission::RunHistory history() const {
    const auto path = out() / "journal.sqlite";
    const auto file = mission::JournalFile::open(path).value();
    return mission::read_history(file.read().value(), path).value();
  }

 private:
  pid_t start(bool resume, const std::function<void()>& first) const {
    const pid_t child = fork();
    if (child != 0) return child;
    first();
    try {
      _exit(run(resume).failure.empty() ? 0 : 1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      _exit(2);
    }
  }
  static bool ended(int status) {
    EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << WEXITSTATUS(status);
    return WIFSIGNALED(status);
  }

  mission_test::SmallSite site_;
};

std::multiset<std::string> names(const mission::RunRecord& record) {
  std::multiset<std::string> all;
  for (const mission::ScanRecord& scan : record.scans) all.insert(scan.name);
  return all;
}

// By their checksums: these very measurements.
std::vector<std::uint64_t> measured(const mission::RunHistory& history) {
  std::vector<std::uint64_t> all;
  for (const mission::ScanDone* scan : history.scans()) all.push_back(scan->beams_checksum);
  return all;
}

bool begins_with(const std::vector<std::uint64_t>& all, const std::vector<std::uint64_t>& first) {
  return all.size() >= first.size() && std::equal(first.begin(), first.end(), all.begin());
}

TEST(Resume, TheProductsAreThoseOfARunThatWasNotCut) {
  const Crossing whole, cut;
  ASSERT_EQ(whole.run(false).failure, "");
  ASSERT_TRUE(cut.run_until_killed(false, [] {
    static Killer killer(".map.ot.part");
    mission::set_file_calls(&killer);
  }));
  ASSERT_FALSE(fs::exists(cut.out() / "map.ot"));
  const RunOutcome again = cut.run(true);
  ASSERT_EQ(again.failure, "");
  EXPECT_TRUE(again.record.completed);
  EXPECT_EQ(again.record.resumed, 1);
  for (const char* product : {"map.ot", "cloud.ply"})
    EXPECT_TRUE(mission::read_file(whole.out() / product).value() ==
                mission::read_file(cut.out() / product).value())
        << product;
  std::size_t scans = 0;
  for (const auto& entry : fs::directory_iterator(whole.out() / "scans")) {
    const auto other = mission::read_file(cut.out() / "scans" / entry.path().filename());
    ASSERT_TRUE(other) << entry.path();
    EXPECT_TRUE(*other == mission::read_file(entry.path()).value()) << entry.path();
    ++scans;
  }
  EXPECT_EQ(scans, again.record.scans.size()) << "what was measured is removed at the end";
  EXPECT_THAT(again.record.notes, testing::Contains(HasSubstr("this run went on")));
  const auto summary = boost::json::parse(mission::read_file(cut.out() / "summary.json").value());
  EXPECT_EQ(summary.at("resumed").to_number<int>(), 1);
  EXPECT_FALSE(mission::find_left_run(cut.out()).value()) << "it is finished";
}

TEST(Resume, ARunThatIsKilledAsItBeginsIsBegunAnew) {
  const Crossing site;
  ASSERT_TRUE(site.run_until_killed(false, [] {
    static Killer killer("decisions.jsonl");
    mission::set_file_calls(&killer);
  }));
  ASSERT_TRUE(fs::exists(site.out()));
  EXPECT_FALSE(mission::find_left_run(site.out()).value());
  const RunOutcome again = site.run(false);
  EXPECT_EQ(again.failure, "");
  EXPECT_TRUE(again.record.completed);
}

// Only driving tells a heading: less sure of it after each cut, the robot would stand for good.
TEST(Resume, ARunThatIsCutAgainAndAgainAsTheRobotTurnsRoundIsGoneOnWith) {
  const Crossing site;
  ASSERT_TRUE(site.run_until_killed_turning(false, 0.5));
  for (int cut = 0; cut < 2; ++cut) ASSERT_TRUE(site.run_until_killed_turning(true, 0.45)) << cut;
  const RunOutcome outcome = site.run(true);
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.record.completed);
}

TEST(Resume, TheJournalIsTheSameForTheSameSeed) {
  const Crossing one, two;
  ASSERT_EQ(one.run(false).failure, "");
  ASSERT_EQ(two.run(false).failure, "");
  const auto a = mission::JournalFile::open(one.out() / "journal.sqlite").value().read().value();
  const auto b = mission::JournalFile::open(two.out() / "journal.sqlite").value().read().value();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]) << a[i].kind;
  std::set<std::string> kinds;
  for (const auto& event : a) kinds.insert(event.kind);
  for (const char* kind :
       {"begun", "planned", "leaves", "leg", "scan", "tour_closed", "ended", "products"})
    EXPECT_TRUE(kinds.contains(kind)) << kind;
}

TEST(Resume, ARunThatIsKilledAnywhereEndsWithTheScansOfOneThatWasNot) {
  std::multiset<std::string> wanted;
  std::chrono::microseconds took{};
  {
    const Crossing whole;
    const auto began = std::chrono::steady_clock::now();
    const RunOutcome outcome = whole.run(false);
    took = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() -
                                                                 began);
    ASSERT_EQ(outcome.failure, "");
    wanted = names(outcome.record);
    ASSERT_GE(wanted.size(), 5U);
  }
  std::mt19937_64 dice(11);
  int resumed = 0;
  const int kills_wanted = std::getenv("VANTAGE_NIGHTLY") != nullptr ? 1000 : 40;
  for (int kills = 0; kills < kills_wanted;) {
    const Crossing site;
    std::vector<std::uint64_t> kept;
    bool resume = false;
    // Some runs are cut more than once.
    for (int cuts = 0; cuts < 2; ++cuts) {
      const auto after =
          std::chrono::microseconds(dice() % static_cast<std::uint64_t>(took.count()));
      if (!site.run_and_kill(resume, after)) break;
      ++kills;
      const auto left = mission::find_left_run(site.out()).value();
      resume = left.has_value();
      if (!resume) continue;
      EXPECT_EQ(left->last_scan_damage, "");
      const auto now = measured(left->history);
      EXPECT_TRUE(begins_with(now, kept)) << "a scan that was acknowledged is gone";
      kept = now;
      ++resumed;
    }
    if (fs::exists(site.out() / "report.html")) continue;  // It was done before the kill.
    const RunOutcome outcome = site.run(resume);
    ASSERT_EQ(outcome.failure, "");
    EXPECT_EQ(names(outcome.record), wanted) << "after " << kept.size() << " scans";
    EXPECT_TRUE(begins_with(measured(site.history()), kept)) << "a scan was taken again";
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_GE(resumed, kills_wanted / 4) << "they were killed before their first scan";
}

// --- What is damaged is named.

// A run that was killed when it had so many scans.
void cut_after(const Crossing& site, int scans) {
  const std::string next = "000" + std::to_string(scans + 1) + ".beams.part";
  ASSERT_TRUE(site.run_until_killed(false, [&] {
    static Killer killer(next);
    mission::set_file_calls(&killer);
  }));
  ASSERT_EQ(site.history().scans().size(), static_cast<std::size_t>(scans));
}

void damage(const fs::path& file) {
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(static_cast<std::streamoff>(fs::file_size(file) / 2));
  bytes << std::string(512, 'x');
}

TEST(Resume, ADamagedLastScanIsNamedAndTakenAgain) {
  const Crossing site;
  cut_after(site, 3);
  const auto before = measured(site.history());
  damage(site.out() / "scans" / "0003.beams");
  const auto left = mission::find_left_run(site.out()).value();
  ASSERT_TRUE(left);
  EXPECT_THAT(left->last_scan_damage, HasSubstr("0003.beams: it is damaged"));
  EXPECT_THAT(mission::offer_text(*left, site.out()), HasSubstr("to be taken again"));
  const RunOutcome outcome = site.run(true);
  ASSERT_EQ(outcome.failure, "");
  const auto after = measured(site.history());
  ASSERT_GE(after.size(), 5U);
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
  EXPECT_NE(after[2], before[2]);
  const auto all = names(outcome.record);
  EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), all.size()) << "none twice";
}

TEST(Resume, AnyOtherDamagedScanIsNamedAndNothingIsDone) {
  const Crossing site;
  cut_after(site, 3);
  damage(site.out() / "scans" / "0002.beams");
  try {
    (void)site.run(true);
    FAIL() << "it went on";
  } catch (const mission::FileFailure& error) {
    EXPECT_THAT(error.what(), HasSubstr("0002.beams: it is damaged"));
  }
  fs::remove(site.out() / "scans" / "0002.beams");
  EXPECT_THROW((void)site.run(true), mission::FileFailure);
  EXPECT_EQ(site.history().scans().size(), 3U);
}

TEST(Resume, PointsThatAreNotWholeAreWrittenAgain) {
  const Crossing site;
  cut_after(site, 3);
  const fs::path file = site.out() / "scans" / "0001.ply";
  const std::string whole = mission::read_file(file).value();
  fs::resize_file(file, whole.size() / 2);
  fs::remove(site.out() / "scans" / "0002.ply");
  const RunOutcome outcome = site.run(true);
  ASSERT_EQ(outcome.failure, "");
  EXPECT_THAT(outcome.record.notes,
              testing::Contains(HasSubstr("0001.ply was written again from what was measured")));
  for (const char* name : {"0001.ply", "0002.ply"})
    EXPECT_GE(mission::read_file(site.out() / "scans" / name).value().size(), whole.size() / 2);
}

TEST(Resume, ADamagedJournalIsNamed) {
  const Crossing site;
  cut_after(site, 2);
  {
    auto file = mission::JournalFile::open(site.out() / "journal.sqlite").value();
    std::vector<mission::JournalEvent> odd{{0, {}, "scan", "{\"scan\": 1}"}};
    ASSERT_TRUE(file.append(odd));
  }
  const auto left = mission::find_left_run(site.out());
  ASSERT_FALSE(left);
  EXPECT_THAT(left.error().text(), HasSubstr("(scan) is damaged"));
  EXPECT_THROW((void)site.run(true), mission::FileFailure);
}

TEST(Resume, ARunThatIsFinishedOrNotThereIsNotGoneOnWith) {
  const Crossing site;
  EXPECT_THROW((void)site.run(true), mission::CannotResume);
  ASSERT_EQ(site.run(false).failure, "");
  try {
    (void)site.run(true);
    FAIL() << "it went on";
  } catch (const mission::CannotResume& error) {
    EXPECT_THAT(error.what(), HasSubstr("is finished"));
  }
}

// --- As structures.

TEST(Resume, NumbersComeBackBitForBit) {
  mission::TourClosed closed;
  closed.scans = 0;
  closed.so_far.mission_s = 0.1 + 0.2;
  closed.so_far.driven_m = 1e-310;
  closed.so_far.registration.moved_max_m = std::numeric_limits<double>::infinity();
  mission::EventText event = mission::event_of(closed);
  const std::vector<mission::JournalEvent> events{{1, {}, event.kind, event.text}};
  const auto history = mission::read_history(events, "journal.sqlite").value();
  EXPECT_EQ(history.so_far.mission_s, 0.1 + 0.2);
  EXPECT_EQ(history.so_far.driven_m, 1e-310);
  EXPECT_EQ(history.so_far.registration.moved_max_m, std::numeric_limits<double>::infinity());
}

TEST(Resume, WhatNoRunWritesIsRefusedByItsNumber) {
  for (const auto& [kind, text] : {std::pair("scan", "{}"),
                                   {"scan", "no json"},
                                   {"leg", "[]"},
                                   {"unheard", "{}"},
                                   {"resumed", R"({"after":"", "scan_lost": 4})"}}) {
    const std::vector<mission::JournalEvent> events{{7, {}, kind, text}};
    const auto history = mission::read_history(events, "journal.sqlite");
    ASSERT_FALSE(history) << kind;
    EXPECT_EQ(history.error().code, boost::system::errc::bad_message);
    EXPECT_THAT(history.error().text(), HasSubstr("event 7"));
  }
}

}  // namespace
