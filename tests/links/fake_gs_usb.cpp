#include "tests/links/fake_gs_usb.hpp"

namespace links_test {
namespace {

namespace errc = boost::system::errc;
namespace gs_usb = drivers::gs_usb;
using drivers::Bytes;
using gs_usb::Request;

boost::system::error_code error(errc::errc_t code) {
  return errc::make_error_code(code);
}

struct Channel {
  bool timed{}, started{}, bus_off{};
  int starts{};
  std::optional<std::pair<std::uint32_t, hal::CanFrame>> waiting{};  // Echo id, frame.
};

// A candleLight's.
constexpr gs_usb::BitTimingLimits kLimits{
    gs_usb::kListenOnly | gs_usb::kLoopBack, 48'000'000, 1, 16, 1, 8, 4, 1, 1024, 1};

}  // namespace

struct FakeGsUsb::State {
  bool plugged_in = true;
  int plugs = 0;  // A handle of before does not know the adapter that was plugged in again.
  bool silent = false;
  bool little_endian = false;
  int fails_in = 0;
  std::array<Channel, kChannels> channels;
  std::deque<Bytes> to_host;
  hal::Wake changed;

  void tell(Bytes transfer) {
    to_host.push_back(std::move(transfer));
    changed.notify();
  }

  void tell_error(std::uint8_t channel, std::uint32_t classes, std::uint8_t controller) {
    hal::CanFrame frame;
    frame.size = 8;
    frame.data[1] = controller;
    const auto raw = gs_usb::encode(frame, channel, gs_usb::kReceived);
    Bytes transfer(raw.begin(), raw.end());
    drivers::put_little<std::uint32_t>(transfer, 4, classes | 1U << 29);
    tell(std::move(transfer));
  }

  // What the channel has waiting goes, where somebody acknowledges.
  void transmit(std::uint8_t number) {
    Channel& channel = channels[number];
    const Channel& other = channels[1 - number];
    if (!channel.waiting || silent || !channel.started || !other.started || channel.bus_off ||
        other.bus_off)
      return;
    const auto [echo_id, frame] = *channel.waiting;
    channel.waiting.reset();
    tell(gs_usb::encode(gs_usb::Echo{echo_id, number, frame, std::nullopt}));
    tell(gs_usb::encode(
        gs_usb::Received{frame, static_cast<std::uint8_t>(1 - number), false, std::nullopt}));
  }

  // What the firmware does with a request; false: it stalls.
  bool take(Request request, std::uint16_t value, const Bytes& data) {
    if (request == Request::host_format) return little_endian = data == gs_usb::host_format();
    if (!little_endian || value >= kChannels) return false;
    Channel& channel = channels[value];
    if (request == Request::bit_timing) {
      if (channel.started || !gs_usb::decode_timing(data)) return false;
      return channel.timed = true;
    }
    if (request != Request::mode) return false;
    if (data == gs_usb::reset_mode()) {
      channel = {.starts = channel.starts};
      return true;
    }
    const auto flags = drivers::little<std::uint32_t>(data, 4);
    if (!channel.timed || (flags & ~kLimits.features) != 0) return false;
    channel.started = true;
    ++channel.starts;
    for (std::uint8_t each = 0; each < kChannels; ++each) transmit(each);
    return true;
  }

  std::optional<boost::system::error_code> problem(int plug) {
    if (!plugged_in || plug != plugs) return error(errc::no_such_device);
    if (fails_in > 0 && --fails_in == 0) return error(errc::io_error);
    return std::nullopt;
  }
};

class FakeGsUsb::Pipe final : public drivers::UsbPipe {
 public:
  explicit Pipe(std::shared_ptr<State> state) : state_(std::move(state)), plug_(state_->plugs) {}

  std::string name() const override { return "fake adapter"; }
  void close() override { state_->changed.drop(); }

  hal::Task<hal::Result<void>> put(Request request, std::uint16_t value, Bytes data) override {
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    if (!state_->take(request, value, data)) co_return error(errc::not_supported);
    co_return hal::Result<void>{};
  }

  hal::Task<hal::Result<Bytes>> get(Request request, std::uint16_t value, std::size_t) override {
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    if (request == Request::device_config)
      co_return gs_usb::encode(gs_usb::DeviceConfig{kChannels, 2, 1});
    if (request == Request::bit_timing_limits && value < kChannels)
      co_return gs_usb::encode(kLimits);
    co_return error(errc::not_supported);
  }

  hal::Task<hal::Result<void>> write(Bytes frame) override {
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    const auto decoded = gs_usb::decode(frame, false);
    const auto& echo = std::get<gs_usb::Echo>(decoded);
    auto& channel = state_->channels.at(echo.channel);
    // One waits here; what a driver sends on top of it is lost, and its echo with it.
    if (!channel.waiting) channel.waiting = {echo.id, echo.frame};
    state_->transmit(echo.channel);
    co_return hal::Result<void>{};
  }

  hal::Task<hal::Result<Bytes>> read() override {
    while (state_->plugs == plug_ && state_->to_host.empty()) co_await state_->changed.wait();
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    Bytes transfer = std::move(state_->to_host.front());
    state_->to_host.pop_front();
    co_return transfer;
  }

 private:
  std::shared_ptr<State> state_;
  int plug_;
};

FakeGsUsb::FakeGsUsb() : state_(std::make_shared<State>()) {}
FakeGsUsb::~FakeGsUsb() {
  state_->changed.drop();
}

drivers::GsUsbAdapter::Open FakeGsUsb::open() {
  return [state = state_]() -> hal::Task<drivers::GsUsbAdapter::Opened> {
    if (!state->plugged_in) co_return drivers::trouble(drivers::LinkFault::absent, "fake adapter");
    co_return std::make_shared<Pipe>(state);
  };
}

void FakeGsUsb::unplug() {
  state_->plugged_in = false;
  ++state_->plugs;
  state_->little_endian = false;
  state_->channels = {};
  state_->to_host.clear();
  state_->changed.notify();
}
void FakeGsUsb::plug_in() {
  state_->plugged_in = true;
}
void FakeGsUsb::silence(bool on) {
  state_->silent = on;
  for (std::uint8_t each = 0; each < kChannels; ++each) state_->transmit(each);
}
void FakeGsUsb::go_bus_off(std::uint8_t channel) {
  state_->channels.at(channel).bus_off = true;
  state_->tell_error(channel, 0x40, 0);
}
void FakeGsUsb::go_passive(std::uint8_t channel) {
  state_->tell_error(channel, 0x04, 0x20);
}
void FakeGsUsb::hear(std::uint8_t channel, const hal::CanFrame& frame, bool overflow) {
  state_->tell(gs_usb::encode(gs_usb::Received{frame, channel, overflow, std::nullopt}));
}
void FakeGsUsb::keep_stale(const hal::CanFrame& frame) {
  hear(0, frame, false);
}
void FakeGsUsb::fail_call(int n) {
  state_->fails_in = n;
}
int FakeGsUsb::starts(std::uint8_t channel) const {
  return state_->channels.at(channel).starts;
}

}  // namespace links_test
