// Missions on disks that fail, and what a power cut leaves of their files.
#include <gmock/gmock.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <set>

#include "mission/beams_file.hpp"
#include "mission/resume.hpp"
#include "tests/mission/disk_trace.hpp"
#include "tests/mission/mission_site.hpp"

namespace {

namespace fs = std::filesystem;
using mission_test::DiskOp;
using mission_test::DiskTrace;
using testing::HasSubstr;

bool nightly() {
  return std::getenv("VANTAGE_NIGHTLY") != nullptr;
}

mission::RunOutcome run(const mission_test::SmallSite& site, bool resume = false) {
  return resume ? site.go_on() : site.run();
}

std::set<std::string> names(const mission::RunRecord& record) {
  std::set<std::string> all;
  for (const mission::ScanRecord& scan : record.scans) all.insert(scan.name);
  return all;
}

// Every scan that the journal has is on the disk, whole.
int scans_kept(const fs::path& folder) {
  const fs::path path = folder / "journal.sqlite";
  const auto file = mission::JournalFile::open(path);
  if (!file) {
    ADD_FAILURE() << file.error().text();
    return -1;
  }
  const auto history = mission::read_history(file->read().value(), path).value();
  for (const mission::ScanDone* scan : history.scans()) {
    const auto name = fs::path("scans") / ("000" + std::to_string(scan->scan.number) + ".beams");
    const auto whole = mission::verify_beams(folder / name, scan->beams_checksum);
    EXPECT_TRUE(whole || history.finished()) << whole.error().text();
  }
  return static_cast<int>(history.scans().size());
}

TEST(DiskFaults, AMissionOutlivesACallThatFailsOnceOrEndsByNameAndGoesOnAfterwards) {
  int calls = 0;
  std::set<std::string> wanted;
  {
    const mission_test::SmallSite site;
    DiskTrace trace([&](DiskOp::Kind) { return ++calls, 0; });
    trace.record = false;
    wanted = names(run(site).record);
  }
  ASSERT_GT(calls, 50);
  ASSERT_GE(wanted.size(), 2U);
  const int step = nightly() ? 1 : calls / 30;
  int ended_early = 0, resumed = 0, waited = 0;
  for (const int why : {EIO, ENOSPC}) {
    for (int n = 1 + (why == EIO ? 0 : step / 2); n <= calls; n += step) {
      SCOPED_TRACE(testing::Message() << "call " << n << " fails with " << why);
      const mission_test::SmallSite site;
      std::string failure;
      mission::RunRecord record;
      {
        int call = 0;
        DiskTrace trace([&](DiskOp::Kind) { return ++call == n ? why : 0; });
        trace.record = false;
        try {
          mission::RunOutcome outcome = run(site);
          failure = std::move(outcome.failure);
          record = std::move(outcome.record);
        } catch (const mission::FileFailure& error) {  // It refused to start.
          failure = "F7 " + std::string(error.what());
        }
      }
      if (failure.empty()) {  // It was tried again, or nobody needs that call.
        EXPECT_EQ(names(record), wanted);
        waited += std::ranges::count_if(record.notes, [](const std::string& note) {
          return note.find("the disk works again") != std::string::npos;
        });
        continue;
      }
      ++ended_early;
      EXPECT_THAT(failure, HasSubstr("F7"));
      if (!fs::exists(site.out() / "journal.sqlite") || scans_kept(site.out()) <= 0) continue;
      if (++resumed % 4 != 0 && !nightly()) continue;
      const mission::RunOutcome outcome = run(site, true);
      EXPECT_EQ(outcome.failure, "");
      EXPECT_EQ(names(outcome.record), wanted);
    }
  }
  EXPECT_GT(ended_early, 2);  // Where it begins, and where its products are written.
  EXPECT_GT(resumed, 0);
  EXPECT_GT(waited, 9);
}

TEST(DiskFaults, ShortWritesAreGoneOnWith) {
  const mission_test::SmallSite whole, halved;
  ASSERT_EQ(run(whole).failure, "");
  {
    DiskTrace trace([](DiskOp::Kind kind) { return kind == DiskOp::Kind::write ? -1 : 0; });
    trace.record = false;
    ASSERT_EQ(run(halved).failure, "");
  }
  for (const char* product : {"map.ot", "cloud.ply", "decisions.jsonl"})
    EXPECT_TRUE(mission::read_file(whole.out() / product).value() ==
                mission::read_file(halved.out() / product).value())
        << product;
}

TEST(DiskFaults, AMissionStandsUntilThereIsSpaceAgain) {
  const mission_test::SmallSite undisturbed, site;
  const mission::RunOutcome before = run(undisturbed);
  mission::RunOutcome outcome;
  {
    int writes = 0;
    DiskTrace trace([&](DiskOp::Kind kind) {
      if (kind != DiskOp::Kind::write) return 0;
      ++writes;
      return writes > 60 && writes <= 90 ? ENOSPC : 0;
    });
    trace.record = false;
    outcome = run(site);
  }
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.record.completed);
  EXPECT_EQ(names(outcome.record), names(before.record));
  EXPECT_THAT(outcome.record.notes, testing::Contains(HasSubstr("F700-disk-full: cannot write")));
  EXPECT_THAT(outcome.record.notes, testing::Contains(HasSubstr("the disk works again after")));
  EXPECT_GT(outcome.record.mission_s, before.record.mission_s + 1);
  const auto lines = [](const mission_test::SmallSite& of) {
    const std::string text = mission::read_file(of.out() / "decisions.jsonl").value();
    EXPECT_TRUE(text.starts_with("{") && text.find("\n{") != std::string::npos);
    EXPECT_EQ(text.find("}{"), std::string::npos) << "a line was torn";
    return std::ranges::count(text, '\n');
  };
  EXPECT_EQ(lines(site), lines(undisturbed));
}

// A disk that stays full: nothing more can be written, not even why.
TEST(DiskFaults, AFullDiskEndsAMissionByName) {
  const mission_test::SmallSite site;
  mission::RunOutcome outcome;
  {
    int writes = 0;
    DiskTrace trace([&](DiskOp::Kind kind) {
      return kind == DiskOp::Kind::write && ++writes > 60 ? ENOSPC : 0;
    });
    trace.record = false;
    outcome = run(site);
  }
  EXPECT_THAT(outcome.failure, HasSubstr("F700-disk-full: cannot write"));
  EXPECT_FALSE(outcome.record.completed);
  EXPECT_THAT(outcome.record.end, HasSubstr("F700-disk-full"));
  EXPECT_GE(scans_kept(site.out()), 0);
  EXPECT_EQ(run(site, scans_kept(site.out()) > 0).failure, "");
}

// --- A disk that sends the robot home.

void add_to_mission(const mission_test::SmallSite& site, const std::string& text) {
  std::ofstream(site.folder() / "mission.toml", std::ios::app) << text;
}

const char* const kHome = "[disk]\npatience_s = 20\nthen = \"home\"\n";

// The scans that the journal has: their names, and what was measured.
std::vector<std::pair<std::string, std::uint64_t>> acknowledged_scans(const fs::path& folder) {
  const fs::path path = folder / "journal.sqlite";
  const auto file = mission::JournalFile::open(path).value();
  const auto history = mission::read_history(file.read().value(), path).value();
  std::vector<std::pair<std::string, std::uint64_t>> all;
  for (const mission::ScanDone* scan : history.scans())
    all.emplace_back(scan->scan.name, scan->beams_checksum);
  return all;
}

struct Failing {
  int from_write{};      // The disk fails from then on,
  hal::Duration during;  // for so long.
  int why = ENOSPC;
};

struct Driven {
  mission::RunOutcome outcome;
  double away_m{};    // From its start, truly, when the disk began to fail,
  double at_end_m{};  // and at the end.
  hal::Duration failed_until_end{};
};

Driven run_on(const mission_test::SmallSite& site, const Failing& failing) {
  const Eigen::Vector2d start_m = site.prepared().tasks.start.position_m;
  Driven driven;
  int writes = 0;
  hal::Time now{};
  std::optional<hal::Time> since;
  DiskTrace trace([&](DiskOp::Kind kind) {
    if (kind != DiskOp::Kind::write && kind != DiskOp::Kind::sync) return 0;
    writes += kind == DiskOp::Kind::write;
    if (writes <= failing.from_write) return 0;
    if (!since) {
      since = now;
      driven.away_m = driven.at_end_m;
    }
    return now - *since < failing.during ? failing.why : 0;
  });
  trace.record = false;
  driven.outcome = site.run([&](mission::SimBackend& backend) {
    now = backend.clock().now();
    driven.at_end_m = (backend.truths().robot.position_m - start_m).norm();
  });
  if (since) driven.failed_until_end = now - *since;
  return driven;
}

constexpr hal::Duration kForGood = std::chrono::hours(24);
// The second scan is on the disk, and the journal does not take its event any more.
constexpr int kBeforeItsEvent = 363;

// From its start the run goes on with all that was acknowledged, and takes nothing of it again.
void expect_resumes(const mission_test::SmallSite& site, const std::set<std::string>& wanted,
                    bool from_start) {
  const auto safe = acknowledged_scans(site.out());
  ASSERT_EQ(scans_kept(site.out()), static_cast<int>(safe.size()));
  mission::Prepared ready = site.prepared();
  const Eigen::Vector2d start_m = ready.tasks.start.position_m;
  std::optional<double> begins_m;  // From there.
  const auto watch = [&](mission::SimBackend& backend) {
    if (!begins_m) begins_m = (backend.truths().robot.position_m - start_m).norm();
  };
  const mission::RunOutcome outcome = mission::run_in_simulation(ready, {.out = site.out(),
                                                                         .resume = true,
                                                                         .from_start = from_start,
                                                                         .judge_cells = {},
                                                                         .watch = watch});
  EXPECT_LT(begins_m.value_or(1e9), 0.5);
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.record.completed);
  EXPECT_EQ(names(outcome.record), wanted);
  EXPECT_EQ(outcome.record.scans.size(), wanted.size()) << "none twice";
  const auto all = acknowledged_scans(site.out());
  ASSERT_GE(all.size(), safe.size());
  EXPECT_TRUE(std::equal(safe.begin(), safe.end(), all.begin()));
  for (const mission::ScanRecord& scan : outcome.record.scans)
    EXPECT_LT((scan.truth->position_m - scan.believed.position_m).norm(), 0.3) << scan.name;
}

TEST(DiskFaults, ADiskThatFailsForGoodSendsTheRobotHome) {
  const mission_test::SmallSite undisturbed;
  const std::set<std::string> wanted = names(run(undisturbed).record);
  int away = 0, with_scans = 0;
  for (const int why : {ENOSPC, EIO})
    for (const int from_write : {80, 250, kBeforeItsEvent, 450}) {
      SCOPED_TRACE(testing::Message() << "write " << from_write << " fails with " << why);
      const mission_test::SmallSite site;
      add_to_mission(site, kHome);
      const Driven driven = run_on(site, {from_write, kForGood, why});
      const mission::RunRecord& record = driven.outcome.record;
      EXPECT_FALSE(record.completed);
      EXPECT_THAT(driven.outcome.failure,
                  HasSubstr("F704-disk-given-up: for more than patience_s"));
      EXPECT_THAT(record.end,
                  testing::StartsWith("F704-disk-given-up: for more than patience_s = 20 s "));
      EXPECT_THAT(record.end, HasSubstr(why == ENOSPC ? "F700-disk-full" : "F701-disk-failed"));
      EXPECT_THAT(record.end, HasSubstr("went home and is at its start; the disk still fails"));
      EXPECT_THAT(record.notes, testing::Contains(HasSubstr("the robot goes home")));
      EXPECT_LT(driven.at_end_m, 0.5);
      EXPECT_GT(driven.failed_until_end, std::chrono::seconds(40))
          << "it waits at home as long again";
      const auto safe = acknowledged_scans(site.out());
      std::set<std::string> counted;
      for (const auto& [name, checksum] : safe) counted.insert(name);
      EXPECT_EQ(names(record), counted) << "what is not durable does not count";
      if (from_write == kBeforeItsEvent) {
        EXPECT_THAT(record.notes, testing::Contains(HasSubstr("is not counted: the journal")));
      }
      away += driven.away_m > 3;
      if (safe.empty()) continue;
      ++with_scans;
      expect_resumes(site, wanted, true);
    }
  EXPECT_GT(away, 2);
  EXPECT_GT(with_scans, 2);
}

TEST(DiskFaults, ARobotThatGoesHomeGoesOnDoingSoWhenTheDiskWorksAgain) {
  const mission_test::SmallSite undisturbed;
  const std::set<std::string> wanted = names(run(undisturbed).record);
  constexpr int kWhileItIsSaved = 345;  // The second scan; its files fail.
  // On the way, and while it waits at home.
  for (const auto& [from_write, seconds] :
       {std::pair(250, 21), std::pair(250, 60), std::pair(kWhileItIsSaved, 60)}) {
    SCOPED_TRACE(testing::Message() << from_write << ", for " << seconds << " s");
    const mission_test::SmallSite site;
    add_to_mission(site, kHome);
    const Driven driven = run_on(site, {from_write, std::chrono::seconds(seconds)});
    const mission::RunRecord& record = driven.outcome.record;
    EXPECT_FALSE(record.completed);
    EXPECT_THAT(record.end, testing::StartsWith("F704-disk-given-up"));
    EXPECT_EQ(record.end.find("journal.sqlite") == std::string::npos,
              from_write == kWhileItIsSaved);
    EXPECT_THAT(record.end,
                HasSubstr("at its start; the disk works again, and the run can be resumed"));
    EXPECT_THAT(record.notes, testing::Contains(HasSubstr("the robot goes home anyway")));
    EXPECT_LT(driven.at_end_m, 0.5);
    EXPECT_EQ(names(record).size(), acknowledged_scans(site.out()).size());
    const fs::path path = site.out() / "journal.sqlite";
    {
      const auto history =
          mission::read_history(mission::JournalFile::open(path).value().read().value(), path)
              .value();
      ASSERT_TRUE(history.ended);
      EXPECT_THAT(history.ended->reason, testing::StartsWith("F704-disk-given-up"));
    }
    expect_resumes(site, wanted, false);
  }
}

TEST(DiskFaults, AMissionGoesOnWhenTheDiskWorksAgainInTime) {
  const mission_test::SmallSite undisturbed, site;
  const std::set<std::string> wanted = names(run(undisturbed).record);
  add_to_mission(site, kHome);
  const Driven driven = run_on(site, {250, std::chrono::seconds(15)});
  EXPECT_EQ(driven.outcome.failure, "");
  EXPECT_TRUE(driven.outcome.record.completed);
  EXPECT_EQ(names(driven.outcome.record), wanted);
  EXPECT_THAT(driven.outcome.record.notes, testing::Contains(HasSubstr("the mission goes on")));
  EXPECT_THAT(driven.outcome.record.notes, testing::Not(testing::Contains(HasSubstr("F704"))));
}

TEST(DiskFaults, WithoutOrdersTheRobotEndsWhereItStands) {
  for (const auto& [text, least, most] :
       {std::tuple("", 300, 303), std::tuple("[disk]\npatience_s = 20\n", 20, 23)}) {
    SCOPED_TRACE(text);
    const mission_test::SmallSite site;
    add_to_mission(site, text);
    const Driven driven = run_on(site, {250, kForGood});
    EXPECT_THAT(driven.outcome.record.end, testing::StartsWith("F700-disk-full: cannot write"));
    EXPECT_GT(driven.at_end_m, 3);
    EXPECT_GE(driven.failed_until_end, std::chrono::seconds(least));
    EXPECT_LE(driven.failed_until_end, std::chrono::seconds(most));
  }
}

class AlmostFull final : public mission::FileCalls {
 public:
  std::int64_t bytes_free(const char*) override {
    return calls_++ == 0 ? 1'000'000'000 : 5'000'000;
  }

 private:
  int calls_ = 0;
};

TEST(DiskFaults, NoScanIsBegunWithoutTwiceItsRoom) {
  const mission_test::SmallSite site;
  AlmostFull disk;
  mission::set_file_calls(&disk);
  const mission::RunOutcome outcome = run(site);
  mission::set_file_calls(nullptr);
  EXPECT_THAT(outcome.failure, HasSubstr("F700-disk-full: cannot write another scan into"));
  EXPECT_THAT(outcome.failure, HasSubstr("5 MB are free"));
  EXPECT_EQ(outcome.record.scans.size(), 1U);
  EXPECT_EQ(scans_kept(site.out()), 1);
}

// --- What a cut leaves.

// How many scans the program knew to be safe: those that were there at the journal's last flush.
int acknowledged(const std::vector<DiskOp>& ops, std::size_t count, const fs::path& from) {
  while (count > 0 && !(ops[count - 1].kind == DiskOp::Kind::sync &&
                        ops[count - 1].path.string().find("journal.sqlite") != std::string::npos))
    --count;
  if (count == 0) return 0;
  const test::TempFolder folder;
  mission_test::make_crash_state(ops, count, nullptr, from, folder.path());
  return fs::exists(folder.path() / "journal.sqlite") ? scans_kept(folder.path()) : 0;
}

TEST(DiskFaults, NoCutLosesWhatWasAcknowledged) {
  const mission_test::SmallSite site;
  std::vector<DiskOp> ops;
  {
    DiskTrace trace;
    ASSERT_EQ(run(site).failure, "");
    ops = trace.ops();
  }
  // Only until the run is finished: then what was measured is removed.
  const auto end = std::ranges::find_if(ops, [](const DiskOp& op) {
    return op.kind == DiskOp::Kind::rename && op.to.filename() == "map.ot";
  });
  const auto cuts = static_cast<std::size_t>(end - ops.begin());
  ASSERT_GT(cuts, 60U);
  std::mt19937_64 dice(3);
  const int states = nightly() ? 5000 : 300;
  const int points = nightly() ? static_cast<int>(cuts) : 50;
  int with_scans = 0;
  for (int point = 0; point < points; ++point) {
    const std::size_t count = nightly() ? static_cast<std::size_t>(point) + 1 : 1 + dice() % cuts;
    const int safe = acknowledged(ops, count, site.out());
    for (int i = 0; i < std::max(1, states / points); ++i) {
      const test::TempFolder left;
      mission_test::make_crash_state(ops, count, &dice, site.out(), left.path());
      const auto run = mission::find_left_run(left.path());
      ASSERT_TRUE(run) << "cut after " << count << ": " << run.error().text();
      const int there = run->has_value() ? static_cast<int>((*run)->history.scans().size()) : 0;
      ASSERT_GE(there, safe) << "cut after " << count;
      if (there == 0) continue;
      ++with_scans;
      EXPECT_EQ((*run)->last_scan_damage, "") << "cut after " << count;
      EXPECT_EQ(scans_kept(left.path()), there);
    }
  }
  EXPECT_GT(with_scans, states / 4);
  std::printf("%d states of cuts among %zu operations, %d with scans\n", states, cuts, with_scans);
}

}  // namespace
