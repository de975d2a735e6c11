// Scans as they were measured, out of memory: a map can be filled anew from other poses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "hal/values.hpp"
#include "mission/files.hpp"

namespace mission {

// A file without a name, gone when the process ends however it ends. About 28 bytes a beam; what
// comes back is what was put in, bit for bit. Not for two threads at once.
class ScanSpool {
 public:
  // In this folder, which must be there.
  static FileResult<ScanSpool> open(const std::filesystem::path& folder);

  ScanSpool(ScanSpool&& other) noexcept;
  ScanSpool& operator=(ScanSpool&& other) noexcept;
  ~ScanSpool();

  // Behind those before it. A scan that does not fit on the disk leaves the others as they are.
  FileResult<void> put(const hal::ScanCloud& scan);
  // index < size(), in the order of put().
  FileResult<hal::ScanCloud> get(std::size_t index) const;
  std::size_t size() const { return places_.size(); }

 private:
  struct Place {
    std::int64_t offset{};
    hal::Time stamp{};
    hal::ScanPattern pattern;
    std::size_t ranges{}, beams{};
  };
  ScanSpool() = default;

  std::filesystem::path folder_;
  int fd_ = -1;
  std::int64_t end_{};
  std::vector<Place> places_;
};

}  // namespace mission
