// What a byte stream promises: two ends of one line or connection.
#pragma once

#include "tests/links/promises/promises.hpp"

namespace links_test {

struct StreamRig {
  virtual ~StreamRig() = default;
  virtual Loop& loop() = 0;
  virtual hal::ByteStream& a() = 0;  // Ours.
  virtual hal::ByteStream& b() = 0;  // The device's; where it is no link of ours, it may know less
                                     // of losses.
  virtual bool cut() { return false; }
  virtual void mend() {}
};

std::span<const Promise<StreamRig>> stream_promises();

}  // namespace links_test
