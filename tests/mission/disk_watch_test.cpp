// Whether the disk takes what has to be kept, and since when it has not.
#include "mission/disk_watch.hpp"

#include <gmock/gmock.h>

#include "tests/drivers/allocations.hpp"

namespace disk_watch_tests {
namespace {

using namespace std::chrono_literals;
using mission::DiskWatch;
using mission::FaultCode;
using mission::FileError;
using testing::HasSubstr;
using Part = DiskWatch::Part;
namespace errc = boost::system::errc;

FileError cannot_write(const char* path, errc::errc_t why) {
  return {path, "write", errc::make_error_code(why)};
}
const FileError kFull = cannot_write("runs/7/scans/0003.ply", errc::no_space_on_device);
const FileError kBroken = cannot_write("runs/7/journal.sqlite", errc::io_error);

TEST(DiskWatch, IsWellUntilSomethingFails) {
  DiskWatch disk;
  EXPECT_TRUE(disk.well());
  EXPECT_FALSE(disk.fault());
  EXPECT_EQ(disk.text(), "");
  EXPECT_FALSE(disk.given_up(hal::Time(24h))) << "nothing failed";
  EXPECT_FALSE(disk.works(Part::files)) << "no news";
}

TEST(DiskWatch, NamesWhatFails) {
  for (const auto& [why, fault] :
       {std::pair(errc::no_space_on_device, FaultCode::disk_full),
        std::pair(errc::read_only_file_system, FaultCode::disk_read_only),
        std::pair(errc::io_error, FaultCode::disk_failed)}) {
    DiskWatch disk;
    EXPECT_TRUE(disk.failed(Part::journal, cannot_write("journal.sqlite", why), hal::Time(1s)));
    EXPECT_EQ(disk.fault(), fault);
    EXPECT_THAT(disk.text(), HasSubstr(std::string(mission::entry_of(fault).id) +
                                       ": cannot write journal.sqlite"));
  }
}

TEST(DiskWatch, TellsEachTroubleOnceHoweverOftenItIsTried) {
  DiskWatch disk;
  EXPECT_TRUE(disk.failed(Part::files, kFull, hal::Time(10s)));
  EXPECT_FALSE(disk.failed(Part::files, kFull, hal::Time(12s)));
  EXPECT_FALSE(disk.failed(Part::journal, kBroken, hal::Time(13s)));
  EXPECT_EQ(disk.lasted(hal::Time(15s)), 5s) << "since it first failed";
}

TEST(DiskWatch, IsWellOnlyWhenFilesAndJournalAre) {
  DiskWatch disk;
  disk.failed(Part::files, kFull, hal::Time(10s));
  disk.failed(Part::journal, kBroken, hal::Time(11s));
  EXPECT_FALSE(disk.works(Part::files));
  EXPECT_EQ(disk.fault(), FaultCode::disk_failed) << "the journal's";
  EXPECT_THAT(disk.text(), HasSubstr("journal.sqlite"));
  EXPECT_TRUE(disk.works(Part::journal));
  EXPECT_TRUE(disk.well());
  EXPECT_FALSE(disk.works(Part::journal)) << "told before";
}

TEST(DiskWatch, SaysTheFilesReasonWhereBothFail) {
  DiskWatch disk;
  disk.failed(Part::journal, kBroken, hal::Time(10s));
  disk.failed(Part::files, kFull, hal::Time(11s));
  EXPECT_EQ(disk.fault(), FaultCode::disk_full);
  EXPECT_THAT(disk.text(), HasSubstr("0003.ply"));
}

TEST(DiskWatch, GivesUpWhenPatienceIsOverAndNotWhenItWorksBetween) {
  DiskWatch disk;
  disk.failed(Part::files, kFull, hal::Time(10s));
  EXPECT_FALSE(disk.given_up(hal::Time(10s) + DiskWatch::kPatience));
  EXPECT_TRUE(disk.given_up(hal::Time(10s) + DiskWatch::kPatience + 1ns));
  disk.works(Part::files);
  EXPECT_FALSE(disk.given_up(hal::Time(24h)));
  disk.failed(Part::files, kFull, hal::Time(1h));
  EXPECT_FALSE(disk.given_up(hal::Time(1h) + DiskWatch::kPatience)) << "patience begins anew";
  // What fails beside it does not begin it anew.
  disk.failed(Part::journal, kBroken, hal::Time(1h + 4min));
  EXPECT_FALSE(disk.works(Part::files));
  EXPECT_TRUE(disk.given_up(hal::Time(1h) + DiskWatch::kPatience + 1ns));
}

TEST(DiskWatch, AnswersAsItIsTold) {
  using Answer = DiskWatch::Answer;
  for (const auto& [home, over] :
       {std::pair(false, Answer::ends), std::pair(true, Answer::goes_home)}) {
    DiskWatch disk(20s, home);
    EXPECT_EQ(disk.answer(hal::Time(24h)), Answer::goes_on) << "nothing failed";
    disk.failed(Part::files, kFull, hal::Time(10s));
    EXPECT_EQ(disk.answer(hal::Time(10s)), Answer::stands);
    EXPECT_EQ(disk.answer(hal::Time(30s)), Answer::stands);
    EXPECT_EQ(disk.answer(hal::Time(30s + 1ns)), over);
    disk.works(Part::files);
    EXPECT_EQ(disk.answer(hal::Time(31s)), Answer::goes_on) << "it works again in time";
  }
}

TEST(DiskWatch, GoesHomeWhateverBecomesOfTheDisk) {
  DiskWatch disk(20s, true);
  disk.failed(Part::journal, kBroken, hal::Time(10s));
  EXPECT_FALSE(disk.goes_home());
  disk.go_home();
  disk.works(Part::journal);
  EXPECT_TRUE(disk.well());
  EXPECT_TRUE(disk.goes_home());
  EXPECT_EQ(disk.answer(hal::Time(40s)), DiskWatch::Answer::goes_home);
}

// The gate asks in every cycle.
TEST(DiskWatch, AllocatesNothingWhenAsked) {
  DiskWatch disk;
  disk.failed(Part::files, kFull, hal::Time(10s));
  const auto before = drivers_test::allocations();
  const auto fault = disk.fault();
  const bool over = disk.given_up(hal::Time(20s));
  EXPECT_EQ(drivers_test::allocations(), before);
  EXPECT_EQ(fault, FaultCode::disk_full);
  EXPECT_FALSE(over);
}

}  // namespace
}  // namespace disk_watch_tests
