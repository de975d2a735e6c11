#include "tests/dst/rig/wall_clock.hpp"

#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

namespace {

thread_local std::int64_t ahead_s = 0;

using ClockGettime = int (*)(clockid_t, timespec*);

ClockGettime real_clock_gettime() {
  static const auto real = reinterpret_cast<ClockGettime>(::dlsym(RTLD_NEXT, "clock_gettime"));
  return real;
}

bool is_of_wall(clockid_t clock) {
  return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE || clock == CLOCK_TAI;
}

}  // namespace

// In place of the C library's, for the whole program: std::chrono and SQLite come by here.
extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const int done = real_clock_gettime()(clock, now);
  if (done == 0 && is_of_wall(clock)) now->tv_sec += ahead_s;
  return done;
}

extern "C" int gettimeofday(timeval* now, void*) noexcept {
  timespec precise{};
  const int done = clock_gettime(CLOCK_REALTIME, &precise);
  *now = {precise.tv_sec, precise.tv_nsec / 1000};
  return done;
}

extern "C" time_t time(time_t* now) noexcept {
  timespec precise{};
  clock_gettime(CLOCK_REALTIME, &precise);
  if (now != nullptr) *now = precise.tv_sec;
  return precise.tv_sec;
}

namespace dst {

WallClock::WallClock() {
  ahead_s = 0;
}

WallClock::~WallClock() {
  ahead_s = 0;
}

void WallClock::jump(std::chrono::seconds by) {
  ahead_s += by.count();
}

}  // namespace dst
