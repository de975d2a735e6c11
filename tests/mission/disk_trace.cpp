#include "tests/mission/disk_trace.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <mutex>

namespace mission_test {
namespace {

namespace fs = std::filesystem;
using Kind = DiskOp::Kind;

thread_local DiskTrace* tracing = nullptr;  // Null: this thread's files are on a sound disk.

int asked(Kind kind) {
  return tracing == nullptr ? 0 : tracing->asked(kind);
}

void note(DiskOp op) {
  if (tracing != nullptr) tracing->note(std::move(op));
}

int number_of(const fs::path& path, bool created) {
  return tracing == nullptr ? 0 : tracing->number_of(path, created);
}

// Hands each thread's calls to the trace that it has.
class ByThread final : public mission::FileCalls {
 public:
  int open(const char* path, int flags, unsigned mode) override {
    return tracing == nullptr ? FileCalls::open(path, flags, mode)
                              : tracing->open(path, flags, mode);
  }
  std::ptrdiff_t write(int fd, const void* bytes, std::size_t count) override {
    return tracing == nullptr ? FileCalls::write(fd, bytes, count)
                              : tracing->write(fd, bytes, count);
  }
  int fsync(int fd) override {
    return tracing == nullptr ? FileCalls::fsync(fd) : tracing->fsync(fd);
  }
  int ftruncate(int fd, std::int64_t bytes) override {
    return tracing == nullptr ? FileCalls::ftruncate(fd, bytes) : tracing->ftruncate(fd, bytes);
  }
  int rename(const char* from, const char* to) override {
    return tracing == nullptr ? FileCalls::rename(from, to) : tracing->rename(from, to);
  }
  int unlink(const char* path) override {
    return tracing == nullptr ? FileCalls::unlink(path) : tracing->unlink(path);
  }
};

// --- SQLite's files: its own, with us in between.

struct TracedFile {
  sqlite3_file base;
  sqlite3_file* real;
  fs::path* path;
  bool folder_synced;
};

TracedFile& traced(sqlite3_file* file) {
  return *reinterpret_cast<TracedFile*>(file);
}

int close_file(sqlite3_file* file) {
  delete std::exchange(traced(file).path, nullptr);
  return traced(file).real->pMethods->xClose(traced(file).real);
}
int read_file(sqlite3_file* file, void* to, int count, sqlite3_int64 at) {
  return traced(file).real->pMethods->xRead(traced(file).real, to, count, at);
}
int write_file(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 at) {
  const int failure = asked(Kind::write);
  if (failure > 0) return failure == ENOSPC ? SQLITE_FULL : SQLITE_IOERR_WRITE;
  note({Kind::write,
        number_of(*traced(file).path, false),
        *traced(file).path,
        {},
        at,
        std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(count))});
  return traced(file).real->pMethods->xWrite(traced(file).real, bytes, count, at);
}
int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  if (asked(Kind::truncate) > 0) return SQLITE_IOERR_TRUNCATE;
  note({Kind::truncate, number_of(*traced(file).path, false), *traced(file).path, {}, size, {}});
  return traced(file).real->pMethods->xTruncate(traced(file).real, size);
}
// The first flush of a new file flushes its folder too, as SQLite's own layer does.
int sync_file(sqlite3_file* file, int flags) {
  if (asked(Kind::sync) > 0) return SQLITE_IOERR_FSYNC;
  if (tracing == nullptr) return traced(file).real->pMethods->xSync(traced(file).real, flags);
  // The test's own disk need not be flushed.
  const fs::path& path = *traced(file).path;
  note({Kind::sync, number_of(path, false), path, {}, 0, {}});
  if (!std::exchange(traced(file).folder_synced, true))
    note({Kind::sync_folder, 0, path.parent_path(), {}, 0, {}});
  return SQLITE_OK;
}
int size_of_file(sqlite3_file* file, sqlite3_int64* size) {
  return traced(file).real->pMethods->xFileSize(traced(file).real, size);
}
int lock_file(sqlite3_file* file, int how) {
  return traced(file).real->pMethods->xLock(traced(file).real, how);
}
int unlock_file(sqlite3_file* file, int how) {
  return traced(file).real->pMethods->xUnlock(traced(file).real, how);
}
int reserved(sqlite3_file* file, int* out) {
  return traced(file).real->pMethods->xCheckReservedLock(traced(file).real, out);
}
int control(sqlite3_file* file, int what, void* argument) {
  return traced(file).real->pMethods->xFileControl(traced(file).real, what, argument);
}
int sector_size(sqlite3_file*) {
  return 512;
}
int characteristics(sqlite3_file*) {
  return 0;  // Nothing is promised: no atomic writes, no order.
}

const sqlite3_io_methods kMethods{
    1,         close_file,  read_file, write_file, truncate_file, sync_file,       size_of_file,
    lock_file, unlock_file, reserved,  control,    sector_size,   characteristics, nullptr,
    nullptr,   nullptr,     nullptr,   nullptr,    nullptr};

sqlite3_vfs* real_vfs = nullptr;

int open_file(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out) {
  TracedFile& mine = traced(file);
  mine.base.pMethods = nullptr;
  if (name == nullptr) return SQLITE_CANTOPEN;  // Temporary ones: we need none.
  if (asked(Kind::create) > 0) return SQLITE_CANTOPEN;
  const bool there = fs::exists(name);
  mine.real = reinterpret_cast<sqlite3_file*>(&mine + 1);
  const int done = real_vfs->xOpen(real_vfs, name, mine.real, flags, out);
  if (done != SQLITE_OK) return done;
  mine.base.pMethods = &kMethods;
  mine.path = new fs::path(name);
  mine.folder_synced = there;
  if (!there) note({Kind::create, number_of(*mine.path, true), *mine.path, {}, 0, {}});
  return SQLITE_OK;
}
int delete_file(sqlite3_vfs*, const char* name, int sync_folder) {
  if (asked(Kind::remove) > 0) return SQLITE_IOERR_DELETE;
  const int done = real_vfs->xDelete(real_vfs, name, sync_folder);
  if (done != SQLITE_OK) return done;
  note({Kind::remove, number_of(name, false), name, {}, 0, {}});
  if (sync_folder != 0) note({Kind::sync_folder, 0, fs::path(name).parent_path(), {}, 0, {}});
  return SQLITE_OK;
}

// SQLite's own, but for files.
sqlite3_vfs& traced_vfs() {
  static sqlite3_vfs vfs = [] {
    real_vfs = sqlite3_vfs_find(nullptr);
    sqlite3_vfs made = *real_vfs;
    made.zName = "traced";
    made.pNext = nullptr;
    made.szOsFile = static_cast<int>(sizeof(TracedFile)) + real_vfs->szOsFile;
    made.xOpen = open_file;
    made.xDelete = delete_file;
    return made;
  }();
  return vfs;
}

}  // namespace

// Both sides of the seam stay in place: without a trace they only hand on.
DiskTrace::DiskTrace(Fail fail) : fail_(std::move(fail)) {
  static std::mutex mutex;
  static ByThread by_thread;
  const std::scoped_lock lock(mutex);
  if (real_vfs == nullptr) sqlite3_vfs_register(&traced_vfs(), 1);
  if (&mission::file_calls() != &by_thread) mission::set_file_calls(&by_thread);
  tracing = this;
}

DiskTrace::~DiskTrace() {
  tracing = nullptr;
}

void DiskTrace::note(DiskOp op) {
  if (record) ops_.push_back(std::move(op));
}

int DiskTrace::number_of(const fs::path& path, bool created) {
  const auto found = numbers_.find(path);
  if (found != numbers_.end() && !created) return found->second;
  return numbers_[path] = ++files_;
}

int DiskTrace::open(const char* path, int flags, unsigned mode) {
  if (const int failure = asked(Kind::create); failure > 0) {
    errno = failure;
    return -1;
  }
  const bool there = fs::exists(path);
  const int fd = FileCalls::open(path, flags, mode);
  if (fd < 0) return fd;
  opened_[fd] = {
      path, false,
      (flags & O_APPEND) != 0 && there ? static_cast<std::int64_t>(fs::file_size(path)) : 0};
  if (!there)
    note({Kind::create, number_of(path, true), path, {}, 0, {}});
  else if ((flags & O_TRUNC) != 0)
    note({Kind::truncate, number_of(path, false), path, {}, 0, {}});
  return fd;
}

std::ptrdiff_t DiskTrace::write(int fd, const void* bytes, std::size_t count) {
  const int failure = asked(Kind::write);
  if (failure > 0) {
    errno = failure;
    return -1;
  }
  if (failure < 0) count = (count + 1) / 2;
  const std::ptrdiff_t wrote = FileCalls::write(fd, bytes, count);
  const auto file = opened_.find(fd);
  if (wrote <= 0 || file == opened_.end()) return wrote;
  note({Kind::write,
        number_of(file->second.path, false),
        file->second.path,
        {},
        file->second.at,
        std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(wrote))});
  file->second.at += wrote;
  return wrote;
}

int DiskTrace::fsync(int fd) {
  if (const int failure = asked(Kind::sync); failure > 0) {
    errno = failure;
    return -1;
  }
  // Folders are opened past us.
  char name[4096] = {};
  const auto link = "/proc/self/fd/" + std::to_string(fd);
  if (::readlink(link.c_str(), name, sizeof name - 1) > 0 && fs::is_directory(name))
    note({Kind::sync_folder, 0, name, {}, 0, {}});
  else if (const auto file = opened_.find(fd); file != opened_.end())
    note({Kind::sync, number_of(file->second.path, false), file->second.path, {}, 0, {}});
  return 0;  // The test's own disk need not.
}

int DiskTrace::ftruncate(int fd, std::int64_t bytes) {
  if (const int failure = asked(Kind::truncate); failure > 0) {
    errno = failure;
    return -1;
  }
  if (const auto file = opened_.find(fd); file != opened_.end()) {
    note({Kind::truncate, number_of(file->second.path, false), file->second.path, {}, bytes, {}});
    file->second.at = bytes;
  }
  return FileCalls::ftruncate(fd, bytes);
}

int DiskTrace::rename(const char* from, const char* to) {
  if (const int failure = asked(Kind::rename); failure > 0) {
    errno = failure;
    return -1;
  }
  note({Kind::rename, number_of(from, false), from, to, 0, {}});
  numbers_[to] = number_of(from, false);
  numbers_.erase(from);
  return FileCalls::rename(from, to);
}

int DiskTrace::unlink(const char* path) {
  if (const int failure = asked(Kind::remove); failure > 0) {
    errno = failure;
    return -1;
  }
  const int done = FileCalls::unlink(path);
  if (done == 0) note({Kind::remove, number_of(path, false), path, {}, 0, {}});
  return done;
}

namespace {

// The disk, as far as the operations go.
struct Disk {
  std::map<int, std::string> contents;
  std::map<fs::path, int> names;

  void apply_to_folder(const DiskOp& op) {
    if (op.kind == Kind::create) names[op.path] = op.file;
    if (op.kind == Kind::rename) {
      names.erase(op.path);
      names[op.to] = op.file;
    }
    if (op.kind == Kind::remove) names.erase(op.path);
  }
  void write(const DiskOp& op, std::size_t first, std::size_t count) {
    std::string& file = contents[op.file];
    const std::size_t from = static_cast<std::size_t>(op.at) + first;
    if (file.size() < from + count) file.resize(from + count, '\0');
    op.bytes.copy(file.data() + from, count, first);
  }
};

bool is_of_folder(Kind kind) {
  return kind == Kind::create || kind == Kind::rename || kind == Kind::remove;
}

// Whether a later flush among the first `count` has brought it to the disk.
bool is_flushed(const std::vector<DiskOp>& ops, std::size_t i, std::size_t count) {
  for (std::size_t later = i + 1; later < count; ++later) {
    const DiskOp& op = ops[later];
    if (is_of_folder(ops[i].kind)) {
      if (op.kind == Kind::sync_folder && op.path == ops[i].path.parent_path()) return true;
    } else if (op.kind == Kind::sync && op.file == ops[i].file) {
      return true;
    }
  }
  return false;
}

}  // namespace

void make_crash_state(const std::vector<DiskOp>& ops, std::size_t count, std::mt19937_64* dice,
                      const fs::path& from, const fs::path& folder) {
  constexpr std::size_t kSector = 512;
  Disk disk;
  bool folders_go_on = true;
  for (std::size_t i = 0; i < count; ++i) {
    const DiskOp& op = ops[i];
    const bool sure = dice == nullptr || is_flushed(ops, i, count);
    const auto chance = [&] { return sure || (*dice)() % 2 == 0; };
    if (is_of_folder(op.kind)) {
      // Ordered: what is flushed brings everything before it, and after one that is not, none.
      if (!sure && folders_go_on) folders_go_on = (*dice)() % 4 != 0;
      if (sure || folders_go_on) disk.apply_to_folder(op);
      if (op.kind == Kind::create) disk.contents[op.file];
    } else if (op.kind == Kind::truncate) {
      if (chance()) disk.contents[op.file].resize(static_cast<std::size_t>(op.at), '\0');
    } else if (op.kind == Kind::write) {
      const bool torn = !sure && (*dice)() % 2 == 0;
      const bool all = chance();
      for (std::size_t at = 0; at < op.bytes.size(); at += kSector)
        if (torn ? chance() : all) disk.write(op, at, std::min(kSector, op.bytes.size() - at));
    }
  }
  fs::create_directories(folder / "scans");
  for (const auto& [path, file] : disk.names) {
    const fs::path to = folder / path.lexically_relative(from);
    std::ofstream(to, std::ios::binary) << disk.contents[file];
  }
}

}  // namespace mission_test
