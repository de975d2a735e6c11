#include "mission/scan_spool.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

namespace mission {
namespace {

FileError failed(const std::filesystem::path& folder, std::string doing, int code) {
  return {folder / "(measured scans)", std::move(doing), {code, boost::system::system_category()}};
}

// 0, or the error's number.
int write_all(int fd, const void* bytes, std::size_t count, std::int64_t at) {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t wrote = ::pwrite(fd, from, count, at);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return wrote < 0 ? errno : ENOSPC;
    from += wrote, at += wrote, count -= static_cast<std::size_t>(wrote);
  }
  return 0;
}

int read_all(int fd, void* bytes, std::size_t count, std::int64_t at) {
  char* to = static_cast<char*>(bytes);
  while (count > 0) {
    const ssize_t got = ::pread(fd, to, count, at);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got < 0 ? errno : EIO;
    to += got, at += got, count -= static_cast<std::size_t>(got);
  }
  return 0;
}

}  // namespace

FileResult<ScanSpool> ScanSpool::open(const std::filesystem::path& folder) {
  std::string name = (folder / ".measured.XXXXXX").string();
  ScanSpool spool;
  spool.folder_ = folder;
  spool.fd_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (spool.fd_ < 0) return failed(folder, "make", errno);
  ::unlink(name.c_str());
  return spool;
}

ScanSpool::ScanSpool(ScanSpool&& other) noexcept
    : folder_(std::move(other.folder_)),
      fd_(std::exchange(other.fd_, -1)),
      end_(other.end_),
      places_(std::move(other.places_)) {}

ScanSpool& ScanSpool::operator=(ScanSpool&& other) noexcept {
  std::swap(folder_, other.folder_);
  std::swap(fd_, other.fd_);
  std::swap(end_, other.end_);
  std::swap(places_, other.places_);
  return *this;
}

ScanSpool::~ScanSpool() {
  if (fd_ >= 0) ::close(fd_);
}

FileResult<void> ScanSpool::put(const hal::ScanCloud& scan) {
  const Place place{end_, scan.stamp, scan.pattern, scan.ranges_m.size(), scan.beams.size()};
  const std::size_t ranges = place.ranges * sizeof(float);
  const std::size_t beams = place.beams * sizeof(hal::Beam);
  int error = write_all(fd_, scan.ranges_m.data(), ranges, end_);
  if (error == 0)
    error = write_all(fd_, scan.beams.data(), beams, end_ + static_cast<std::int64_t>(ranges));
  if (error != 0) return failed(folder_, "write", error);
  end_ += static_cast<std::int64_t>(ranges + beams);
  places_.push_back(place);
  return {};
}

FileResult<hal::ScanCloud> ScanSpool::get(std::size_t index) const {
  const Place& place = places_.at(index);
  hal::ScanCloud scan{place.stamp, place.pattern, std::vector<float>(place.ranges),
                      std::vector<hal::Beam>(place.beams)};
  const std::size_t ranges = place.ranges * sizeof(float);
  int error = read_all(fd_, scan.ranges_m.data(), ranges, place.offset);
  if (error == 0)
    error = read_all(fd_, scan.beams.data(), place.beams * sizeof(hal::Beam),
                     place.offset + static_cast<std::int64_t>(ranges));
  if (error != 0) return failed(folder_, "read", error);
  return scan;
}

}  // namespace mission
