// Whole frames out of a stream of bytes that may be cut, damaged or joined half-way.
//
// A codec says what it sees at the front of the buffer: a whole frame, the beginning of one, or no
// frame. What is no frame is skipped byte by byte (or as far as the codec is sure) and counted by
// reason, so that a damaged stream gives the same good frames as an undamaged one minus the
// damaged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/bytes.hpp"

namespace drivers {

struct Look {
  enum class At { frame, more, none };
  At at{};
  std::size_t size{};    // frame: of all of it. none: bytes to skip, at least 1.
  std::string_view why;  // none: a reason that stays the same from one skip to the next.

  static Look frame(std::size_t size) { return {At::frame, size, {}}; }
  static Look more() { return {At::more, 0, {}}; }
  static Look none(std::string_view why, std::size_t skip = 1) { return {At::none, skip, why}; }
};

// What was passed over: how often, and how many bytes in all, by reason.
struct Skipped {
  std::uint64_t times{};
  std::uint64_t bytes{};
};
using SkippedBy = std::map<std::string, Skipped, std::less<>>;
void skip(SkippedBy& skipped, std::string_view why, std::size_t bytes);
void add(SkippedBy& all, const SkippedBy& more);

class Resync {
 public:
  // Holds at most frame_max bytes that belong to no whole frame yet.
  explicit Resync(std::size_t frame_max) : frame_max_(frame_max) {}

  // Bytes as they came from the link. Views given by next() end here.
  void feed(ByteView bytes);

  // look(ByteView front) -> Look, with front not empty. The next whole frame, or nothing until more
  // is fed. The view holds until the next feed().
  template <class LookAt>
  std::optional<ByteView> next(LookAt&& look) {
    while (begin_ < buffer_.size()) {
      const ByteView front = ByteView(buffer_).subspan(begin_);
      const Look seen = look(front);
      if (seen.at == Look::At::frame && seen.size <= front.size()) {
        begin_ += seen.size;
        skipping_ = {};
        return front.first(seen.size);
      }
      if (seen.at == Look::At::none)
        skip(seen.why, seen.size);
      else if (front.size() >= frame_max_)
        skip("no end", 1);
      else
        return std::nullopt;
    }
    return std::nullopt;
  }

  const SkippedBy& skipped() const { return skipped_; }
  std::size_t waiting() const { return buffer_.size() - begin_; }

 private:
  void skip(std::string_view why, std::size_t count);

  std::size_t frame_max_;
  Bytes buffer_;
  std::size_t begin_{};
  std::string_view skipping_;  // The reason of the last skip, if nothing came since.
  SkippedBy skipped_;
};

}  // namespace drivers
