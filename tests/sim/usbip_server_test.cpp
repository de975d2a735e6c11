// The simulated gs_usb adapter as the kernel's vhci_hcd sees it: USB/IP on a stream.
#include "sim/usbip_server.hpp"

#include <gtest/gtest.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include "sim/links.hpp"
#include "sim/sim_clock.hpp"

namespace {

using namespace std::chrono_literals;
using drivers::Bytes;

struct Request {
  std::uint32_t sequence{}, direction{}, endpoint{}, length{};
  std::array<std::uint8_t, 8> setup{};
  Bytes out{};
};

class Usbip : public testing::Test {
 protected:
  Usbip() {
    boost::asio::co_spawn(io_, server_.run(), [this](std::exception_ptr error) {
      ended_ = true;
      if (error) std::rethrow_exception(error);
    });
  }

  static void big(Bytes& bytes, std::uint32_t value) {
    for (const int shift : {24, 16, 8, 0})
      bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
  void send(const Bytes& bytes) {
    boost::asio::co_spawn(io_, wire_.a().write(bytes), [](std::exception_ptr, const auto&) {});
    clock_.run_until(clock_.now() + 10ms);
  }
  void submit(const Request& request) {
    Bytes bytes;
    for (const std::uint32_t each : {1U, request.sequence, 65538U, request.direction,
                                     request.endpoint, 0U, request.length, 0U, 0U, 0U})
      big(bytes, each);
    bytes.insert(bytes.end(), request.setup.begin(), request.setup.end());
    bytes.insert(bytes.end(), request.out.begin(), request.out.end());
    send(bytes);
  }
  // Everything that has come since.
  Bytes answers() {
    Bytes bytes(4096);
    std::size_t size = 0;
    boost::asio::co_spawn(io_, wire_.a().read_some(bytes),
                          boost::asio::bind_cancellation_slot(
                              stop_.slot(), [&](std::exception_ptr error, const auto& got) {
                                if (!error && got) size = *got;
                              }));
    clock_.run_until(clock_.now() + 10ms);
    stop_.emit(boost::asio::cancellation_type::terminal);
    clock_.run_until(clock_.now() + 1ms);
    bytes.resize(size);
    return bytes;
  }
  static std::int32_t number(const Bytes& bytes, std::size_t at) {
    return static_cast<std::int32_t>(std::uint32_t{bytes.at(at)} << 24 |
                                     std::uint32_t{bytes.at(at + 1)} << 16 |
                                     std::uint32_t{bytes.at(at + 2)} << 8 | bytes.at(at + 3));
  }

  boost::asio::io_context io_{1};
  sim::SimClock clock_{io_};
  boost::asio::cancellation_signal stop_;
  sim::StreamWire wire_{clock_};
  sim::GsUsbUnit unit_;
  sim::UsbipServer server_{unit_, wire_.b()};
  bool ended_ = false;
};

constexpr std::array<std::uint8_t, 8> kDeviceDescriptor{0x80, 6, 0, 1, 0, 0, 18, 0};

TEST_F(Usbip, DescribesItself) {
  submit({.sequence = 1, .direction = 1, .endpoint = 0, .length = 18, .setup = kDeviceDescriptor});
  const Bytes answer = answers();
  ASSERT_EQ(answer.size(), 48U + 18U);
  EXPECT_EQ(number(answer, 0), 3);
  EXPECT_EQ(number(answer, 4), 1);
  EXPECT_EQ(number(answer, 20), 0) << "status";
  EXPECT_EQ(number(answer, 24), 18);
  EXPECT_EQ(Bytes(answer.begin() + 48 + 8, answer.begin() + 48 + 12),
            (Bytes{0x50, 0x1D, 0x6F, 0x60}));
}

TEST_F(Usbip, CutsAnswersToWhatWasAsked) {
  submit({.sequence = 1,
          .direction = 1,
          .endpoint = 0,
          .length = 8,
          .setup = {0x80, 6, 0, 1, 0, 0, 8, 0}});
  EXPECT_EQ(answers().size(), 48U + 8U);
}

TEST_F(Usbip, StallsWhatTheAdapterDoesNotKnow) {
  submit({.sequence = 2,
          .direction = 1,
          .endpoint = 0,
          .length = 4,
          .setup = {0xC1, 99, 0, 0, 0, 0, 4, 0}});
  const Bytes answer = answers();
  ASSERT_EQ(answer.size(), 48U);
  EXPECT_EQ(number(answer, 20), -32);
}

TEST_F(Usbip, AReadWaitsForAFrame) {
  submit({.sequence = 5, .direction = 1, .endpoint = 1, .length = 64});
  EXPECT_TRUE(answers().empty());
  unit_.hear(1, {0x123, 2}, false);
  const Bytes answer = answers();
  ASSERT_EQ(answer.size(), 48U + drivers::gs_usb::kFrameSize);
  EXPECT_EQ(number(answer, 4), 5);
  EXPECT_EQ(number(answer, 24), static_cast<int>(drivers::gs_usb::kFrameSize));
}

TEST_F(Usbip, AReadThatIsTakenBackIsAnsweredOnceOnly) {
  submit({.sequence = 5, .direction = 1, .endpoint = 1, .length = 64});
  Bytes unlink;
  for (const std::uint32_t each : {2U, 6U, 65538U, 0U, 0U, 5U}) big(unlink, each);
  unlink.resize(48);
  send(unlink);
  const Bytes answer = answers();
  ASSERT_EQ(answer.size(), 48U);
  EXPECT_EQ(number(answer, 0), 4);
  EXPECT_EQ(number(answer, 20), -104);
  unit_.hear(1, {0x123, 2}, false);
  EXPECT_TRUE(answers().empty());
}

TEST_F(Usbip, IsUnpluggedByWhatIsNoRequest) {
  send(Bytes(48, 0xEE));
  EXPECT_TRUE(ended_);
}

TEST_F(Usbip, RefusesTransfersWithoutEnd) {
  submit({.sequence = 1, .direction = 0, .endpoint = 2, .length = 0x7FFFFFFF});
  EXPECT_TRUE(ended_);
}

}  // namespace
