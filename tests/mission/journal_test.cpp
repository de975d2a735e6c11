// The journal: what it acknowledged is there, whatever happens to the program.
#include "mission/journal.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <random>

#include "sim/sim_clock.hpp"
#include "tests/mission/disk_trace.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace std::chrono_literals;
using mission::Journal;
using mission::JournalEvent;
using mission::JournalFile;
namespace errc = boost::system::errc;

class JournalTest : public testing::Test {
 protected:
  test::TempFolder folder_;
  std::filesystem::path path_ = folder_.path() / "journal.sqlite";

  JournalFile file() { return JournalFile::open(path_).value(); }
  // As another program would. Exclusively: a disk that was traced once has no shared memory.
  void change(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    const std::string all = "PRAGMA locking_mode=EXCLUSIVE;" + sql;
    EXPECT_EQ(sqlite3_exec(db, all.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    sqlite3_close(db);
  }
  std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::vector<JournalEvent> some(int count) {
    std::vector<JournalEvent> events;
    for (int i = 0; i < count; ++i)
      events.push_back({0, hal::Time(i * 1s), "scan", "{\"station\": " + std::to_string(i) + "}"});
    return events;
  }
};

TEST_F(JournalTest, GivesBackWhatWasWrittenInOrder) {
  std::vector<JournalEvent> first = some(3), second = some(2);
  second[1].text = std::string("umlaut ü, quote ', zero \0, end", 31);
  {
    JournalFile file = this->file();
    ASSERT_TRUE(file.append(first));
    ASSERT_TRUE(file.append(second));
  }
  JournalFile again = file();
  const auto events = again.read().value();
  ASSERT_EQ(events.size(), 5U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(events[i], first[i]);
  EXPECT_EQ(events[4], second[1]);
  EXPECT_EQ(events[4].number, 5);
  std::vector<JournalEvent> third = some(1);
  ASSERT_TRUE(again.append(third));
  EXPECT_EQ(third[0].number, 6);
}

TEST_F(JournalTest, IsForOneProgramAtATime) {
  const JournalFile mine = file();
  const auto other = JournalFile::open(path_);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, errc::device_or_resource_busy) << other.error().text();
}

TEST_F(JournalTest, RefusesWhatIsNoJournalOrDamaged) {
  std::ofstream(path_) << std::string(8192, 'x');
  auto opened = JournalFile::open(path_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, errc::bad_message) << opened.error().text();
  std::filesystem::remove(path_);

  {
    JournalFile whole = file();
    std::vector<JournalEvent> events = some(2000);
    ASSERT_TRUE(whole.append(events));
  }
  {
    std::fstream damage(path_, std::ios::in | std::ios::out | std::ios::binary);
    damage.seekp(5 * 4096);
    damage << std::string(4096, '\x5A');
  }
  opened = JournalFile::open(path_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, errc::bad_message) << opened.error().text();
}

TEST_F(JournalTest, RefusesOtherDatabasesAndLaterVersions) {
  change("CREATE TABLE other (x)");
  const std::string before = bytes();
  EXPECT_EQ(JournalFile::open(path_).error().code, errc::bad_message);
  EXPECT_EQ(bytes(), before) << "it is not ours to change";
  std::filesystem::remove(path_);
  (void)file();
  change("PRAGMA user_version=2");
  EXPECT_EQ(JournalFile::open(path_).error().code, errc::not_supported);
  change("PRAGMA user_version=1; INSERT INTO events VALUES (7, 0, 'scan', '')");
  EXPECT_EQ(JournalFile::open(path_).error().code, errc::bad_message) << "events are missing";
  change(
      "DELETE FROM events; PRAGMA writable_schema=ON;"
      "UPDATE sqlite_master SET sql = replace(sql, 'text TEXT NOT NULL', 'text TEXT')");
  change(
      "INSERT INTO events VALUES (1, 0, 'scan', NULL); PRAGMA writable_schema=ON;"
      "UPDATE sqlite_master SET sql = replace(sql, 'text TEXT', 'text TEXT NOT NULL')");
  EXPECT_THAT(JournalFile::open(path_).error().text(), testing::HasSubstr("it is damaged"))
      << "an event without text";
}

TEST_F(JournalTest, RefusesWhatOnlyCallsItselfAJournal) {
  change("PRAGMA user_version=1");
  EXPECT_EQ(JournalFile::open(path_).error().code, errc::bad_message) << "of another program";
  change("PRAGMA application_id=" + std::to_string(0x56544A31));
  EXPECT_THAT(JournalFile::open(path_).error().text(), testing::HasSubstr("no such table"));
}

// To whom files that may not be written are closed; root opens everything.
class NotRoot {
 public:
  NotRoot() {
    if (was_ == 0) EXPECT_EQ(seteuid(65534), 0);
  }
  ~NotRoot() { EXPECT_EQ(seteuid(was_), 0); }

 private:
  const uid_t was_ = geteuid();
};

TEST_F(JournalTest, SaysThatItMayOnlyBeRead) {
  using std::filesystem::perms;
  (void)file();
  std::filesystem::permissions(path_, perms::owner_read | perms::group_read | perms::others_read);
  std::filesystem::permissions(folder_.path(), perms::all);
  const NotRoot not_root;
  const auto opened = JournalFile::open(path_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, errc::read_only_file_system) << opened.error().text();
}

// SQLite's memory, of which one piece is refused. No database may be open at its begin or end.
class FailingMemory {
 public:
  FailingMemory() {
    sqlite3_shutdown();
    sqlite3_config(SQLITE_CONFIG_GETMALLOC, &real_);
    sqlite3_mem_methods failing = real_;
    failing.xMalloc = [](int size) { return is_refused() ? nullptr : real_.xMalloc(size); };
    failing.xRealloc = [](void* old, int size) {
      return is_refused() ? nullptr : real_.xRealloc(old, size);
    };
    sqlite3_config(SQLITE_CONFIG_MALLOC, &failing);
    sqlite3_config(SQLITE_CONFIG_LOOKASIDE, 0, 0);  // Every piece, however small.
    sqlite3_initialize();
  }
  ~FailingMemory() {
    sqlite3_shutdown();
    sqlite3_config(SQLITE_CONFIG_MALLOC, &real_);
    sqlite3_config(SQLITE_CONFIG_LOOKASIDE, 1200, 40);
    sqlite3_initialize();
  }
  void refuse(int piece) { left_ = piece; }  // From 1; 0: none.
  bool refused() const { return left_ == 0; }

 private:
  static bool is_refused() { return left_ > 0 && --left_ == 0; }
  static inline sqlite3_mem_methods real_{};
  static inline int left_ = 0;
};

// Where writing costs nothing, as it is done thousands of times.
std::filesystem::path quick_folder() {
  return std::filesystem::is_directory("/dev/shm") ? "/dev/shm"
                                                   : std::filesystem::temp_directory_path();
}

class WithoutMemory : public JournalTest, public testing::WithParamInterface<bool> {
 protected:
  WithoutMemory() { path_ = quick_.path() / "journal.sqlite"; }

  test::TempFolder quick_{quick_folder()};
  FailingMemory memory_;
  std::vector<JournalEvent> kept_;

  void begin() {
    for (const char* more : {"", "-wal", "-journal"})
      std::filesystem::remove(path_.string() + more);
    if (GetParam()) std::filesystem::copy_file(quick_.path() / "before.sqlite", path_);
  }
  // An error, or what is there. Whatever was acknowledged is in kept_.
  void use() {
    auto opened = JournalFile::open(path_);
    if (!opened) return is_named(opened.error());
    std::vector<JournalEvent> more = some(2);
    const auto appended = opened->append(more);
    if (appended) kept_.insert(kept_.end(), more.begin(), more.end());
    if (!appended) is_named(appended.error());
    const auto events = opened->read();
    if (!events) return is_named(events.error());
    EXPECT_EQ(*events, kept_);
  }
  static void is_named(const mission::FileError& error) {
    EXPECT_THAT(error.text(), testing::HasSubstr("cannot "));
    EXPECT_EQ(error.code, errc::not_enough_memory) << error.text();
  }
};

TEST_P(WithoutMemory, NamesItAndKeepsWhatItAcknowledged) {
  std::vector<JournalEvent> before = some(3);
  if (GetParam()) {
    path_ = quick_.path() / "before.sqlite";
    ASSERT_TRUE(file().append(before));
    path_ = quick_.path() / "journal.sqlite";
  } else {
    before.clear();
  }
  int piece = 1;
  for (bool refused = true; refused; ++piece) {
    SCOPED_TRACE(piece);
    begin();
    kept_ = before;
    memory_.refuse(piece);
    use();
    refused = memory_.refused();
    memory_.refuse(0);
    ASSERT_EQ(file().read().value(), kept_);
  }
  EXPECT_GT(piece, 100);
}
INSTANTIATE_TEST_SUITE_P(Of, WithoutMemory, testing::Bool(), [](const auto& param) {
  return std::string(param.param ? "AFileThatIsThere" : "ANewFile");
});

TEST_F(JournalTest, NamesAFolderThatIsNotThere) {
  const auto opened = JournalFile::open(folder_.path() / "no" / "journal.sqlite");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().text(), testing::HasSubstr("cannot open"));
}

// A child that writes for ever, and tells each acknowledged number.
int run_child(const std::filesystem::path& path, int tell) {
  auto opened = JournalFile::open(path);
  if (!opened) return 1;
  for (;;) {
    std::vector<JournalEvent> one{{0, hal::Time(1s), "scan", std::string(300, 's')}};
    if (!opened->append(one)) return 2;
    if (write(tell, &one[0].number, sizeof one[0].number) != sizeof one[0].number) return 3;
  }
}

TEST_F(JournalTest, KeepsEveryAcknowledgedEventThroughKills) {
  const int kills = std::getenv("VANTAGE_NIGHTLY") != nullptr ? 1000 : 25;
  std::mt19937 dice(7);
  std::int64_t acknowledged = 0;
  for (int i = 0; i < kills; ++i) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) _exit(run_child(path_, ends[1]));
    close(ends[1]);
    usleep(5000 + dice() % 20000);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself: " << WEXITSTATUS(status);
    std::int64_t number = 0;
    while (::read(ends[0], &number, sizeof number) == sizeof number) {
      ASSERT_EQ(number, acknowledged + 1) << "after kill " << i;
      acknowledged = number;
    }
    close(ends[0]);
    const auto events = file().read().value();
    ASSERT_GE(static_cast<std::int64_t>(events.size()), acknowledged) << "lost by kill " << i;
    ASSERT_LE(static_cast<std::int64_t>(events.size()), acknowledged + 1);
    acknowledged = static_cast<std::int64_t>(events.size());  // One may be written and not told.
  }
  EXPECT_GT(acknowledged, kills) << "they wrote hardly anything";
}

// As on a disk that is full: files may not grow any more.
int fill_up(const std::filesystem::path& path) {
  auto opened = JournalFile::open(path);
  signal(SIGXFSZ, SIG_IGN);
  const rlimit small{300'000, 300'000};
  if (!opened || setrlimit(RLIMIT_FSIZE, &small) != 0) return 1;
  for (int i = 0; i < 1000; ++i) {
    std::vector<JournalEvent> one{{0, hal::Time(1s), "scan", std::string(2000, 's')}};
    if (const auto done = opened->append(one); !done)
      return done.error().text().find("cannot write") == 0 && opened->read() ? 7 : 2;
  }
  return 3;
}

TEST_F(JournalTest, SaysThatTheDiskIsFullAndKeepsTheRest) {
  const pid_t child = fork();
  if (child == 0) _exit(fill_up(path_));
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_GT(file().read().value().size(), 20U);
}

// --- Off the event loop.

struct Writing : JournalTest {
  boost::asio::io_context io;
  sim::SimClock clock{io};
  hal::ComputeHere compute;
  std::unique_ptr<Journal> journal;
  std::vector<std::int64_t> numbers;

  static void rethrow(std::exception_ptr problem) {
    if (problem) std::rethrow_exception(problem);
  }
  void make() {
    journal = std::make_unique<Journal>(file(), clock, compute);
    boost::asio::co_spawn(io, journal->run(), rethrow);
  }
  hal::Task<void> append(int times) {
    for (int i = 0; i < times; ++i) {
      const std::int64_t number = co_await journal->append("scan", "{}");
      numbers.push_back(number);
    }
  }
};

TEST_F(Writing, CommitsTwentyTimesASecondAtMost) {
  make();
  boost::asio::co_spawn(io, append(41), rethrow);
  ASSERT_TRUE(clock.run([&] { return numbers.size() == 41; }));
  EXPECT_GE(clock.now(), hal::Time(2s));
  EXPECT_EQ(journal->commits(), 41);
}

TEST_F(Writing, SharesACommitAmongWhatComesTogetherWithinItsBound) {
  make();
  for (int i = 0; i < 600; ++i) boost::asio::co_spawn(io, append(1), rethrow);
  ASSERT_TRUE(clock.run([&] { return numbers.size() == 600; }));
  EXPECT_LE(journal->commits(), 4);
  EXPECT_GE(journal->commits(), 3) << "600 at once, and only 256 may wait";
  std::ranges::sort(numbers);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    ASSERT_EQ(numbers[i], static_cast<std::int64_t>(i) + 1);
}

TEST_F(Writing, ForgetsTheNewestOfWhatIsOnlyToldWhenTooMuchWaits) {
  make();
  for (std::size_t i = 0; i < Journal::kToldMax + 10; ++i) journal->tell("place", "{}");
  const auto last = journal->append_now("end", "{}");
  ASSERT_TRUE(last) << last.error().text();
  journal.reset();
  const auto events = file().read().value();
  ASSERT_EQ(events.size(), Journal::kToldMax + 1) << "all that waited, and then the end";
  EXPECT_EQ(events.front().kind, "place");
  EXPECT_EQ(events.back().kind, "end");
}

TEST_F(Writing, WaitsForADiskThatIsFullAndWritesAllOfItInItsOrder) {
  bool full = false;
  mission_test::DiskTrace trace([&](mission_test::DiskOp::Kind kind) {
    return full && kind == mission_test::DiskOp::Kind::write ? ENOSPC : 0;
  });
  make();
  boost::asio::co_spawn(io, append(3), rethrow);
  ASSERT_TRUE(clock.run([&] { return numbers.size() == 3; }));
  EXPECT_FALSE(journal->trouble());
  full = true;
  journal->tell("place", "{}");
  boost::asio::co_spawn(io, append(2), rethrow);
  ASSERT_TRUE(clock.run([&] { return clock.now() > hal::Time(10s); }));
  EXPECT_EQ(numbers.size(), 3U) << "acknowledged, and not durable";
  ASSERT_TRUE(journal->trouble());
  EXPECT_EQ(journal->trouble()->code, boost::system::errc::no_space_on_device);
  full = false;
  ASSERT_TRUE(clock.run([&] { return numbers.size() == 5; }));
  EXPECT_FALSE(journal->trouble());
  EXPECT_EQ(numbers, (std::vector<std::int64_t>{1, 2, 3, 5, 6}));
}

}  // namespace
