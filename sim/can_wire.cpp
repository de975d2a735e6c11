#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <deque>

#include "sim/inbox.hpp"
#include "sim/links.hpp"
#include "sim/wire.hpp"

namespace sim {
namespace {

namespace errc = boost::system::errc;
using hal::CanFrame;
using namespace boost::asio::experimental::awaitable_operators;

// From the start of the frame to the end of the gap behind it, without stuff bits.
hal::Duration frame_time(const CanFrame& frame, double bit_rate_bps) {
  if (bit_rate_bps <= 0) return {};
  const int bits = (frame.extended ? 67 : 47) + (frame.remote ? 0 : 8 * frame.size);
  return hal::from_seconds(bits / bit_rate_bps);
}

}  // namespace

struct CanWire::Bus {
  class Plug;

  Bus(hal::Clock& its_clock, const Config& its_config)
      : clock(its_clock), config(its_config), disturbance(config.seed) {}

  bool acknowledged(const Plug& from) const;
  bool crowded() const;
  void deliver(const Plug& from, CanFrame frame);

  hal::Clock& clock;
  Config config;
  Disturbance disturbance;
  hal::Time busy_until{};
  hal::Wake changed;  // An end was cut or mended.
  std::deque<Plug> plugs;
};

class CanWire::Bus::Plug final : public CanWire::End {
 public:
  Plug(Bus& bus, std::vector<hal::CanFilter> filters)
      : bus_(bus),
        filters_(std::move(filters)),
        inbox_(bus.clock, bus.config.inbox_frames, error(errc::network_down)) {}

  hal::Task<hal::Result<void>> send(CanFrame frame, hal::Time deadline) override {
    while (!bus_.acknowledged(*this)) {
      if (!inbox_.connected()) co_return error(errc::network_down);
      if (bus_.clock.now() >= deadline) co_return error(errc::timed_out);
      co_await (bus_.clock.sleep_until(deadline) || bus_.changed.wait());
    }
    const hal::Time sent =
        std::max(bus_.clock.now(), bus_.busy_until) + frame_time(frame, bus_.config.bit_rate_bps);
    if (sent > deadline) {
      co_await bus_.clock.sleep_until(deadline);
      co_return error(errc::timed_out);
    }
    bus_.busy_until = sent;
    if (sent > bus_.clock.now()) co_await bus_.clock.sleep_until(sent);
    if (!inbox_.connected()) co_return error(errc::network_down);
    bus_.deliver(*this, frame);
    // Frames that take no time: whoever receives must have its turn before its inbox is full.
    if (bus_.crowded())
      co_await boost::asio::post(co_await boost::asio::this_coro::executor,
                                 boost::asio::use_awaitable);
    co_return hal::Result<void>{};
  }

  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    auto item = inbox_.take_now();  // A coroutine less for every frame of several.
    if (!item) item = co_await inbox_.take();
    if (!*item) co_return item->error();
    co_return hal::ReceivedFrame{(*item)->due, (*item)->message};
  }

  void cut() override {
    inbox_.cut();
    bus_.changed.notify();
  }
  void mend() override {
    inbox_.mend();
    bus_.changed.notify();
  }
  std::uint64_t lost_frames() const override { return lost_; }

  bool connected() const { return inbox_.connected(); }
  bool half_full() const { return 2 * inbox_.room() < bus_.config.inbox_frames; }
  void expect_overtaking(bool may) { inbox_.expect_overtaking(may); }
  void put(hal::Time due, const CanFrame& frame) {
    if (connected() && hal::passes(filters_, frame) && !inbox_.put(due, frame)) ++lost_;
  }
  void cut_behind_the_last_frame() { inbox_.cut(Inbox<CanFrame>::UnderWay::arrives); }

 private:
  Bus& bus_;
  const std::vector<hal::CanFilter> filters_;
  Inbox<CanFrame> inbox_;
  std::uint64_t lost_{};
};

bool CanWire::Bus::acknowledged(const Plug& from) const {
  return from.connected() && std::any_of(plugs.begin(), plugs.end(), [&](const Plug& plug) {
           return &plug != &from && plug.connected();
         });
}

bool CanWire::Bus::crowded() const {
  return std::any_of(plugs.begin(), plugs.end(), [](const Plug& plug) { return plug.half_full(); });
}

void CanWire::Bus::deliver(const Plug& from, CanFrame frame) {
  if (disturbance.pass(1) == 1 && !disturbance.loses()) {
    if (disturbance.corrupts()) disturbance.corrupt(std::span(frame.data).first(frame.size));
    for (int times = disturbance.doubles() ? 2 : 1; times > 0; --times) {
      const hal::Time due = disturbance.arrival(clock.now());
      for (Plug& plug : plugs)
        if (&plug != &from) plug.put(due, frame);
    }
  }
  if (!disturbance.cut_now()) return;
  for (Plug& plug : plugs) plug.cut_behind_the_last_frame();
  changed.notify();
}

CanWire::CanWire(hal::Clock& clock, Config config) : bus_(std::make_unique<Bus>(clock, config)) {}
CanWire::~CanWire() = default;

CanWire::End& CanWire::attach(std::vector<hal::CanFilter> filters) {
  auto& plug = bus_->plugs.emplace_back(*bus_, std::move(filters));
  plug.expect_overtaking(bus_->disturbance.faults().reordering > 0);
  return plug;
}

void CanWire::set_faults(const LinkFaults& faults) {
  bus_->disturbance.set(faults);
  for (auto& plug : bus_->plugs) plug.expect_overtaking(faults.reordering > 0);
}

void CanWire::cut() {
  for (auto& plug : bus_->plugs) plug.cut();
}

void CanWire::mend() {
  bus_->disturbance.mended();
  for (auto& plug : bus_->plugs) plug.mend();
}

}  // namespace sim
