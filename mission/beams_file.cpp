#include "mission/beams_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <type_traits>

#include "hal/pan_fan.hpp"
#include "mission/checksum.hpp"

namespace mission {
namespace {

// With its beams one by one, and with the fan that tells them: a seventh of the bytes.
constexpr std::array<char, 8> kBeams{'V', 'T', 'B', 'E', 'A', 'M', 'S', '1'};
constexpr std::array<char, 8> kFan{'V', 'T', 'B', 'E', 'A', 'M', 'S', '2'};

// As it stands in the file. Ranges follow, and then beams, or the fan's numbers (FanNumbers).
struct Header {
  std::array<char, 8> magic = kBeams;
  std::int64_t stamp_ns{};
  double azimuth_first_rad{}, azimuth_step_rad{}, elevation_first_rad{}, elevation_step_rad{};
  std::uint32_t columns{}, rows{};
  std::uint64_t ranges{}, beams{};  // Beams, or numbers.
  std::uint64_t checksum{};         // Of the rest with this 0.

  bool has_fan() const { return magic == kFan; }
  std::uint64_t bytes_of_ranges() const { return ranges * sizeof(float); }
  std::uint64_t bytes_of_beams() const {
    return beams * (has_fan() ? sizeof(double) : sizeof(hal::Beam));
  }
};
static_assert(sizeof(Header) == 80 && sizeof(hal::Beam) == 24);

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// Origin, turn per row, a direction of each row, the pan angle of each column.
std::vector<double> numbers_of(const hal::PanFan& fan) {
  std::vector<double> numbers{fan.P_origin_m.x(), fan.P_origin_m.y(), fan.P_origin_m.z(),
                              fan.pan_per_row_rad};
  for (const Eigen::Vector3d& direction : fan.P_directions)
    numbers.insert(numbers.end(), direction.begin(), direction.end());
  numbers.insert(numbers.end(), fan.pan_rad.begin(), fan.pan_rad.end());
  return numbers;
}

constexpr std::size_t kFanNumbers = 4;  // Before the directions.

std::size_t numbers_of(const hal::ScanPattern& pattern) {
  return kFanNumbers + std::size_t{3} * pattern.rows + pattern.columns;
}

hal::PanFan fan_of(const std::vector<double>& numbers, std::uint32_t rows) {
  hal::PanFan fan{{numbers[0], numbers[1], numbers[2]}, {}, numbers[3], {}};
  auto next = numbers.begin() + kFanNumbers;
  for (std::uint32_t row = 0; row < rows; ++row, next += 3)
    fan.P_directions.emplace_back(next[0], next[1], next[2]);
  fan.pan_rad.assign(next, numbers.end());
  return fan;
}

std::string_view bytes_of(const Header& header) {
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

Header header_of(const hal::ScanCloud& scan) {
  const hal::ScanPattern& pattern = scan.pattern;
  return {.magic = scan.fan ? kFan : kBeams,
          .stamp_ns = scan.stamp.time_since_epoch().count(),
          .azimuth_first_rad = pattern.azimuth_first_rad,
          .azimuth_step_rad = pattern.azimuth_step_rad,
          .elevation_first_rad = pattern.elevation_first_rad,
          .elevation_step_rad = pattern.elevation_step_rad,
          .columns = pattern.columns,
          .rows = pattern.rows,
          .ranges = scan.ranges_m.size(),
          .beams = scan.fan ? numbers_of(pattern) : scan.beams.size()};
}

hal::ScanPattern pattern_of(const Header& header) {
  return {header.azimuth_first_rad,  header.azimuth_step_rad, header.elevation_first_rad,
          header.elevation_step_rad, header.columns,          header.rows};
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
    if ((header.magic != kBeams && header.magic != kFan) || header.ranges > size ||
        header.beams > size ||
        size != sizeof header + header.bytes_of_ranges() + header.bytes_of_beams() ||
        (header.has_fan() && header.beams != numbers_of(pattern_of(header))))
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
  const std::vector<double> numbers = scan.fan ? numbers_of(*scan.fan) : std::vector<double>();
  const std::string_view ranges = bytes_of(scan.ranges_m),
                         beams = scan.fan ? bytes_of(numbers) : bytes_of(scan.beams);
  Checksum checksum;
  checksum.add(bytes_of(header));
  checksum.add(ranges);
  checksum.add(beams);
  header.checksum = checksum.value();
  const auto written = write_file(path, {bytes_of(header), ranges, beams});
  if (!written) return written.error();
  return checksum.value();
}

FileResult<hal::ScanCloud> read_beams(const std::filesystem::path& path, std::uint64_t checksum) {
  BeamsFile file(path);
  const auto header = file.header(checksum);
  if (!header) return header.error();
  hal::ScanCloud scan{hal::Time(hal::Duration(header->stamp_ns)), pattern_of(*header),
                      std::vector<float>(header->ranges)};
  std::vector<double> numbers(header->has_fan() ? header->beams : 0);
  scan.beams.resize(header->has_fan() ? 0 : header->beams);
  const auto read_all = [&](auto& values) {
    return file.read(values.data(), values.size() * sizeof values[0]);
  };
  if (const auto got = read_all(scan.ranges_m); !got) return got.error();
  if (const auto got = header->has_fan() ? read_all(numbers) : read_all(scan.beams); !got)
    return got.error();
  Checksum found;
  found.add(bytes_of(*header));
  found.add(bytes_of(scan.ranges_m));
  found.add(header->has_fan() ? bytes_of(numbers) : bytes_of(scan.beams));
  if (const auto same = compared(path, found, checksum); !same) return same.error();
  if (header->has_fan()) {
    scan.fan = fan_of(numbers, header->rows);
    scan.beams = hal::beams_of(*scan.fan);
  }
  return scan;
}

FileResult<void> verify_beams(const std::filesystem::path& path, std::uint64_t checksum) {
  BeamsFile file(path);
  const auto header = file.header(checksum);
  if (!header) return header.error();
  Checksum found;
  found.add(bytes_of(*header));
  std::string piece;
  for (std::uint64_t left : {header->bytes_of_ranges(), header->bytes_of_beams()})
    while (left > 0) {
      piece.resize(std::min<std::uint64_t>(left, kPiece));
      if (const auto got = file.read(piece.data(), piece.size()); !got) return got.error();
      found.add(piece);
      left -= piece.size();
    }
  return compared(path, found, checksum);
}

}  // namespace mission
