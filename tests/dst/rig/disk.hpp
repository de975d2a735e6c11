// The disk of one mission, on the seam that all files of the program and of its journal go through:
// it can fail, be slow, and lose what was not flushed when power goes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "hal/clock.hpp"
#include "hal/compute.hpp"
#include "tests/dst/rig/scenario.hpp"
#include "tests/mission/disk_trace.hpp"

namespace dst {

class Disk {
 public:
  // Of this thread, from now on; one at a time. `folder` need not be there yet; what is in it is on
  // the disk already.
  explicit Disk(std::filesystem::path folder);

  void set(DiskFault fault) { fault_ = fault; }
  void mend() { fault_.reset(); }
  // How long flushes have taken since the last call.
  hal::Duration take_waited() { return std::exchange(waited_, {}); }

  // Makes `to` as the disk is when everything until its latest flush of the journal has come to it
  // and nothing else: what the program was told is safe.
  void copy_flushed(const std::filesystem::path& to) const;
  // Makes `to` as the disk is after a power cut now: what was not flushed has come to it or not, in
  // parts.
  void copy_cut(std::uint64_t seed, const std::filesystem::path& to) const;
  // Makes `to` as the program left it.
  void copy(const std::filesystem::path& to) const;

 private:
  int answer(mission_test::DiskOp::Kind kind);
  void note_what_is_there();

  const std::filesystem::path folder_;
  std::optional<DiskFault> fault_;
  hal::Duration waited_{};
  mission_test::DiskTrace trace_;
};

// Work that writes takes as long as the disk does; the event loop goes on meanwhile.
class ComputeOnDisk final : public hal::Compute {
 public:
  // Both must outlive it.
  ComputeOnDisk(Disk& disk, hal::Clock& clock) : disk_(disk), clock_(clock) {}
  hal::Task<void> run(std::function<void()> work) override;

 private:
  Disk& disk_;
  hal::Clock& clock_;
  hal::ComputeHere here_;
};

}  // namespace dst
