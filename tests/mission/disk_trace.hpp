// A disk as a program sees it through its files: any call can be made to fail, all calls can be
// recorded, and what a power cut would have left can be made from the record. SQLite's files too.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "mission/files.hpp"

namespace mission_test {

// What happened to files, in order. `file` is a number that stays the same when it is renamed.
struct DiskOp {
  enum class Kind { create, write, truncate, sync, rename, remove, sync_folder } kind{};
  int file{};
  std::filesystem::path path, to;  // To: of a rename.
  std::int64_t at{};               // Of a write; the new length of truncate.
  std::string bytes;
};

class DiskTrace final : public mission::FileCalls {
 public:
  // Asked before each call: an errno makes it fail, and -1 makes a write short.
  using Fail = std::function<int(DiskOp::Kind kind)>;

  // From now on all file calls of the mission on this thread, and SQLite's, go through this; one at
  // a time.
  explicit DiskTrace(Fail fail = {});
  ~DiskTrace() override;

  const std::vector<DiskOp>& ops() const { return ops_; }
  bool record = true;

  int open(const char* path, int flags, unsigned mode) override;
  std::ptrdiff_t write(int fd, const void* bytes, std::size_t count) override;
  int fsync(int fd) override;
  int ftruncate(int fd, std::int64_t bytes) override;
  int rename(const char* from, const char* to) override;
  int unlink(const char* path) override;

  // For the other side of the seam.
  int asked(DiskOp::Kind kind) { return fail_ ? fail_(kind) : 0; }
  void note(DiskOp op);
  int number_of(const std::filesystem::path& path, bool created);

 private:
  struct Opened {
    std::filesystem::path path;
    bool folder{};
    std::int64_t at{};
  };
  Fail fail_;
  std::vector<DiskOp> ops_;
  std::map<int, Opened> opened_;
  std::map<std::filesystem::path, int> numbers_;
  int files_ = 0;
};

// Makes `folder` as the disk may be after a cut behind the first `count` operations, where `from`
// was the folder that they happened in. Without dice everything has come to the disk. With them
// what was not flushed has come or not, in parts of 512 bytes; renames, new and removed files have
// come in their order, up to some one.
void make_crash_state(const std::vector<DiskOp>& ops, std::size_t count, std::mt19937_64* dice,
                      const std::filesystem::path& from, const std::filesystem::path& folder);

}  // namespace mission_test
