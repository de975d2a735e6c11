#include "mission/beams_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <type_traits>

#include "mission/checksum.hpp"

namespace mission {
namespace {

constexpr std::array<char, 8> kMagic{'V', 'T', 'B', 'E', 'A', 'M', 'S', '1'};

// As it stands in the file.
struct Header {
  std::array<char, 8> magic = kMagic;
  std::int64_t stamp_ns{};
  double azimuth_first_rad{}, azimuth_step_rad{}, elevation_first_rad{}, elevation_step_rad{};
  std::uint32_t columns{}, rows{};
  std::uint64_t ranges{}, beams{};
  std::uint64_t checksum{};  // Of the rest with this 0.

  std::uint64_t bytes() const { return ranges * sizeof(float) + beams * sizeof(hal::Beam); }
};
static_assert(sizeof(Header) == 80 && sizeof(hal::Beam) == 24);

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string_view bytes_of(const Header& header) {
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

Header header_of(const hal::ScanCloud& scan) {
  const hal::ScanPattern& pattern = scan.pattern;
  return {.stamp_ns = scan.stamp.time_since_epoch().count(),
          .azimuth_first_rad = pattern.azimuth_first_rad,
          .azimuth_step_rad = pattern.azimuth_step_rad,
          .elevation_first_rad = pattern.elevation_first_rad,
          .elevation_step_rad = pattern.elevation_step_rad,
          .columns = pattern.columns,
          .rows = pattern.rows,
          .ranges = scan.ranges_m.size(),
          .beams = scan.beams.size()};
}

FileError damaged(const std::filesystem::path& path, std::string what) {
  return {path, "use", make_error_code(boost::system::errc::bad_message), std::move(what)};
}

FileError unreadable_beams(const std::filesystem::path& path) {
  return {path, "read", {errno, boost::system::system_category()}};
}

// The file, open, behind its header.
class BeamsFile {
 public:
  explicit BeamsFile(const std::filesystem::path& path)
      : path_(path), fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  BeamsFile(const BeamsFile&) = delete;
  BeamsFile& operator=(const BeamsFile&) = delete;
  ~BeamsFile() {
    if (fd_ >= 0) ::close(fd_);
  }

  FileResult<Header> header(std::uint64_t checksum) {
    struct stat status {};
    if (fd_ < 0 || ::fstat(fd_, &status) != 0) return unreadable_beams(path_);
    Header header;
    if (const auto got = read(&header, sizeof header); !got) return got.error();
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (header.magic != kMagic || header.ranges > size || header.beams > size ||
        size != sizeof header + header.bytes())
      return damaged(path_, "it is no scan, or a part of one is missing");
    if (std::exchange(header.checksum, 0) != checksum)
      return damaged(path_, "its checksum is not the one that the journal has");
    return header;
  }

  FileResult<void> read(void* bytes, std::size_t count) {
    char* to = static_cast<char*>(bytes);
    while (count > 0) {
      const ssize_t got = ::read(fd_, to, count);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return unreadable_beams(path_);
      if (got == 0) return damaged(path_, "a part of it is missing");
      to += got, count -= static_cast<std::size_t>(got);
    }
    return {};
  }

 private:
  const std::filesystem::path& path_;
  int fd_;
};

constexpr std::size_t kPiece = std::size_t{1} << 20;

FileResult<void> compared(const std::filesystem::path& path, const Checksum& found,
                          std::uint64_t checksum) {
  if (found.value() != checksum) return damaged(path, "it is damaged: its checksum does not hold");
  return {};
}

}  // namespace

FileResult<std::uint64_t> write_beams(const std::filesystem::path& path,
                                      const hal::ScanCloud& scan) {
  Header header = header_of(scan);
  Checksum checksum;
  checksum.add(bytes_of(header));
  checksum.add(bytes_of(scan.ranges_m));
  checksum.add(bytes_of(scan.beams));
  header.checksum = checksum.value();
  const auto written =
      write_file(path, {bytes_of(header), bytes_of(scan.ranges_m), bytes_of(scan.beams)});
  if (!written) return written.error();
  return checksum.value();
}

FileResult<hal::ScanCloud> read_beams(const std::filesystem::path& path, std::uint64_t checksum) {
  BeamsFile file(path);
  const auto header = file.header(checksum);
  if (!header) return header.error();
  hal::ScanCloud scan{
      hal::Time(hal::Duration(header->stamp_ns)),
      {header->azimuth_first_rad, header->azimuth_step_rad, header->elevation_first_rad,
       header->elevation_step_rad, header->columns, header->rows},
      std::vector<float>(header->ranges),
      std::vector<hal::Beam>(header->beams)};
  if (const auto got = file.read(scan.ranges_m.data(), header->ranges * sizeof(float)); !got)
    return got.error();
  if (const auto got = file.read(scan.beams.data(), header->beams * sizeof(hal::Beam)); !got)
    return got.error();
  Checksum found;
  found.add(bytes_of(*header));
  found.add(bytes_of(scan.ranges_m));
  found.add(bytes_of(scan.beams));
  if (const auto same = compared(path, found, checksum); !same) return same.error();
  return scan;
}

FileResult<void> verify_beams(const std::filesystem::path& path, std::uint64_t checksum) {
  BeamsFile file(path);
  const auto header = file.header(checksum);
  if (!header) return header.error();
  Checksum found;
  found.add(bytes_of(*header));
  std::string piece;
  for (std::uint64_t left : {header->ranges * sizeof(float), header->beams * sizeof(hal::Beam)})
    while (left > 0) {
      piece.resize(std::min<std::uint64_t>(left, kPiece));
      if (const auto got = file.read(piece.data(), piece.size()); !got) return got.error();
      found.add(piece);
      left -= piece.size();
    }
  return compared(path, found, checksum);
}

}  // namespace mission
