// The links in memory keep the promises.
#include "sim/links.hpp"
#include "tests/links/promises/can_promises.hpp"
#include "tests/links/promises/datagram_promises.hpp"
#include "tests/links/promises/register_promises.hpp"
#include "tests/links/promises/stream_promises.hpp"
#include "tests/links/promises_test.hpp"

namespace links_test {
namespace {

class CanTwin final : public CanRig {
 public:
  explicit CanTwin(double bit_rate_bps) : wire_(loop_.clock(), {bit_rate_bps}) {}
  Loop& loop() override { return loop_; }
  hal::CanBus& a() override { return a_; }
  hal::CanBus& b() override { return b_; }
  bool cut() override {
    wire_.cut();
    return true;
  }
  void mend() override { wire_.mend(); }
  bool silence(bool on) override {
    on ? b_.cut() : b_.mend();
    return true;
  }

 private:
  SimLoop loop_;
  sim::CanWire wire_;
  sim::CanWire::End& a_ = wire_.attach();
  sim::CanWire::End& b_ = wire_.attach();
};

class StreamTwin final : public StreamRig {
 public:
  explicit StreamTwin(sim::StreamWire::Config config, sim::LinkFaults faults = {})
      : wire_(loop_.clock(), config) {
    wire_.set_faults(faults);
  }
  Loop& loop() override { return loop_; }
  hal::ByteStream& a() override { return wire_.a(); }
  hal::ByteStream& b() override { return wire_.b(); }
  bool cut() override {
    wire_.cut();
    return true;
  }
  void mend() override { wire_.mend(); }

 private:
  SimLoop loop_;
  sim::StreamWire wire_;
};

class DatagramTwin final : public DatagramRig {
 public:
  Loop& loop() override { return loop_; }
  hal::Datagrams& port() override { return wire_.receiver(); }
  hal::Task<void> send(std::span<const std::uint8_t> datagram) override {
    return wire_.sender().send(datagram);
  }
  std::uint64_t lost() const override { return wire_.lost_datagrams(); }

 private:
  SimLoop loop_;
  sim::DatagramWire wire_{loop_.clock()};
};

class RegisterTwin final : public RegisterRig {
 public:
  Loop& loop() override { return loop_; }
  hal::Registers& client() override { return wire_.client(); }
  bool silence(bool on) override {
    unit_.faults()->set({on ? sim::UnitFault::off : sim::UnitFault::none, 0});
    return true;
  }
  bool cut() override {
    wire_.cut();
    return true;
  }
  void mend() override { wire_.mend(); }

 private:
  SimLoop loop_;
  TableUnit unit_{loop_.clock()};
  sim::RegisterWire wire_{loop_.clock(), unit_};
};

const bool kTwinsHeld =
    hold<CanRig>("CanTwin", can_promises(), [] { return std::make_unique<CanTwin>(0); }) &&
    hold<CanRig>("CanTwin500k", can_promises(),
                 [] { return std::make_unique<CanTwin>(500'000); }) &&
    hold<StreamRig>("StreamTwin", stream_promises(),
                    [] { return std::make_unique<StreamTwin>(sim::StreamWire::Config{}); }) &&
    hold<StreamRig>("StreamTwinLikeASerialLine", stream_promises(),
                    [] {
                      return std::make_unique<StreamTwin>(
                          sim::StreamWire::Config{11520, 4096, 1},
                          sim::LinkFaults{.jitter = 2ms, .chunk_max = 17});
                    }) &&
    hold<DatagramRig>("DatagramTwin", datagram_promises(),
                      [] { return std::make_unique<DatagramTwin>(); }) &&
    hold<RegisterRig>("RegisterTwin", register_promises(),
                      [] { return std::make_unique<RegisterTwin>(); });

}  // namespace
}  // namespace links_test
