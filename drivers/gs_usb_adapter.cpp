#include "drivers/gs_usb_adapter.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/circular_buffer.hpp>
#include <deque>

#include "drivers/kept_stream.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
namespace errc = boost::system::errc;
using namespace std::chrono_literals;
using namespace asio::experimental::awaitable_operators;
using gs_usb::Request;

constexpr std::uint32_t kBusOff = 0x40, kRestarted = 0x100;          // Classes.
constexpr std::uint8_t kPassive = 0x10 | 0x20, kActiveAgain = 0x40;  // Controller.
constexpr std::uint32_t kNoAcknowledge = 0x20;
constexpr hal::Duration kRestartPause = 100ms, kRestartWindow = 1min;
constexpr std::size_t kRestartsMax = 5;
constexpr hal::Duration kDrain = 50ms;  // What an adapter still has from before comes within that.

}  // namespace

struct GsUsbAdapter::State : std::enable_shared_from_this<State> {
  State(Open its_open, hal::Clock& its_clock) : open(std::move(its_open)), clock(its_clock) {}

  static hal::Task<void> keep(std::shared_ptr<State> self);
  hal::Task<std::optional<Trouble>> start(std::shared_ptr<UsbPipe> with);
  hal::Task<void> drain(UsbPipe& from);
  hal::Task<void> pump(std::shared_ptr<UsbPipe> from);
  hal::Task<void> restart_the_lost();
  void handle(const gs_usb::HostFrame& transfer);
  AChannel* channel_of(std::uint8_t number);
  void lose(Trouble why);

  Open open;
  hal::Clock& clock;
  asio::cancellation_signal stop;
  hal::Wake changed;  // Found, lost, confirmed, received, bus off, restarted.
  hal::Wake look_again;
  std::shared_ptr<UsbPipe> opened;  // Running or being started.
  std::shared_ptr<UsbPipe> pipe;    // Null while there is no running adapter.
  std::optional<Trouble> trouble;
  std::deque<AChannel> channels;
};

class GsUsbAdapter::AChannel final : public GsUsbAdapter::Channel {
 public:
  AChannel(State& adapter, std::uint8_t number, std::uint32_t bit_rate_bps, std::string address)
      : adapter_(adapter),
        number_(number),
        bit_rate_bps_(bit_rate_bps),
        address_(std::move(address)) {}

  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override;
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override;
  std::string address() const override { return address_; }
  std::vector<Trouble> troubles() const override;
  std::uint64_t lost_frames() const override { return lost_; }
  std::uint64_t restarts() const override { return restarts_; }

  // Reset, timing, start; with what is wrong.
  hal::Task<std::optional<Trouble>> start(UsbPipe& pipe);
  hal::Task<hal::Result<void>> reset(UsbPipe& pipe);
  void handle(const gs_usb::Received& received);
  void handle(const gs_usb::Echo& echo);
  void handle(const gs_usb::BusError& error);
  void lose();
  // When it is to be restarted; Time::max(): it is not bus off.
  hal::Time restart_due() const;
  hal::Task<bool> restart();
  std::uint8_t number() const { return number_; }

 private:
  bool usable() const { return adapter_.pipe && !bus_off_since_; }
  hal::Task<void> until_changed_or(hal::Time wake) {
    co_await (adapter_.clock.sleep_until(wake) || adapter_.changed.wait());
  }
  hal::Task<hal::Result<void>> write(hal::CanFrame frame);
  hal::Task<hal::Result<void>> confirmed(hal::Time deadline);

  State& adapter_;
  std::uint8_t number_;
  std::uint32_t bit_rate_bps_;
  std::string address_;

  gs_usb::BitTiming timing_;
  std::uint32_t flags_{};
  std::optional<hal::Time> bus_off_since_;
  std::deque<hal::Time> restarted_at_;  // Within the last minute.
  std::uint64_t restarts_{};
  std::uint32_t error_classes_{};  // Of the last error frame.
  bool passive_ = false;
  bool loss_untold_ = false;
  bool busy_ = false;  // Somebody sends or restarts.
  std::uint32_t echo_id_{};
  std::optional<hal::Time> unconfirmed_since_;
  boost::circular_buffer<hal::ReceivedFrame> received_{kReceivedMax};
  std::uint64_t lost_{};

  struct Turn {
    explicit Turn(AChannel& its_channel)
        : adapter(its_channel.adapter_.shared_from_this()), channel(its_channel) {
      channel.busy_ = true;
    }
    ~Turn() {
      channel.busy_ = false;
      channel.adapter_.changed.notify();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    std::shared_ptr<State> adapter;  // Who has its turn may be unwound later than the adapter.
    AChannel& channel;
  };
};

// --- The adapter.

hal::Task<void> GsUsbAdapter::State::keep(std::shared_ptr<State> self) {
  BackOff pause(100ms, 2s);
  for (;;) {
    auto opened = co_await self->open();
    if (auto* why = std::get_if<Trouble>(&opened)) {
      self->trouble = std::move(*why);
    } else {
      const auto pipe = std::get<std::shared_ptr<UsbPipe>>(std::move(opened));
      self->opened = pipe;
      self->trouble = co_await self->start(pipe);
      if (!self->trouble) {
        pause.reset();
        self->pipe = pipe;
        self->changed.notify();
        co_await (self->pump(pipe) || self->restart_the_lost());
        self->lose(drivers::trouble(LinkFault::lost, pipe->name()));
      }
    }
    self->opened.reset();
    co_await (self->clock.sleep_for(pause.next()) || self->look_again.wait());
  }
}

hal::Task<std::optional<Trouble>> GsUsbAdapter::State::start(std::shared_ptr<UsbPipe> with) {
  auto put = co_await with->put(Request::host_format, 1, gs_usb::host_format());
  if (!put) co_return trouble_of(put.error(), with->name());
  const auto reply = co_await with->get(Request::device_config, 1, 12);
  if (!reply) co_return trouble_of(reply.error(), with->name());
  const auto config = gs_usb::decode_config(*reply);
  if (!config) co_return drivers::trouble(LinkFault::other_device, with->name());
  for (const AChannel& channel : channels)
    if (channel.number() >= config->channels)
      co_return drivers::trouble(LinkFault::bad_settings,
                                 channel.address() + ": " + with->name() + " has " +
                                     std::to_string(config->channels) + " channels, from 0");
  for (AChannel& channel : channels) {
    const auto reset = co_await channel.reset(*with);
    if (!reset) co_return trouble_of(reset.error(), with->name());
  }
  co_await (drain(*with) || clock.sleep_for(kDrain));
  for (AChannel& channel : channels) {
    auto why = co_await channel.start(*with);
    if (why) co_return why;
  }
  co_return std::nullopt;
}

hal::Task<void> GsUsbAdapter::State::drain(UsbPipe& from) {
  for (;;) {
    const auto stale = co_await from.read();
    if (!stale) co_return;
  }
}

hal::Task<void> GsUsbAdapter::State::pump(std::shared_ptr<UsbPipe> from) {
  for (;;) {
    const auto transfer = co_await from->read();
    if (!transfer) co_return;
    handle(gs_usb::decode(*transfer, false));
  }
}

GsUsbAdapter::AChannel* GsUsbAdapter::State::channel_of(std::uint8_t number) {
  for (AChannel& channel : channels)
    if (channel.number() == number) return &channel;
  return nullptr;
}

void GsUsbAdapter::State::handle(const gs_usb::HostFrame& transfer) {
  std::visit(
      [this](const auto& message) {
        if constexpr (requires { message.channel; })
          if (AChannel* const channel = channel_of(message.channel)) channel->handle(message);
      },
      transfer);
  changed.notify();
}

hal::Task<void> GsUsbAdapter::State::restart_the_lost() {
  for (;;) {
    AChannel* first = nullptr;
    for (AChannel& channel : channels)
      if (first == nullptr || channel.restart_due() < first->restart_due()) first = &channel;
    if (first == nullptr || first->restart_due() == hal::Time::max())
      co_await changed.wait();
    else if (first->restart_due() > clock.now())
      co_await (clock.sleep_until(first->restart_due()) || changed.wait());
    else if (!co_await first->restart())
      co_return;
  }
}

void GsUsbAdapter::State::lose(Trouble why) {
  pipe.reset();
  trouble = std::move(why);
  for (AChannel& channel : channels) channel.lose();
  changed.notify();
}

// --- A channel.

hal::Task<hal::Result<void>> GsUsbAdapter::AChannel::reset(UsbPipe& pipe) {
  return pipe.put(Request::mode, number_, gs_usb::reset_mode());
}

hal::Task<std::optional<Trouble>> GsUsbAdapter::AChannel::start(UsbPipe& pipe) {
  const auto reply = co_await pipe.get(Request::bit_timing_limits, number_, 40);
  if (!reply) co_return trouble_of(reply.error(), pipe.name());
  const auto limits = gs_usb::decode_limits(*reply);
  if (!limits) co_return trouble(LinkFault::other_device, pipe.name());
  const auto timing = gs_usb::timing_for(*limits, bit_rate_bps_);
  if (!timing)
    co_return trouble(LinkFault::bad_settings,
                      address_ + ": its clock of " + std::to_string(limits->clock_hz) +
                          " Hz does not divide to " + std::to_string(bit_rate_bps_) + " bit/s");
  timing_ = *timing;
  flags_ = limits->features & gs_usb::kBusErrors;
  auto put = co_await pipe.put(Request::bit_timing, number_, gs_usb::encode(timing_));
  if (put) put = co_await pipe.put(Request::mode, number_, gs_usb::start_mode(flags_));
  if (!put) co_return trouble_of(put.error(), address_);
  bus_off_since_.reset();
  unconfirmed_since_.reset();
  passive_ = false;
  error_classes_ = 0;
  co_return std::nullopt;
}

// False when the adapter is gone. Whatever the controller still had is not sent any more.
hal::Task<bool> GsUsbAdapter::AChannel::restart() {
  while (busy_) co_await adapter_.changed.wait();
  const auto pipe = adapter_.pipe;
  if (!pipe) co_return false;
  const Turn turn(*this);
  auto put = co_await reset(*pipe);
  if (put) put = co_await pipe->put(Request::bit_timing, number_, gs_usb::encode(timing_));
  if (put) put = co_await pipe->put(Request::mode, number_, gs_usb::start_mode(flags_));
  if (!put) co_return false;
  ++restarts_;
  restarted_at_.push_back(adapter_.clock.now());
  if (restarted_at_.size() > kRestartsMax) restarted_at_.pop_front();
  bus_off_since_.reset();
  unconfirmed_since_.reset();
  co_return true;
}

hal::Time GsUsbAdapter::AChannel::restart_due() const {
  if (!bus_off_since_) return hal::Time::max();
  const hal::Time soon = *bus_off_since_ + kRestartPause;
  if (restarted_at_.size() < kRestartsMax) return soon;
  return std::max(soon, restarted_at_.front() + kRestartWindow);
}

void GsUsbAdapter::AChannel::handle(const gs_usb::Received& received) {
  if (received.overflow) ++lost_;
  if (received_.full())
    ++lost_;
  else
    received_.push_back({adapter_.clock.now(), received.frame});
}

void GsUsbAdapter::AChannel::handle(const gs_usb::Echo& echo) {
  if (echo.id != echo_id_) return;  // Of a frame given up before a restart.
  unconfirmed_since_.reset();
  error_classes_ = 0;
}

void GsUsbAdapter::AChannel::handle(const gs_usb::BusError& error) {
  error_classes_ = error.classes;
  passive_ = (error.controller & kPassive) != 0;
  if ((error.classes & kRestarted) != 0 || (error.controller & kActiveAgain) != 0)
    bus_off_since_.reset();
  if ((error.classes & kBusOff) == 0 || bus_off_since_) return;
  bus_off_since_ = adapter_.clock.now();
  loss_untold_ = true;
}

void GsUsbAdapter::AChannel::lose() {
  loss_untold_ = true;
  unconfirmed_since_.reset();
  bus_off_since_.reset();
}

hal::Task<hal::Result<void>> GsUsbAdapter::AChannel::send(hal::CanFrame frame, hal::Time deadline) {
  hal::Clock& clock = adapter_.clock;
  while (usable() && clock.now() < deadline && busy_) co_await until_changed_or(deadline);
  if (!usable()) co_return errc::make_error_code(errc::network_down);
  if (clock.now() >= deadline) co_return errc::make_error_code(errc::timed_out);
  {
    const Turn turn(*this);
    // One that its sender gave up goes before.
    auto sent = co_await confirmed(deadline);
    if (sent) sent = co_await write(frame);
    if (sent) sent = co_await confirmed(deadline);
    if (sent || sent.error() != errc::timed_out) co_return sent;
  }
  if (unconfirmed_since_) co_await restart();  // Recalls it.
  co_return errc::make_error_code(errc::timed_out);
}

hal::Task<hal::Result<void>> GsUsbAdapter::AChannel::write(hal::CanFrame frame) {
  const auto pipe = adapter_.pipe;
  echo_id_ = (echo_id_ + 1) % gs_usb::kInFlightMax;
  unconfirmed_since_ = adapter_.clock.now();
  const auto bytes = gs_usb::encode(frame, number_, echo_id_);
  const auto written = co_await pipe->write(Bytes(bytes.begin(), bytes.end()));
  if (!written) co_return errc::make_error_code(errc::network_down);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<void>> GsUsbAdapter::AChannel::confirmed(hal::Time deadline) {
  while (usable() && unconfirmed_since_ && adapter_.clock.now() < deadline)
    co_await until_changed_or(deadline);
  if (!usable()) co_return errc::make_error_code(errc::network_down);
  if (unconfirmed_since_) co_return errc::make_error_code(errc::timed_out);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::ReceivedFrame>> GsUsbAdapter::AChannel::receive() {
  for (;;) {
    if (loss_untold_ && (usable() || received_.empty())) {
      loss_untold_ = false;
      received_.clear();
      co_return errc::make_error_code(errc::network_down);
    }
    if (!received_.empty()) {
      const hal::ReceivedFrame frame = received_.front();
      received_.pop_front();
      co_return frame;
    }
    co_await adapter_.changed.wait();
  }
}

std::vector<Trouble> GsUsbAdapter::AChannel::troubles() const {
  if (adapter_.trouble) return {*adapter_.trouble};
  if (bus_off_since_)
    return {trouble(LinkFault::bus_off,
                    address_ + ": restarted " + std::to_string(restarts_) + " times so far")};
  std::vector<Trouble> troubles;
  if ((error_classes_ & kNoAcknowledge) != 0 ||
      (unconfirmed_since_ && adapter_.clock.now() - *unconfirmed_since_ > 100ms))
    troubles.push_back(trouble(LinkFault::not_acknowledged, address_));
  if (passive_) troubles.push_back(trouble(LinkFault::bus_passive, address_));
  return troubles;
}

// --- The whole.

GsUsbAdapter::GsUsbAdapter(Open open, const asio::any_io_executor& executor, hal::Clock& clock)
    : state_(std::make_shared<State>(std::move(open), clock)) {
  asio::co_spawn(executor, State::keep(state_),
                 asio::bind_cancellation_slot(
                     state_->stop.slot(),
                     [state = state_](std::exception_ptr problem) { end_of_link(problem); }));
}

GsUsbAdapter::~GsUsbAdapter() {
  state_->stop.emit(asio::cancellation_type::terminal);
  // Who waits holds the state and the pipe, and they them: nobody else would let go.
  if (const auto pipe = state_->opened) pipe->close();
  state_->changed.drop();
  state_->look_again.drop();
}

GsUsbAdapter::Channel& GsUsbAdapter::channel(std::uint8_t number, std::uint32_t bit_rate_bps,
                                             std::string address) {
  return state_->channels.emplace_back(*state_, number, bit_rate_bps, std::move(address));
}

void GsUsbAdapter::look_again() {
  state_->look_again.notify();
}

}  // namespace drivers
