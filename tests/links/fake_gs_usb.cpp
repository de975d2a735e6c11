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

}  // namespace

struct FakeGsUsb::State {
  sim::GsUsbUnit unit;
  bool plugged_in = true;
  int plugs = 0;  // A handle of before does not know the adapter that was plugged in again.
  int fails_in = 0;
  hal::Wake changed;

  State() {
    unit.on_ready([this] { changed.notify(); });
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
    if (!state_->unit.put(request, value, data)) co_return error(errc::not_supported);
    co_return hal::Result<void>{};
  }

  hal::Task<hal::Result<Bytes>> get(Request request, std::uint16_t value, std::size_t) override {
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    auto answer = state_->unit.get(request, value);
    if (!answer) co_return error(errc::not_supported);
    co_return std::move(*answer);
  }

  hal::Task<hal::Result<void>> write(Bytes frame) override {
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    state_->unit.take(frame);
    co_return hal::Result<void>{};
  }

  hal::Task<hal::Result<Bytes>> read() override {
    std::optional<Bytes> transfer;
    while (state_->plugs == plug_ && !(transfer = state_->unit.next()))
      co_await state_->changed.wait();
    if (const auto problem = state_->problem(plug_)) co_return *problem;
    co_return std::move(*transfer);
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
  state_->unit.power_cycle();
  state_->changed.notify();
}
void FakeGsUsb::plug_in() {
  state_->plugged_in = true;
}
void FakeGsUsb::silence(bool on) {
  state_->unit.silence(on);
}
void FakeGsUsb::go_bus_off(std::uint8_t channel) {
  state_->unit.go_bus_off(channel);
}
void FakeGsUsb::go_passive(std::uint8_t channel) {
  state_->unit.go_passive(channel);
}
void FakeGsUsb::hear(std::uint8_t channel, const hal::CanFrame& frame, bool overflow) {
  state_->unit.hear(channel, frame, overflow);
}
void FakeGsUsb::keep_stale(const hal::CanFrame& frame) {
  hear(0, frame, false);
}
void FakeGsUsb::fail_call(int n) {
  state_->fails_in = n;
}
int FakeGsUsb::starts(std::uint8_t channel) const {
  return state_->unit.starts(channel);
}

}  // namespace links_test
