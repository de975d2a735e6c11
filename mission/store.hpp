// The folder a run leaves behind.
//
//   scans/0001.ply ...  every scan, with its pose        summary.json  the run in numbers
//   cloud.ply           all scans merged and thinned     report.html   the run for people
//   map.ot              the voxel map, for octovis       decisions.jsonl  one line per decision
//   journal.sqlite      what going on after a cut needs (journal.hpp), with
//   scans/0001.beams    every scan as it was measured; removed when the run is finished
//
// Files are written whole: see write_file. decisions.jsonl grows line by line; a line is handed to
// the operating system before decide() returns (it survives the program, and from finish() on a
// power cut). It holds no wall-clock times: two runs with the same seed write the same bytes.
#pragma once

#include <boost/json/object.hpp>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "mission/files.hpp"
#include "mission/octomap_io.hpp"
#include "mission/ply.hpp"

namespace mission {

class RunStore {
 public:
  // Opens `folder` for one run; makes it, and its parents, when it is not there. Fails, with what
  // to do about it in the error's text, and without having changed anything,
  //   - when it is not empty and no earlier run lies in it (no decisions.jsonl),
  //   - when another process is writing a run into it.
  // An earlier run in it is replaced: its products (the files named above, nothing else) are
  // removed here, the report first, so that the folder never shows a mixture of two runs.
  static FileResult<RunStore> open(const std::filesystem::path& folder);
  // Opens it to go on with the run that is in it: nothing is removed but the products of an earlier
  // end, and a last decision that is not whole. Fails when there is no run in it.
  static FileResult<RunStore> go_on(const std::filesystem::path& folder);

  RunStore(RunStore&& other) noexcept;
  RunStore& operator=(RunStore&& other) noexcept;
  ~RunStore();

  // Whether open() found and removed an earlier run: worth a note to the operator.
  bool replaced() const { return replaced_; }

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path scan_path(int number) const;   // scans/0001.ply
  std::filesystem::path beams_path(int number) const;  // scans/0001.beams
  std::filesystem::path journal_path() const { return folder_ / kJournalName; }
  static constexpr const char* kJournalName = "journal.sqlite";
  std::filesystem::path report_path() const { return folder_ / "report.html"; }

  // Appends one line to decisions.jsonl; keys stay in the order given. A line that the disk does
  // not take is kept, and goes before the next one, or when write_decisions() is called; of more
  // than kUndecidedMax bytes the newest lines are lost.
  FileResult<void> decide(const boost::json::object& decision);
  FileResult<void> write_decisions();
  bool all_decided() const { return undecided_.empty(); }
  static constexpr std::size_t kUndecidedMax = 1 << 20;

  FileResult<void> save_scan(const std::vector<Eigen::Vector3f>& W_points_m,
                             const Eigen::Isometry3d& T_W_S, const ScanInfo& info);
  // Returns what beams() asks for.
  FileResult<std::uint64_t> save_beams(int number, const hal::ScanCloud& scan);
  FileResult<hal::ScanCloud> beams(int number, std::uint64_t checksum) const;
  FileResult<void> save_cloud(const CloudMerger& cloud);
  FileResult<OctomapWritten> save_map(
      const planning::VoxelGrid& grid,
      const std::function<planning::VoxelState(planning::Voxel)>& state_at);
  FileResult<void> save_summary(const boost::json::object& summary);
  FileResult<void> save_report(std::string_view html);

  // Flushes decisions.jsonl to the disk.
  FileResult<void> finish();
  // When nobody will go on with the run any more.
  void remove_beams();

  // Fails with errc::no_space_on_device when fewer bytes are free there.
  FileResult<void> has_room(std::uint64_t bytes) const;

 private:
  RunStore() = default;
  FileResult<void> lock();
  FileResult<void> cut_decisions();

  std::filesystem::path folder_;
  int decisions_fd_ = -1;
  std::string undecided_;           // Lines that are not in the file,
  std::int64_t decided_bytes_ = 0;  // and how long it is without
  bool torn_ = false;               // a part of them that may be in it.
  bool replaced_ = false;
};

}  // namespace mission
