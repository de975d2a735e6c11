// The wall clock as programs on this thread read it: jumps as people and time servers make it jump.
// The clock that counts on is left alone.
#pragma once

#include <chrono>
#include <cstdint>

namespace dst {

class WallClock {
 public:
  // As it is, until the first jump.
  WallClock();
  ~WallClock();
  WallClock(const WallClock&) = delete;
  WallClock& operator=(const WallClock&) = delete;

  void jump(std::chrono::seconds by);
};

}  // namespace dst
