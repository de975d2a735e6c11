#include "mission/beams_file.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>

#include "hal/pan_fan.hpp"
#include "tests/support/temp_folder.hpp"

namespace mission {
namespace {

hal::ScanCloud scan_of(std::uint32_t columns, std::uint32_t rows, bool with_beams) {
  hal::ScanCloud scan;
  scan.stamp = hal::Time(std::chrono::seconds(columns));
  scan.pattern = {0.1, 0.2, 0.3, 0.4, columns, rows};
  for (std::size_t i = 0; i < scan.pattern.beams(); ++i) {
    scan.ranges_m.push_back(i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                       : 0.1F * static_cast<float>(i));
    if (with_beams) scan.beams.push_back({{1, 2, static_cast<float>(i)}, {0, 0.6F, 0.8F}});
  }
  return scan;
}

hal::ScanCloud fan_scan_of(std::uint32_t columns, std::uint32_t rows) {
  hal::ScanCloud scan = scan_of(columns, rows, false);
  hal::PanFan& fan = scan.fan.emplace();
  fan.P_origin_m << 0.1, -0.02, 0.3;
  fan.pan_per_row_rad = 1e-5;
  for (std::uint32_t row = 0; row < rows; ++row)
    fan.P_directions.emplace_back(std::cos(0.01 * row), 0, std::sin(0.01 * row));
  for (std::uint32_t column = 0; column < columns; ++column)
    fan.pan_rad.push_back(-3 + 0.02 * column);
  scan.beams = hal::beams_of(fan);
  return scan;
}

bool same_fan(const std::optional<hal::PanFan>& a, const std::optional<hal::PanFan>& b) {
  if (!a || !b) return !a && !b;
  return a->P_origin_m == b->P_origin_m && a->P_directions == b->P_directions &&
         a->pan_per_row_rad == b->pan_per_row_rad && a->pan_rad == b->pan_rad;
}

bool same_bits(const hal::ScanCloud& a, const hal::ScanCloud& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  return a.stamp == b.stamp && a.pattern.columns == b.pattern.columns &&
         a.pattern.rows == b.pattern.rows &&
         a.pattern.azimuth_step_rad == b.pattern.azimuth_step_rad &&
         a.pattern.elevation_first_rad == b.pattern.elevation_first_rad &&
         same(a.ranges_m, b.ranges_m) && same(a.beams, b.beams) && same_fan(a.fan, b.fan);
}

// Not flushed: there are many.
void put(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(BeamsFile, GivesBackWhatWasMeasuredBitForBit) {
  const test::TempFolder folder;
  for (const hal::ScanCloud& scan :
       {scan_of(30, 20, true), scan_of(5, 3, false), scan_of(200, 300, true)}) {
    const auto path = folder.path() / "0001.beams";
    const std::uint64_t checksum = write_beams(path, scan).value();
    EXPECT_TRUE(same_bits(read_beams(path, checksum).value(), scan));
    EXPECT_TRUE(verify_beams(path, checksum));
    EXPECT_EQ(std::filesystem::file_size(path),
              80 + 4 * scan.ranges_m.size() + 24 * scan.beams.size());
  }
}

TEST(BeamsFile, KeepsAFanInsteadOfItsBeams) {
  const test::TempFolder folder;
  const auto path = folder.path() / "0001.beams";
  const hal::ScanCloud scan = fan_scan_of(200, 300);
  const std::uint64_t checksum = write_beams(path, scan).value();
  EXPECT_TRUE(same_bits(read_beams(path, checksum).value(), scan));
  EXPECT_TRUE(verify_beams(path, checksum));
  EXPECT_EQ(std::filesystem::file_size(path), 80 + 4 * 200 * 300 + 8 * (4 + 3 * 300 + 200));
}

TEST(BeamsFile, TellsAnotherScanFromTheOneAskedFor) {
  const test::TempFolder folder;
  const auto path = folder.path() / "0001.beams";
  const std::uint64_t one = write_beams(path, scan_of(30, 20, true)).value();
  const std::uint64_t other = write_beams(path, scan_of(20, 30, true)).value();
  EXPECT_NE(one, other);
  EXPECT_FALSE(read_beams(path, one));
  EXPECT_FALSE(verify_beams(path, one));
}

// Every byte of a small one turned, and every shorter one.
void find_any_damage(const hal::ScanCloud& scan) {
  const test::TempFolder folder;
  const auto path = folder.path() / "0001.beams";
  const std::uint64_t checksum = write_beams(path, scan).value();
  const std::string whole = read_file(path).value();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x10);
    put(path, bytes);
    EXPECT_FALSE(verify_beams(path, checksum)) << i;
    const auto read = read_beams(path, checksum);
    ASSERT_FALSE(read) << i;
    EXPECT_EQ(read.error().code, boost::system::errc::bad_message);
    put(path, whole.substr(0, i));
    EXPECT_FALSE(verify_beams(path, checksum)) << i;
    EXPECT_FALSE(read_beams(path, checksum)) << i;
  }
}

TEST(BeamsFile, FindsAnyByteThatIsNotWhatItWas) {
  find_any_damage(scan_of(3, 2, true));
  find_any_damage(fan_scan_of(3, 2));
}

TEST(BeamsFile, FindsAPageThatTheDiskLost) {
  const test::TempFolder folder;
  const auto path = folder.path() / "0001.beams";
  const std::uint64_t checksum = write_beams(path, scan_of(500, 400, true)).value();
  const std::string whole = read_file(path).value();
  for (std::size_t at = 0; at + 4096 <= whole.size(); at += 512 * 101) {
    std::string bytes = whole;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), 512, '\0');
    put(path, bytes);
    EXPECT_FALSE(verify_beams(path, checksum)) << at;
  }
}

TEST(BeamsFile, NamesAFileThatIsNotThere) {
  const auto read = read_beams("/no/such/0001.beams", 1);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().text(), testing::HasSubstr("/no/such/0001.beams"));
}

TEST(BeamsFile, LeavesTheOldOneWhereTheNewDoesNotFit) {
  const test::TempFolder folder;
  const auto path = folder.path() / "0001.beams";
  const std::uint64_t checksum = write_beams(path, scan_of(10, 10, true)).value();
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{64 * 1024, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &tight);
  const auto full = write_beams(path, scan_of(100, 100, true));
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().doing, "write");
  EXPECT_TRUE(same_bits(read_beams(path, checksum).value(), scan_of(10, 10, true)));
}

}  // namespace
}  // namespace mission
