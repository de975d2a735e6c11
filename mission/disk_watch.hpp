// A disk that does not take what a survey has to keep: whether it does now, for how long it has
// not, and what the robot does about it. Pure: times are handed in.
#pragma once

#include <optional>
#include <string>

#include "hal/values.hpp"
#include "mission/faults.hpp"
#include "mission/files.hpp"

namespace mission {

class DiskWatch {
 public:
  // Then nobody waits any more. Shorter than what a drive that is held waits: the disk's reason is
  // the one to be told.
  static constexpr hal::Duration kPatience = std::chrono::minutes(5);

  // Each has trouble of its own: scans and decisions, and the journal.
  enum class Part { files, journal };
  // What the robot does. Ends: where it stands.
  enum class Answer { goes_on, stands, ends, goes_home };

  explicit DiskWatch(hal::Duration patience = kPatience, bool then_home = false)
      : patience_(patience), then_home_(then_home) {}

  // Both return whether that changes anything: it was well, or it is again.
  bool failed(Part part, const FileError& why, hal::Time now);
  bool works(Part part);
  // Has the answer goes_home taken: it stays, whatever becomes of the disk.
  void go_home() { goes_home_ = true; }

  bool well() const { return !files_ && !journal_; }
  // disk_full, disk_failed, or disk_read_only. Nothing: well. Does not allocate.
  std::optional<FaultCode> fault() const;
  std::string text() const;  // "F700-disk-full: cannot write ...", or "" when it is well.
  std::string why() const;   // "cannot write ...", or "".
  bool given_up(hal::Time now) const { return !well() && now - since_ > patience_; }
  Answer answer(hal::Time now) const;
  bool goes_home() const { return goes_home_; }
  hal::Duration patience() const { return patience_; }
  hal::Duration lasted(hal::Time now) const { return now - since_; }  // The latest trouble.

 private:
  std::optional<FileError>& of(Part part) { return part == Part::files ? files_ : journal_; }

  hal::Duration patience_;
  bool then_home_, goes_home_ = false;
  std::optional<FileError> files_, journal_;
  hal::Time since_{};
};

}  // namespace mission
