// What a mission must still know after a power cut, event by event: durable before it counts.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/clock.hpp"
#include "hal/compute.hpp"
#include "hal/wake.hpp"
#include "mission/files.hpp"

struct sqlite3;

namespace mission {

struct JournalEvent {
  std::int64_t number{};  // From 1, without gaps; given when it is written.
  hal::Time at{};
  std::string kind;  // "station", "scan", "decision", "fault", ...
  std::string text;  // JSON, on one line.
  bool operator==(const JournalEvent&) const = default;
};

// The file: SQLite with a write-ahead log that is flushed to the disk with every commit. Blocks.
// For one program at a time, on one thread at a time.
class JournalFile {
 public:
  // Makes it where there is none. Fails with errc::device_or_resource_busy when another program has
  // it open, errc::bad_message when it is damaged or no journal, errc::not_supported when a later
  // version made it.
  static FileResult<JournalFile> open(const std::filesystem::path& path);

  // All of them, durable when it returns, or none. Gives them their numbers.
  FileResult<void> append(std::span<JournalEvent> events);
  FileResult<std::vector<JournalEvent>> read() const;

 private:
  struct Close {
    void operator()(sqlite3* db) const;
  };
  JournalFile(std::filesystem::path path, std::unique_ptr<sqlite3, Close> db)
      : path_(std::move(path)), db_(std::move(db)) {}
  FileResult<void> prepare();
  FileResult<void> run(const char* sql) const;
  FileResult<std::int64_t> number(const char* sql) const;
  FileResult<bool> is_new() const;
  FileResult<void> check() const;
  FileError refuse(boost::system::errc::errc_t why, const char* detail) const;
  FileResult<void> insert(std::span<JournalEvent> events);
  FileError error(std::string doing, int result) const;

  std::filesystem::path path_;
  std::unique_ptr<sqlite3, Close> db_;
  std::int64_t last_ = 0;
};

// Writes off the event loop, at most 20 times a second: what comes in between shares a commit.
class Journal {
 public:
  static constexpr hal::Duration kPause = std::chrono::milliseconds(50);
  static constexpr hal::Duration kAgain = std::chrono::seconds(1);  // After a failure.
  static constexpr std::size_t kWaitingMax = 256;                   // More wait for their turn.

  // Clock and compute must outlive it.
  Journal(JournalFile file, hal::Clock& clock, hal::Compute& compute)
      : file_(std::move(file)), clock_(clock), compute_(compute) {}

  hal::Task<void> run();  // Ends only by cancellation.

  // Its number, once it is durable: what could not be written is tried again, in its order, until
  // it is. Needs run().
  hal::Task<std::int64_t> append(std::string kind, std::string text);

  // The same for what nobody waits for: with the next commit, before whatever comes after it. Of
  // more than kToldMax that wait the newest is lost.
  void tell(std::string kind, std::string text);
  static constexpr std::size_t kToldMax = 4096;

  // What still waits, and this, at once: blocks. Only while run() does not.
  FileResult<void> append_now(std::string kind, std::string text);

  std::int64_t commits() const { return commits_; }
  // Why the latest commit failed; nothing: it did not.
  const std::optional<FileError>& trouble() const { return trouble_; }

 private:
  struct Waiting {
    JournalEvent event;
    bool done = false;  // And has its number.
  };
  std::deque<std::shared_ptr<Waiting>> taken();
  hal::Task<void> write(std::deque<std::shared_ptr<Waiting>> batch);

  JournalFile file_;
  hal::Clock& clock_;
  hal::Compute& compute_;
  std::deque<std::shared_ptr<Waiting>> waiting_;
  std::deque<std::shared_ptr<Waiting>> again_;  // Could not be written: goes first.
  hal::Wake came_, went_;
  std::optional<FileError> trouble_;
  std::int64_t commits_ = 0;
};

}  // namespace mission
