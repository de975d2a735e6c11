#include "mission/store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <utility>

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
bool is_scan_name(std::string name) {
  if (name.starts_with('.') && name.ends_with(".part")) name = name.substr(1, name.size() - 6);
  if (!name.ends_with(".ply") || name.size() < 8) return false;
  return std::all_of(name.begin(), name.end() - 4,
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Everything an earlier run of ours left in the folder, in the order to remove it.
std::vector<fs::path> products_in(const fs::path& folder) {
  std::vector<fs::path> products;
  for (const std::string_view name : kProducts) {
    products.push_back(folder / name);
    products.push_back(part_name(folder / name));
  }
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder / "scans", none)) {
    if (is_scan_name(entry.path().filename().string())) products.push_back(entry.path());
  }
  return products;
}

FileResult<bool> remove_products(const fs::path& folder) {
  bool any = false;
  for (const fs::path& product : products_in(folder)) {
    std::error_code error;
    any = fs::remove(product, error) || any;
    if (error) return FileError{product, "remove", error};
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
  fs::create_directories(folder / "scans", error);
  if (error) return FileError{folder / "scans", "make", error};
  RunStore store;
  store.folder_ = folder;
  const fs::path decisions = folder / kDecisions;
  const bool earlier = fs::exists(decisions, error);
  store.decisions_fd_ = ::open(decisions.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (store.decisions_fd_ < 0) return failed(decisions, "write");
  if (::flock(store.decisions_fd_, LOCK_EX | LOCK_NB) != 0) {
    return refused(folder, "another process is writing a run into it; name another folder");
  }
  const auto removed = remove_products(folder);
  if (!removed) return removed.error();
  if (::ftruncate(store.decisions_fd_, 0) != 0) return failed(decisions, "empty");
  store.replaced_ = earlier || *removed;
  return store;
}

RunStore::RunStore(RunStore&& other) noexcept
    : folder_(std::move(other.folder_)),
      decisions_fd_(std::exchange(other.decisions_fd_, -1)),
      replaced_(other.replaced_) {}

RunStore& RunStore::operator=(RunStore&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(decisions_fd_, other.decisions_fd_);
  std::swap(replaced_, other.replaced_);
  return *this;
}

RunStore::~RunStore() {
  if (decisions_fd_ >= 0) ::close(decisions_fd_);
}

fs::path RunStore::scan_path(int number) const {
  return folder_ / "scans" / fmt::format("{:04}.ply", number);
}

FileResult<void> RunStore::decide(const boost::json::object& decision) {
  const std::string line = json_line(decision) + "\n";
  std::string_view left = line;
  while (!left.empty()) {
    const ssize_t wrote = ::write(decisions_fd_, left.data(), left.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return failed(folder_ / kDecisions, "write");
    left.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return {};
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
  if (::fsync(decisions_fd_) != 0) return failed(folder_ / kDecisions, "write");
  return {};
}

}  // namespace mission
