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
