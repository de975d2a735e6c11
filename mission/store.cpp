#include "mission/store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <utility>

#include "mission/beams_file.hpp"
#include "mission/json_text.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDecisions = "decisions.jsonl";
// In the order in which an earlier run's are removed: what claims a finished run goes first.
constexpr std::string_view kProducts[] = {"report.html", "summary.json", "map.ot", "cloud.ply"};

FileError failed(const fs::path& path, std::string doing, std::string detail = {}) {
  return {path, std::move(doing), {errno, boost::system::system_category()}, std::move(detail)};
}

FileError refused(const fs::path& folder, std::string why) {
  return {folder, "use", make_error_code(boost::system::errc::file_exists), std::move(why)};
}

// 0001.ply, or what was left of it when the power went: .0001.ply.part
bool is_scan_name(std::string name, std::string_view ending) {
  if (name.starts_with('.') && name.ends_with(".part")) name = name.substr(1, name.size() - 6);
  if (!name.ends_with(ending) || name.size() < ending.size() + 4) return false;
  return std::all_of(name.begin(), name.end() - static_cast<std::ptrdiff_t>(ending.size()),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

std::vector<fs::path> scans_in(const fs::path& folder, std::string_view ending) {
  std::vector<fs::path> scans;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder / "scans", none))
    if (is_scan_name(entry.path().filename().string(), ending)) scans.push_back(entry.path());
  std::ranges::sort(scans);
  return scans;
}

// What the end of a run leaves, in the order to remove it.
std::vector<fs::path> ends_in(const fs::path& folder) {
  std::vector<fs::path> products;
  for (const std::string_view name : kProducts) {
    products.push_back(folder / name);
    products.push_back(part_name(folder / name));
  }
  return products;
}

// Everything an earlier run of ours left in the folder, in the order to remove it: the journal
// before what it vouches for, and its log before the journal, so that what is left of it is true.
std::vector<fs::path> products_in(const fs::path& folder) {
  std::vector<fs::path> products = ends_in(folder);
  const fs::path journal = folder / RunStore::kJournalName;
  for (const char* ending : {"-wal", "-journal", ""})
    products.emplace_back(journal.string() + ending);
  for (const std::string_view ending : {".beams", ".ply"})
    for (fs::path& scan : scans_in(folder, ending)) products.push_back(std::move(scan));
  return products;
}

FileResult<bool> remove_all(const std::vector<fs::path>& files) {
  bool any = false;
  for (const fs::path& file : files) {
    if (file_calls().unlink(file.c_str()) == 0)
      any = true;
    else if (errno != ENOENT)
      return failed(file, "remove");
  }
  return any;
}

// Empty when a run may be written into the folder, else why not.
std::string objection(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return error ? error.message() : "";
  if (!fs::is_directory(folder, error)) return "it is a file; name a folder";
  const bool ours = fs::exists(folder / kDecisions, error);
  const bool empty = fs::is_empty(folder, error);
  if (error) return error.message();
  if (ours || empty) return "";
  return "it is not empty and holds no earlier run; name another folder, or empty it";
}

}  // namespace

FileResult<RunStore> RunStore::open(const fs::path& folder) {
  if (std::string why = objection(folder); !why.empty()) return refused(folder, std::move(why));
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return FileError{folder, "make", error};
  RunStore store;
  store.folder_ = folder;
  const fs::path decisions = folder / kDecisions;
  const bool earlier = fs::exists(decisions, error);
  // By its decisions a folder is one of ours, also if this is cut right here: before anything else.
  if (const auto locked = store.lock(); !locked) return locked.error();
  fs::create_directories(folder / "scans", error);
  if (error) return FileError{folder / "scans", "make", error};
  const auto removed = remove_all(products_in(folder));
  if (!removed) return removed.error();
  if (file_calls().ftruncate(store.decisions_fd_, 0) != 0) return failed(decisions, "empty");
  store.replaced_ = earlier || *removed;
  return store;
}

FileResult<RunStore> RunStore::go_on(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / kJournalName, error)) return refused(folder, "no run is in it");
  RunStore store;
  store.folder_ = folder;
  if (const auto locked = store.lock(); !locked) return locked.error();
  if (const auto removed = remove_all(ends_in(folder)); !removed) return removed.error();
  if (const auto cut = store.cut_decisions(); !cut) return cut.error();
  return store;
}

FileResult<void> RunStore::lock() {
  const fs::path decisions = folder_ / kDecisions;
  decisions_fd_ =
      file_calls().open(decisions.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (decisions_fd_ < 0) return failed(decisions, "write");
  if (::flock(decisions_fd_, LOCK_EX | LOCK_NB) != 0)
    return refused(folder_, "another process is writing a run into it; name another folder");
  return {};
}

// After a cut the last line may be a part of one.
FileResult<void> RunStore::cut_decisions() {
  const auto text = read_file(folder_ / kDecisions);
  if (!text) return text.error();
  const std::size_t whole = text->rfind('\n') + 1;  // 0 where there is none.
  decided_bytes_ = static_cast<std::int64_t>(whole);
  if (whole == text->size()) return {};
  if (file_calls().ftruncate(decisions_fd_, static_cast<std::int64_t>(whole)) != 0)
    return failed(folder_ / kDecisions, "shorten");
  return {};
}

RunStore::RunStore(RunStore&& other) noexcept
    : folder_(std::move(other.folder_)),
      decisions_fd_(std::exchange(other.decisions_fd_, -1)),
      undecided_(std::move(other.undecided_)),
      decided_bytes_(other.decided_bytes_),
      torn_(other.torn_),
      replaced_(other.replaced_) {}

RunStore& RunStore::operator=(RunStore&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(decisions_fd_, other.decisions_fd_);
  std::swap(undecided_, other.undecided_);
  std::swap(decided_bytes_, other.decided_bytes_);
  std::swap(torn_, other.torn_);
  std::swap(replaced_, other.replaced_);
  return *this;
}

RunStore::~RunStore() {
  if (decisions_fd_ >= 0) ::close(decisions_fd_);
}

fs::path RunStore::scan_path(int number) const {
  return folder_ / "scans" / fmt::format("{:04}.ply", number);
}

fs::path RunStore::beams_path(int number) const {
  return folder_ / "scans" / fmt::format("{:04}.beams", number);
}

FileResult<void> RunStore::decide(const boost::json::object& decision) {
  const std::string line = json_line(decision) + "\n";
  if (undecided_.size() + line.size() <= kUndecidedMax) undecided_ += line;
  return write_decisions();
}

FileResult<void> RunStore::write_decisions() {
  if (undecided_.empty()) return {};
  if (torn_ && file_calls().ftruncate(decisions_fd_, decided_bytes_) != 0)
    return failed(folder_ / kDecisions, "shorten");
  torn_ = !write_fully(decisions_fd_, undecided_);
  if (torn_) return failed(folder_ / kDecisions, "write");
  decided_bytes_ += static_cast<std::int64_t>(undecided_.size());
  undecided_.clear();
  return {};
}

FileResult<std::uint64_t> RunStore::save_beams(int number, const hal::ScanCloud& scan) {
  return write_beams(beams_path(number), scan);
}

FileResult<hal::ScanCloud> RunStore::beams(int number, std::uint64_t checksum) const {
  return read_beams(beams_path(number), checksum);
}

FileResult<void> RunStore::save_scan(const std::vector<Eigen::Vector3f>& W_points_m,
                                     const Eigen::Isometry3d& T_W_S, const ScanInfo& info) {
  return write_scan_ply(scan_path(info.number), W_points_m, T_W_S, info);
}

FileResult<void> RunStore::save_cloud(const CloudMerger& cloud) {
  return cloud.write(folder_ / "cloud.ply");
}

FileResult<OctomapWritten> RunStore::save_map(
    const planning::VoxelGrid& grid,
    const std::function<planning::VoxelState(planning::Voxel)>& state_at) {
  return write_octomap(folder_ / "map.ot", grid, state_at);
}

FileResult<void> RunStore::save_summary(const boost::json::object& summary) {
  return write_file(folder_ / "summary.json", {json_pretty(summary)});
}

FileResult<void> RunStore::save_report(std::string_view html) {
  return write_file(report_path(), {html});
}

FileResult<void> RunStore::finish() {
  if (file_calls().fsync(decisions_fd_) != 0) return failed(folder_ / kDecisions, "write");
  return {};
}

// One that stays does no harm.
void RunStore::remove_beams() {
  (void)remove_all(scans_in(folder_, ".beams"));
}

FileResult<void> RunStore::has_room(std::uint64_t bytes) const {
  const std::int64_t free = file_calls().bytes_free(folder_.c_str());
  if (free < 0 || static_cast<std::uint64_t>(free) >= bytes) return {};
  return FileError{
      folder_, "write another scan into", make_error_code(boost::system::errc::no_space_on_device),
      fmt::format("the disk is almost full: {} MB are free and {} MB are needed; make room",
                  free / 1'000'000, bytes / 1'000'000)};
}

}  // namespace mission
