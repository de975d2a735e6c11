#include "mission/scan_spool.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <limits>

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

bool same_bits(const hal::ScanCloud& a, const hal::ScanCloud& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  return a.stamp == b.stamp && a.pattern.columns == b.pattern.columns &&
         a.pattern.rows == b.pattern.rows &&
         a.pattern.azimuth_step_rad == b.pattern.azimuth_step_rad &&
         a.pattern.elevation_first_rad == b.pattern.elevation_first_rad &&
         same(a.ranges_m, b.ranges_m) && same(a.beams, b.beams);
}

TEST(ScanSpool, GivesBackWhatWasPutInBitForBitAndInAnyOrder) {
  const test::TempFolder folder;
  ScanSpool spool = ScanSpool::open(folder.path()).value();
  const std::vector<hal::ScanCloud> scans{scan_of(30, 20, true), scan_of(5, 3, false),
                                          scan_of(12, 40, true)};
  for (const hal::ScanCloud& scan : scans) ASSERT_TRUE(spool.put(scan));
  ASSERT_EQ(spool.size(), 3U);
  for (const std::size_t i : {2U, 0U, 1U})
    EXPECT_TRUE(same_bits(spool.get(i).value(), scans[i])) << i;
}

TEST(ScanSpool, LeavesNothingBehindInItsFolder) {
  const test::TempFolder folder;
  ScanSpool spool = ScanSpool::open(folder.path()).value();
  ASSERT_TRUE(spool.put(scan_of(30, 20, true)));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(ScanSpool, SaysWhichFolderItCannotUse) {
  const auto spool = ScanSpool::open("/no/such/folder");
  ASSERT_FALSE(spool);
  EXPECT_THAT(spool.error().text(), testing::HasSubstr("/no/such/folder"));
}

// A disk without room, as far as a process can be shown one.
TEST(ScanSpool, AScanThatDoesNotFitLeavesTheOthersAsTheyAre) {
  const test::TempFolder folder;
  ScanSpool spool = ScanSpool::open(folder.path()).value();
  const hal::ScanCloud small = scan_of(10, 10, true);
  ASSERT_TRUE(spool.put(small));
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{64 * 1024, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &tight);
  const auto full = spool.put(scan_of(100, 100, true));
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().doing, "write");
  ASSERT_EQ(spool.size(), 1U);
  ASSERT_TRUE(spool.put(scan_of(20, 5, false)));
  EXPECT_TRUE(same_bits(spool.get(0).value(), small));
  EXPECT_TRUE(same_bits(spool.get(1).value(), scan_of(20, 5, false)));
}

}  // namespace
}  // namespace mission
