// A byte stream that is opened again whenever it was lost: what serial ports and TCP connections
// have in common. For .cpp files: compiles slowly.
#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "drivers/back_off.hpp"
#include "drivers/link_trouble.hpp"
#include "hal/clock.hpp"
#include "hal/wake.hpp"

namespace drivers {

inline constexpr auto kUseTuple = boost::asio::as_tuple(boost::asio::use_awaitable);

// How a top-level coroutine of a link ends: by its destructor, or by our own mistake.
inline void end_of_link(std::exception_ptr problem) {
  try {
    if (problem) std::rethrow_exception(problem);
  } catch (const boost::system::system_error& error) {
    if (error.code() != boost::asio::error::operation_aborted) throw;
  }
}

// Stream: a socket or stream descriptor of Asio. Held by shared_ptr: by its link, and by what is
// still under way when the link goes.
template <class Stream>
class KeptStream {
 public:
  using Opened = std::variant<std::shared_ptr<Stream>, Trouble>;
  using Open = std::function<hal::Task<Opened>()>;
  using Self = std::shared_ptr<KeptStream>;

  static constexpr hal::Duration kPauseFirst = std::chrono::milliseconds(100);
  static constexpr hal::Duration kPauseMax = std::chrono::seconds(5);

  KeptStream(hal::Clock& clock, Open open, BackOff pause = {kPauseFirst, kPauseMax})
      : clock_(clock), open_(std::move(open)), pause_(pause) {}

  static void start(const Self& self, const boost::asio::any_io_executor& executor) {
    boost::asio::co_spawn(
        executor, keep(self),
        boost::asio::bind_cancellation_slot(
            self->stop_.slot(), [self](std::exception_ptr problem) { end_of_link(problem); }));
  }

  void stop() {
    stop_.emit(boost::asio::cancellation_type::terminal);
    drop();
    changed_.drop();  // Who waits holds us, and we them: nobody else would let go.
  }
  // Lost by our own will; it is opened again.
  void drop() { lose(stream_, boost::asio::error::operation_aborted); }

  static hal::Task<hal::Result<void>> write(Self self, std::span<const std::uint8_t> bytes) {
    const std::shared_ptr<Stream> stream = self->stream_;
    while (stream && self->writing_) co_await self->changed_.wait();
    if (!stream || self->stream_ != stream) co_return not_connected();
    const Turn turn(self);
    const auto [error, size] = co_await boost::asio::async_write(
        *stream, boost::asio::buffer(bytes.data(), bytes.size()), kUseTuple);
    if (!error) co_return hal::Result<void>{};
    self->end_with(stream, error);
    co_return not_connected();
  }

  static hal::Task<hal::Result<std::size_t>> read_some(Self self, std::span<std::uint8_t> into) {
    for (;;) {
      if (std::exchange(self->loss_untold_, false)) co_return not_connected();
      const std::shared_ptr<Stream> stream = self->stream_;
      if (!stream) {
        co_await self->changed_.wait();
        continue;
      }
      const auto [error, size] = co_await stream->async_read_some(
          boost::asio::buffer(into.data(), into.size()), kUseTuple);
      if (!error) co_return size;
      self->end_with(stream, error);
    }
  }

  const std::shared_ptr<Stream>& stream() const { return stream_; }  // Null while lost.
  const std::optional<Trouble>& trouble() const { return trouble_; }
  std::uint64_t losses() const { return losses_; }

 private:
  struct Turn {
    explicit Turn(Self its_self) : self(std::move(its_self)) { self->writing_ = true; }
    ~Turn() {
      self->writing_ = false;
      self->changed_.notify();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    Self self;
  };

  static boost::system::error_code not_connected() {
    return boost::system::errc::make_error_code(boost::system::errc::not_connected);
  }

  static hal::Task<void> keep(Self self) {
    for (;;) {
      auto opened = co_await self->open_();
      if (auto* trouble = std::get_if<Trouble>(&opened)) {
        self->trouble_ = std::move(*trouble);
      } else {
        const hal::Time since = self->clock_.now();
        self->trouble_.reset();
        self->stream_ = std::get<std::shared_ptr<Stream>>(std::move(opened));
        self->changed_.notify();
        while (self->stream_) co_await self->changed_.wait();
        if (self->clock_.now() - since > 2 * kPauseMax) self->pause_.reset();
      }
      co_await self->clock_.sleep_for(self->pause_.next());
    }
  }

  // A call ended with an error: the stream was lost, or the caller was cancelled.
  void end_with(const std::shared_ptr<Stream>& stream, boost::system::error_code error) {
    if (error == boost::asio::error::operation_aborted && stream_ == stream)
      throw boost::system::system_error(error);
    lose(stream, error);
  }

  void lose(std::shared_ptr<Stream> stream, boost::system::error_code error) {
    if (!stream || stream_ != stream) return;  // Known already.
    stream_.reset();
    loss_untold_ = true;
    ++losses_;
    trouble_ = trouble_of(error, "lost");
    boost::system::error_code ignored;
    stream->close(ignored);
    changed_.notify();
  }

  hal::Clock& clock_;
  Open open_;
  BackOff pause_;
  boost::asio::cancellation_signal stop_;
  std::shared_ptr<Stream> stream_;
  std::optional<Trouble> trouble_;
  hal::Wake changed_;
  bool loss_untold_ = false;
  bool writing_ = false;
  std::uint64_t losses_{};
};

}  // namespace drivers
