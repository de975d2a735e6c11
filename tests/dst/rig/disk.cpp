#include "tests/dst/rig/disk.hpp"

#include <algorithm>
#include <cerrno>
#include <random>

namespace dst {
namespace {

namespace fs = std::filesystem;
using Kind = mission_test::DiskOp::Kind;

constexpr hal::Duration kSlowFlush = std::chrono::milliseconds(400);

bool is_of_journal(const std::filesystem::path& path) {
  return path.filename().string().starts_with("journal.sqlite");
}

}  // namespace

Disk::Disk(std::filesystem::path folder)
    : folder_(std::move(folder)), trace_([this](Kind kind) { return answer(kind); }) {
  if (fs::exists(folder_)) note_what_is_there();
}

// The journal's files come last: up to their flush everything is there.
void Disk::note_what_is_there() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::ranges::sort(files, {}, [](const fs::path& path) {
    return std::pair(is_of_journal(path), path.string());
  });
  const auto note = [this](Kind kind, const fs::path& path, std::string bytes) {
    const int file = trace_.number_of(path, kind == Kind::create);
    trace_.note({kind, file, path, {}, 0, std::move(bytes)});
  };
  for (const fs::path& path : files) {
    note(Kind::create, path, {});
    note(Kind::write, path, mission::read_file(path).value());
  }
  for (const fs::path& inside : {folder_, folder_ / "scans"})
    trace_.note({Kind::sync_folder, 0, inside, {}, 0, {}});
  for (const fs::path& path : files) note(Kind::sync, path, {});
}

// An errno, or -1 for a short write.
int Disk::answer(Kind kind) {
  if (!fault_) return 0;
  switch (*fault_) {
    case DiskFault::full:
      return kind == Kind::write ? ENOSPC : 0;
    case DiskFault::io_error:
      return EIO;
    case DiskFault::short_writes:
      return kind == Kind::write ? -1 : 0;
    case DiskFault::slow_flushes:
      break;
  }
  if (kind == Kind::sync) waited_ += kSlowFlush;
  return 0;
}

void Disk::copy_flushed(const std::filesystem::path& to) const {
  const auto& ops = trace_.ops();
  std::size_t count = 0;
  for (std::size_t i = 0; i < ops.size(); ++i)
    if (ops[i].kind == Kind::sync && is_of_journal(ops[i].path)) count = i + 1;
  mission_test::make_crash_state(ops, count, nullptr, folder_, to);
}

void Disk::copy_cut(std::uint64_t seed, const std::filesystem::path& to) const {
  std::mt19937_64 dice(seed);
  mission_test::make_crash_state(trace_.ops(), trace_.ops().size(), &dice, folder_, to);
}

void Disk::copy(const std::filesystem::path& to) const {
  mission_test::make_crash_state(trace_.ops(), trace_.ops().size(), nullptr, folder_, to);
}

hal::Task<void> ComputeOnDisk::run(std::function<void()> work) {
  co_await here_.run(std::move(work));
  if (const hal::Duration waited = disk_.take_waited(); waited > hal::Duration{})
    co_await clock_.sleep_for(waited);
}

}  // namespace dst
