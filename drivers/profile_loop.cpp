#include "drivers/profile_loop.hpp"

#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>

namespace drivers {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
using boost::system::errc::make_error_code;
using namespace profile_fault;

namespace {

constexpr hal::Duration kProfileTimeout = 2s;
constexpr hal::Duration kAliveEvery = 10s;
constexpr hal::Duration kSilenceMax = 2s;  // Then the session is over.

}  // namespace

ProfileLoop::ProfileLoop(const Nature& nature, hal::Clock& clock, hal::ByteStream& stream)
    : nature_(nature),
      clock_(clock),
      queue_(nature.profiles_max),
      stream_(stream),
      resync_(nature.frame_max) {}

hal::Task<void> ProfileLoop::run() {
  for (;;) {
    state_ = DeviceState::starting;
    co_await session();
    state_ = DeviceState::lost;
    end_session();
    streaming_ = false;
    switched_.notify();
    co_await clock_.sleep_for(hal::from_seconds(nature_.retry_s));
  }
}

// Ends when the scanner is lost; the trouble says why.
hal::Task<void> ProfileLoop::session() {
  streaming_ = false;
  bytes_ = 0;
  resync_ = Resync(nature_.frame_max);
  begin_session();
  co_await (receive() || converse());
}

hal::Task<void> ProfileLoop::receive() {
  std::array<std::uint8_t, 16384> buffer;
  for (;;) {
    const auto got = co_await stream_.read_some(buffer);
    if (!got) {
      troubles_.set(kUnplugged, got.error().message());
      co_return;
    }
    troubles_.clear(kUnplugged);
    const hal::Time arrival = clock_.now();
    bytes_ += *got;
    resync_.feed(ByteView(buffer).first(*got));
    while (const auto frame = resync_.next(nature_.look)) take(*frame, arrival);
  }
}

hal::Task<void> ProfileLoop::converse() {
  const bool ready = co_await set_up();
  if (!ready) co_return;
  for (const Fault* fault : {nature_.silent, nature_.garbage, &kOtherModel, &kQuiet})
    troubles_.clear(*fault);
  clear_set_up_troubles();
  state_ = DeviceState::running;
  co_await serve();
}

// Until the scanner is lost.
hal::Task<void> ProfileLoop::serve() {
  bool there = true;
  while (there) {
    if (wanted_ != streaming_) {
      there = co_await stream(wanted_);
    } else if (streaming_) {
      there = co_await tend_stream();
    } else {
      const bool changed = co_await changed_.wait_until(clock_, clock_.now() + kAliveEvery);
      if (!changed) there = co_await is_alive();
    }
  }
}

hal::Task<bool> ProfileLoop::tend_stream() {
  const hal::Duration quiet = hal::from_seconds(3 * period_s()) + 100ms;
  co_await changed_.wait_until(clock_, clock_.now() + quiet);
  if (must_be_set_up_again()) co_return false;
  const hal::Duration silence = clock_.now() - last_scan_;
  if (!wanted_ || silence <= quiet) co_return true;
  troubles_.set(kQuiet, "none for " + std::to_string(silence / 1ms) + " ms");
  if (silence > kSilenceMax) co_return false;
  co_return co_await revive();
}

hal::Task<hal::Result<void>> ProfileLoop::start() {
  wanted_ = true;
  changed_.notify();
  co_return co_await wait_until_streaming(true);
}

hal::Task<hal::Result<void>> ProfileLoop::stop() {
  wanted_ = false;
  changed_.notify();
  co_return co_await wait_until_streaming(false);
}

hal::Task<hal::Result<void>> ProfileLoop::wait_until_streaming(bool on) {
  const hal::Time deadline = clock_.now() + nature_.start_max;
  while (streaming_ != on) {
    const bool changed = co_await switched_.wait_until(clock_, deadline);
    if (!changed) co_return make_error_code(boost::system::errc::timed_out);
  }
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::Profile>> ProfileLoop::next_profile() {
  if (!wanted_) co_return make_error_code(boost::system::errc::operation_not_permitted);
  co_return co_await queue_.next(clock_, kProfileTimeout);
}

hal::Task<void> ProfileLoop::write(ByteView request, hal::Time deadline) {
  const auto written = co_await (stream_.write(request) || clock_.sleep_until(deadline));
  const auto* const result = std::get_if<0>(&written);
  if (result == nullptr) co_return;
  troubles_.set_if(!*result, kUnplugged, *result ? "" : result->error().message());
}

void ProfileLoop::tell_silence(const std::string& asked) {
  if (troubles_.has(kUnplugged)) return;
  const bool garbage = bytes_skipped() > 0;
  troubles_.clear(garbage ? *nature_.silent : *nature_.garbage);
  troubles_.set(garbage ? *nature_.garbage : *nature_.silent,
                garbage ? std::to_string(bytes_) + " bytes came, none of them an answer" : asked);
}

std::uint64_t ProfileLoop::bytes_skipped() const {
  std::uint64_t bytes = 0;
  for (const auto& [why, skipped] : resync_.skipped()) bytes += skipped.bytes;
  return bytes;
}

}  // namespace drivers
