#include "drivers/frame_reader.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>

namespace drivers {

using boost::asio::experimental::awaitable_operators::operator||;

namespace {
constexpr std::size_t kHeardMost = 2048;
}

// Keeps what it read even when its result is no longer asked for: bytes that come together with the
// deadline are not lost.
hal::Task<void> FrameReader::fill() {
  const auto size = co_await stream_.read_some(piece_);
  filled_ = size ? hal::Result<void>() : size.error();
  if (!size) co_return;
  const ByteView got = ByteView(piece_).first(*size);
  arrival_ = clock_.now();
  bytes_ += got.size();
  resync_.feed(got);
  const ByteView kept = got.first(std::min(got.size(), kHeardMost - heard_.size()));
  heard_.insert(heard_.end(), kept.begin(), kept.end());
}

hal::Task<hal::Result<ByteView>> FrameReader::next() {
  for (;;) {
    if (const auto frame = resync_.next(look_)) co_return *frame;
    co_await fill();
    if (!filled_) co_return filled_.error();
  }
}

hal::Task<hal::Result<ByteView>> FrameReader::next(hal::Time deadline) {
  for (;;) {
    if (const auto frame = resync_.next(look_)) co_return *frame;
    filled_ = boost::system::errc::make_error_code(boost::system::errc::timed_out);
    if (clock_.now() < deadline) co_await (fill() || clock_.sleep_until(deadline));
    if (!filled_) co_return filled_.error();
  }
}

std::uint64_t FrameReader::damaged_bytes() const {
  std::uint64_t damaged = 0;
  for (const auto& [why, by] : resync_.skipped()) damaged += by.bytes;
  return damaged;
}

}  // namespace drivers
