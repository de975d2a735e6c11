#include "drivers/socketcan.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/circular_buffer.hpp>
#include <cerrno>

#include "drivers/kept_stream.hpp"
#include "drivers/kernel_stamp.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
namespace errc = boost::system::errc;
using asio::posix::stream_descriptor;
using boost::system::error_code;
using namespace asio::experimental::awaitable_operators;
using rtnetlink::Interface;

constexpr hal::Duration kAskPause = std::chrono::milliseconds(200);

error_code last_error() {
  return {errno, boost::system::system_category()};
}
error_code network_down() {
  return errc::make_error_code(errc::network_down);
}

can_frame to_kernel(const hal::CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  raw.len = frame.size;
  std::copy_n(frame.data.begin(), frame.size, raw.data);
  return raw;
}

hal::CanFrame from_kernel(const can_frame& raw) {
  hal::CanFrame frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = std::min<std::uint8_t>(raw.len, 8);
  if (!frame.remote) std::copy_n(raw.data, frame.size, frame.data.begin());
  return frame;
}

template <class T>
bool set(int socket, int level, int name, const T& value) {
  return setsockopt(socket, level, name, &value, sizeof value) == 0;
}

// An error, or the socket in `handle`.
error_code open_can(int index, int& handle) {
  handle = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (handle < 0) return last_error();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  set(handle, SOL_SOCKET, SO_RCVBUF, 1 << 20);
  const bool ready = set(handle, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK}) &&
                     set(handle, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, 1) &&
                     set(handle, SOL_SOCKET, SO_TIMESTAMPNS, 1) &&
                     set(handle, SOL_SOCKET, SO_RXQ_OVFL, 1) &&
                     bind(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (ready) return {};
  const error_code error = last_error();
  close(handle);
  return error;
}

// Tells of all interfaces' changes.
int open_news() {
  const int handle = socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (handle < 0) return handle;
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK;
  if (bind(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return handle;
  close(handle);
  return -1;
}

}  // namespace

struct SocketCan::State {
  State(CanAddress its_address, const asio::any_io_executor& its_executor, hal::Clock& its_clock,
        std::vector<hal::CanFilter> its_filters)
      : address(std::move(its_address)),
        executor(its_executor),
        clock(its_clock),
        filters(std::move(its_filters)) {}

  // Loops until stopped.
  static hal::Task<void> follow_interface(std::shared_ptr<State> self);
  static hal::Task<void> pump(std::shared_ptr<State> self);
  static hal::Task<void> ring(std::shared_ptr<State> self);

  hal::Task<void> read_news(stream_descriptor& news);
  hal::Task<void> ask_while_off(stream_descriptor& news);
  void hear(const Interface& news);
  void open();
  void lose();
  bool usable() const { return socket && !bus_off; }
  void set_bus_off(bool off);
  void drain();
  void take(const can_frame& raw, bool own, hal::Time stamp);
  void take_error(const can_frame& raw);
  void listen_for(const hal::CanFrame& frame);
  void apply_filters();

  hal::Task<hal::Result<void>> write(const hal::CanFrame& frame, hal::Time deadline);
  hal::Task<void> until_changed_or(hal::Time wake);

  const CanAddress address;
  asio::any_io_executor executor;
  hal::Clock& clock;
  const std::vector<hal::CanFilter> filters;
  asio::cancellation_signal stop_following, stop_pumping, stop_ringing;

  Interface interface;
  std::shared_ptr<stream_descriptor> socket;  // Null while the interface is not up.
  std::optional<Trouble> open_trouble;
  bool bus_off = false;
  std::uint32_t controller{};  // The last error frame's byte 1: warning, passive.
  bool loss_untold = false;
  hal::Wake changed;               // Received, confirmed, up, down; or the alarm rang.
  std::optional<hal::Time> alarm;  // Of the first of those who wait for no longer than that.
  hal::Wake alarm_set;

  boost::circular_buffer<hal::ReceivedFrame> received{kReceivedMax};
  std::uint64_t lost{};
  std::uint32_t dropped{};                               // The kernel's counter.
  std::vector<std::pair<std::uint32_t, bool>> sent_ids;  // Their echoes must pass the filters.
  bool sending = false;
  std::optional<hal::Time> unconfirmed_since;  // A frame that the controller has.
  std::uint64_t drops{};                       // How often what the controller had was dropped.
};

// --- The interface.

hal::Task<void> SocketCan::State::follow_interface(std::shared_ptr<State> self) {
  BackOff pause(std::chrono::milliseconds(100), std::chrono::seconds(5));
  for (;;) {
    if (const int handle = open_news(); handle >= 0) {
      stream_descriptor news(self->executor, handle);
      co_await (self->read_news(news) || self->ask_while_off(news));  // Ends when news were lost.
    }
    co_await self->clock.sleep_for(pause.next());
  }
}

hal::Task<void> SocketCan::State::read_news(stream_descriptor& news) {
  const Bytes question = rtnetlink::ask_for(address.interface);
  if (::send(news.native_handle(), question.data(), question.size(), 0) < 0) co_return;
  Bytes datagram(32768);
  for (;;) {
    const auto [error] = co_await news.async_wait(stream_descriptor::wait_read, kUseTuple);
    if (error) co_return;
    const auto size = ::recv(news.native_handle(), datagram.data(), datagram.size(), 0);
    if (size < 0 && errno != EAGAIN) co_return;
    for (const Interface& each : rtnetlink::decode(
             ByteView(datagram).first(static_cast<std::size_t>(std::max<ssize_t>(size, 0)))))
      if (each.name == address.interface || (each.index == interface.index && each.index != 0))
        hear(each);
  }
}

// The news of a restart tell the state of before where the kernel restarts the controller only
// afterwards, and no news follow: so it is asked.
hal::Task<void> SocketCan::State::ask_while_off(stream_descriptor& news) {
  const Bytes question = rtnetlink::ask_for(address.interface);
  for (;;) {
    while (!bus_off) co_await changed.wait();
    co_await clock.sleep_for(kAskPause);
    if (bus_off) ::send(news.native_handle(), question.data(), question.size(), 0);
  }
}

void SocketCan::State::hear(const Interface& news) {
  const bool renamed = news.name != address.interface;
  const bool here = !news.removed && !renamed;
  if (socket && (!here || !news.up || news.index != interface.index)) lose();
  interface = here ? news : Interface{};
  if (here && news.up && !socket) open();
  if (!socket) return;
  const bool off = news.can.state == gs_usb::BusState::bus_off || !news.running;
  // Some drivers keep the carrier in bus off: an error frame told then, and only a restart's or
  // another state counts as the end.
  if (off || news.can.state) set_bus_off(off);
}

void SocketCan::State::open() {
  int handle = -1;
  if (const error_code error = open_can(interface.index, handle)) {
    open_trouble = trouble_of(error, to_text(LinkAddress(address)));
    return;
  }
  open_trouble.reset();
  socket = std::make_shared<stream_descriptor>(executor, handle);
  bus_off = false;
  controller = 0;
  dropped = 0;
  apply_filters();
  changed.notify();
}

void SocketCan::State::lose() {
  if (!socket) return;
  error_code ignored;
  socket->close(ignored);
  socket.reset();
  unconfirmed_since.reset();
  ++drops;
  loss_untold = true;
  changed.notify();
}

void SocketCan::State::set_bus_off(bool off) {
  if (std::exchange(bus_off, off) == off) return;
  if (off) {
    loss_untold = true;
    unconfirmed_since.reset();  // The controller drops it.
    ++drops;
  }
  changed.notify();
}

// --- Receiving.

hal::Task<void> SocketCan::State::pump(std::shared_ptr<State> self) {
  for (;;) {
    const auto socket = self->socket;
    if (!socket) {
      co_await self->changed.wait();
      continue;
    }
    const auto [error] = co_await socket->async_wait(stream_descriptor::wait_read, kUseTuple);
    if (!error && self->socket == socket) self->drain();
  }
}

// At most a hundred frames: then others have their turn.
void SocketCan::State::drain() {
  for (int i = 0; i < 100 && socket; ++i) {
    can_frame raw{};
    alignas(cmsghdr) char control[128];
    iovec part{&raw, sizeof raw};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const auto size = recvmsg(socket->native_handle(), &message, 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size < 0) return lose();  // ENETDOWN, ENODEV: the news bring it back.
    const KernelNotes notes = read_notes(message);
    if (notes.dropped && *notes.dropped != dropped) {
      lost += *notes.dropped - dropped;
      dropped = *notes.dropped;
      unconfirmed_since.reset();  // Its echo may be among them.
    }
    if (size != sizeof raw) continue;
    take(raw, (message.msg_flags & MSG_CONFIRM) != 0, clock.now() - notes.age);
  }
}

void SocketCan::State::take(const can_frame& raw, bool own, hal::Time stamp) {
  if ((raw.can_id & CAN_ERR_FLAG) != 0) return take_error(raw);
  if (own) {
    unconfirmed_since.reset();
    changed.notify();
    return;
  }
  const hal::CanFrame frame = from_kernel(raw);
  if (!hal::passes(filters, frame)) return;
  if (received.full()) {
    ++lost;
    return;
  }
  received.push_back({stamp, frame});
  changed.notify();
}

void SocketCan::State::take_error(const can_frame& raw) {
  if ((raw.can_id & CAN_ERR_CRTL) != 0) controller = raw.data[1];
  if ((raw.can_id & CAN_ERR_RESTARTED) != 0) {
    controller = 0;
    set_bus_off(false);
  }
  if ((raw.can_id & CAN_ERR_BUSOFF) != 0) set_bus_off(true);
}

// --- Sending.

// Whoever waits looks again then. One timer for all: one for each frame, to be cancelled as soon as
// the frame is confirmed, would cost more than the frame.
hal::Task<void> SocketCan::State::ring(std::shared_ptr<State> self) {
  for (;;) {
    while (!self->alarm) co_await self->alarm_set.wait();
    co_await self->clock.sleep_until(*self->alarm);
    self->alarm.reset();
    self->changed.notify();
  }
}

hal::Task<void> SocketCan::State::until_changed_or(hal::Time wake) {
  if (alarm && wake < *alarm) {
    co_await (clock.sleep_until(wake) || changed.wait());
    co_return;
  }
  if (!alarm) {
    alarm = wake;
    alarm_set.notify();
  }
  co_await changed.wait();
}

void SocketCan::State::listen_for(const hal::CanFrame& frame) {
  const std::pair id(frame.id, frame.extended);
  if (hal::passes(filters, frame) ||
      std::find(sent_ids.begin(), sent_ids.end(), id) != sent_ids.end())
    return;
  sent_ids.push_back(id);
  apply_filters();
}

void SocketCan::State::apply_filters() {
  if (filters.empty() || !socket) return;
  std::vector<can_filter> all;
  for (const hal::CanFilter& filter : filters)
    all.push_back({filter.id | (filter.extended ? CAN_EFF_FLAG : 0U), filter.mask | CAN_EFF_FLAG});
  for (const auto& [id, extended] : sent_ids)
    all.push_back({id | (extended ? CAN_EFF_FLAG : 0U),
                   CAN_EFF_FLAG | (extended ? CAN_EFF_MASK : CAN_SFF_MASK)});
  setsockopt(socket->native_handle(), SOL_CAN_RAW, CAN_RAW_FILTER, all.data(),
             static_cast<socklen_t>(all.size() * sizeof all[0]));
}

hal::Task<hal::Result<void>> SocketCan::State::write(const hal::CanFrame& frame,
                                                     hal::Time deadline) {
  const can_frame raw = to_kernel(frame);
  listen_for(frame);
  while (clock.now() < deadline) {
    if (!usable()) co_return network_down();
    if (::write(socket->native_handle(), &raw, sizeof raw) == sizeof raw) {
      unconfirmed_since = clock.now();
      co_return hal::Result<void>{};
    }
    if (errno != ENOBUFS && errno != EAGAIN && errno != EINTR) {
      lose();
      co_return network_down();
    }
    // Other programs have filled the kernel's queue, which does not tell when it has room again.
    co_await clock.sleep_until(std::min(deadline, clock.now() + std::chrono::milliseconds(1)));
  }
  co_return errc::make_error_code(errc::timed_out);
}

hal::Task<hal::Result<void>> SocketCan::send(hal::CanFrame frame, hal::Time deadline) {
  const auto state = state_;
  while (state->usable() && state->clock.now() < deadline &&
         (state->sending || state->unconfirmed_since))
    co_await state->until_changed_or(deadline);
  if (!state->usable()) co_return network_down();
  if (state->clock.now() >= deadline) co_return errc::make_error_code(errc::timed_out);
  struct Turn {
    std::shared_ptr<State> state;
    explicit Turn(std::shared_ptr<State> its_state) : state(std::move(its_state)) {
      state->sending = true;
    }
    ~Turn() {
      state->sending = false;
      state->changed.notify();
    }
  } const turn(state);
  if (auto written = co_await state->write(frame, deadline); !written) co_return written;
  const std::uint64_t drops = state->drops;
  while (state->unconfirmed_since && state->usable() && state->clock.now() < deadline)
    co_await state->until_changed_or(deadline);
  if (!state->usable() || state->drops != drops) co_return network_down();
  if (state->unconfirmed_since) co_return errc::make_error_code(errc::timed_out);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::ReceivedFrame>> SocketCan::receive() {
  const auto state = state_;
  for (;;) {
    if (state->loss_untold && (state->usable() || state->received.empty())) {
      state->loss_untold = false;
      state->received.clear();
      co_return network_down();
    }
    if (!state->received.empty()) {
      const hal::ReceivedFrame frame = state->received.front();
      state->received.pop_front();
      co_return frame;
    }
    co_await state->changed.wait();
  }
}

// --- The whole.

SocketCan::SocketCan(CanAddress address, const asio::any_io_executor& executor, hal::Clock& clock,
                     std::vector<hal::CanFilter> filters)
    : address_(std::move(address)),
      state_(std::make_shared<State>(address_, executor, clock, std::move(filters))) {
  const auto ended = [state = state_](std::exception_ptr problem) { end_of_link(problem); };
  asio::co_spawn(executor, State::follow_interface(state_),
                 asio::bind_cancellation_slot(state_->stop_following.slot(), ended));
  asio::co_spawn(executor, State::pump(state_),
                 asio::bind_cancellation_slot(state_->stop_pumping.slot(), ended));
  asio::co_spawn(executor, State::ring(state_),
                 asio::bind_cancellation_slot(state_->stop_ringing.slot(), ended));
}

SocketCan::~SocketCan() {
  state_->stop_following.emit(asio::cancellation_type::terminal);
  state_->stop_pumping.emit(asio::cancellation_type::terminal);
  state_->stop_ringing.emit(asio::cancellation_type::terminal);
  state_->lose();
  state_->changed.drop();  // Who waits holds the state, and the state them.
  state_->alarm_set.drop();
}

std::vector<Trouble> SocketCan::troubles() const {
  const State& state = *state_;
  const std::string name = address();
  if (state.open_trouble) return {*state.open_trouble};
  if (state.interface.name.empty())
    return {trouble(LinkFault::absent, name + ": no such interface")};
  if (!state.socket)
    return {trouble(LinkFault::interface_down, name + ": IFACE is " + address_.interface)};
  if (state.bus_off) {
    const bool restarts = state.interface.can.restart_ms.value_or(0) > 0;
    return {trouble(LinkFault::bus_off,
                    name + (restarts ? ": the kernel restarts it"
                                     : ": stays off until `ip link set " + address_.interface +
                                           " type can restart` or down and up"))};
  }
  std::vector<Trouble> troubles;
  if ((state.controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0 ||
      state.interface.can.state == gs_usb::BusState::passive)
    troubles.push_back(trouble(LinkFault::bus_passive, name));
  if (state.unconfirmed_since &&
      state.clock.now() - *state.unconfirmed_since > std::chrono::milliseconds(100))
    troubles.push_back(trouble(LinkFault::not_acknowledged, name));
  return troubles;
}

const Interface& SocketCan::interface() const {
  return state_->interface;
}
std::uint64_t SocketCan::lost_frames() const {
  return state_->lost;
}

}  // namespace drivers
