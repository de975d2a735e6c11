#include <vector>

#include "sim/inbox.hpp"
#include "sim/links.hpp"
#include "sim/wire.hpp"

namespace sim {

namespace errc = boost::system::errc;
using Bytes = std::vector<std::uint8_t>;

struct DatagramWire::Net final : DatagramSender, hal::Datagrams {
  Net(hal::Clock& its_clock, const Config& config)
      : clock(its_clock),
        disturbance(config.seed),
        inbox(clock, config.inbox_datagrams, error(errc::network_down)) {}

  hal::Task<void> send(std::span<const std::uint8_t> datagram) override {
    if (!connected) co_return;
    if (disturbance.pass(1) == 1 && !disturbance.loses())
      for (int times = disturbance.doubles() ? 2 : 1; times > 0; --times) put(datagram);
    if (disturbance.cut_now()) connected = false;
  }

  hal::Task<hal::Result<Received>> receive(std::span<std::uint8_t> into) override {
    const auto item = co_await inbox.take();
    if (!item) co_return item.error();
    if (item->message.size() > into.size()) co_return error(errc::message_size);
    std::copy(item->message.begin(), item->message.end(), into.begin());
    co_return Received{item->due, item->message.size()};
  }

  void put(std::span<const std::uint8_t> datagram) {
    Bytes bytes(datagram.begin(), datagram.end());
    if (disturbance.corrupts()) disturbance.corrupt(bytes);
    if (!inbox.put(disturbance.arrival(clock.now()), std::move(bytes))) ++lost;
  }

  hal::Clock& clock;
  Disturbance disturbance;
  Inbox<Bytes> inbox;
  std::uint64_t lost{};
  bool connected = true;
};

DatagramWire::DatagramWire(hal::Clock& clock, Config config)
    : net_(std::make_unique<Net>(clock, config)) {}
DatagramWire::~DatagramWire() = default;

DatagramSender& DatagramWire::sender() {
  return *net_;
}
hal::Datagrams& DatagramWire::receiver() {
  return *net_;
}
std::uint64_t DatagramWire::lost_datagrams() const {
  return net_->lost;
}
void DatagramWire::set_faults(const LinkFaults& faults) {
  net_->disturbance.set(faults);
  net_->inbox.expect_overtaking(faults.reordering > 0);
}
void DatagramWire::cut() {
  net_->connected = false;
}
void DatagramWire::mend() {
  net_->disturbance.mended();
  net_->connected = true;
}

}  // namespace sim
