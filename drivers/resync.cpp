#include "drivers/resync.hpp"

#include <algorithm>

namespace drivers {

void skip(SkippedBy& skipped, std::string_view why, std::size_t bytes) {
  Skipped& by = skipped[std::string(why)];
  ++by.times;
  by.bytes += bytes;
}

void add(SkippedBy& all, const SkippedBy& more) {
  for (const auto& [why, by] : more) {
    all[why].times += by.times;
    all[why].bytes += by.bytes;
  }
}

void Resync::feed(ByteView bytes) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

// Bytes skipped in a row for one reason are one time.
void Resync::skip(std::string_view why, std::size_t count) {
  count = std::clamp<std::size_t>(count, 1, waiting());
  auto found = skipped_.find(why);
  if (found == skipped_.end()) found = skipped_.emplace(why, Skipped{}).first;
  found->second.times += why != skipping_;
  found->second.bytes += count;
  skipping_ = found->first;
  begin_ += count;
}

}  // namespace drivers
