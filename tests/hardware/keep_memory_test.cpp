// Memory that is given back is not faulted in again.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <vector>

#include "mission/main_realtime.hpp"

namespace {

constexpr std::size_t kBytes = std::size_t{80} << 20;  // Of a scan.

// Pages that became memory while a scan came and went.
long pages_of_a_scan() {
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  const std::vector<char> scan(kBytes, 1);
  getrusage(RUSAGE_SELF, &after);
  return after.ru_minflt - before.ru_minflt;
}

TEST(KeepMemory, TakesAScansPagesOnce) {
  mission::keep_memory();
  (void)pages_of_a_scan();
  EXPECT_LT(pages_of_a_scan(), 100);
  EXPECT_LT(pages_of_a_scan(), 100);
}

}  // namespace
