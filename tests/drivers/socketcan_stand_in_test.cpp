// A CAN interface of the kernel passes a hundred thousand frames a minute: once it runs it
// allocates nothing for them. The class that ships, on sockets of this machine that stand in for
// the kernel's CAN and its news.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <malloc.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstring>
#include <functional>
#include <optional>

#include "drivers/real_clock.hpp"
#include "drivers/socketcan.hpp"
#include "tests/drivers/allocations.hpp"

namespace {

using namespace std::chrono_literals;

constexpr int kCycles = 1000, kFrames = 10;
constexpr std::uint8_t kEcho = 1;  // In a byte that frames of 8 do not use: it was ours.

// Two ends of what a program takes for a socket of the kernel.
struct Pair {
  int program = -1, test = -1;
  void open() {
    std::array<int, 2> ends{-1, -1};
    const int made = socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data());
    program = made == 0 ? ends[0] : -1;
    test = ends[1];
  }
};

// While it lives this thread's CAN and netlink sockets are its own.
class StandInKernel {
 public:
  StandInKernel() {
    can_.open();
    news_.open();
    current = this;
  }
  ~StandInKernel() {
    current = nullptr;
    close(can_.test);
    close(news_.test);
  }
  StandInKernel(const StandInKernel&) = delete;
  StandInKernel& operator=(const StandInKernel&) = delete;

  static thread_local StandInKernel* current;

  // -1: another's.
  int socket_of(int domain) const {
    return domain == PF_CAN ? can_.program : domain == AF_NETLINK ? news_.program : -1;
  }
  bool owns(int handle) const { return handle == can_.program || handle == news_.program; }
  bool is_can(int handle) const { return handle == can_.program; }

  void say_up(const char* name) const {
    struct {
      nlmsghdr head;
      ifinfomsg info;
      rtattr name_head;
      std::array<char, 8> name;
    } news{};
    news.head = {sizeof news, RTM_NEWLINK, 0, 0, 0};
    news.info.ifi_index = 7;
    news.info.ifi_flags = IFF_UP | IFF_RUNNING;
    news.name_head = {static_cast<unsigned short>(sizeof(rtattr) + news.name.size()), IFLA_IFNAME};
    std::strncpy(news.name.data(), name, news.name.size() - 1);
    ASSERT_EQ(write(news_.test, &news, sizeof news), static_cast<ssize_t>(sizeof news));
  }
  void bring(canid_t id) const {
    can_frame frame{};
    frame.can_id = id;
    frame.len = 8;
    ASSERT_EQ(write(can_.test, &frame, sizeof frame), static_cast<ssize_t>(sizeof frame));
  }
  // What was sent comes back as the kernel's confirmation; returns how many there were.
  int confirm() const {
    int count = 0;
    for (can_frame frame{}; read(can_.test, &frame, sizeof frame) == sizeof frame; ++count) {
      frame.__res0 = kEcho;
      if (write(can_.test, &frame, sizeof frame) != sizeof frame) return -1;
    }
    return count;
  }

 private:
  Pair can_, news_;
};
thread_local StandInKernel* StandInKernel::current = nullptr;

StandInKernel* owner_of(int handle) {
  StandInKernel* const kernel = StandInKernel::current;
  return kernel != nullptr && kernel->owns(handle) ? kernel : nullptr;
}

thread_local std::uint64_t aligned = 0;

}  // namespace

// What Asio takes for its coroutines and handlers; operator new does not see it.
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++aligned;
  return memalign(alignment, size);
}
extern "C" int socket(int domain, int type, int protocol) noexcept {
  const StandInKernel* const kernel = StandInKernel::current;
  const int own = kernel != nullptr ? kernel->socket_of(domain) : -1;
  return own >= 0 ? own : static_cast<int>(syscall(SYS_socket, domain, type, protocol));
}
extern "C" int bind(int handle, const sockaddr* address, socklen_t size) noexcept {
  return owner_of(handle) != nullptr ? 0
                                     : static_cast<int>(syscall(SYS_bind, handle, address, size));
}
extern "C" int setsockopt(int handle, int level, int name, const void* value,
                          socklen_t size) noexcept {
  if (owner_of(handle) != nullptr && level == SOL_CAN_RAW) return 0;
  return static_cast<int>(syscall(SYS_setsockopt, handle, level, name, value, size));
}
extern "C" ssize_t recvmsg(int handle, msghdr* message, int flags) {
  const ssize_t size = syscall(SYS_recvmsg, handle, message, flags);
  const StandInKernel* const kernel = owner_of(handle);
  if (kernel == nullptr || !kernel->is_can(handle) || size != sizeof(can_frame)) return size;
  if (static_cast<const can_frame*>(message->msg_iov->iov_base)->__res0 == kEcho)
    message->msg_flags |= MSG_CONFIRM;
  return size;
}

namespace {

struct Passed {
  int received = 0, sent = 0, failed = 0;
};

hal::Task<void> receive_all(drivers::SocketCan& bus, Passed& passed) {
  for (;;) {
    const auto frame = co_await bus.receive();
    ++(frame ? passed.received : passed.failed);
  }
}
hal::Task<void> send_all(drivers::SocketCan& bus, hal::Clock& clock, Passed& passed,
                         const bool& go_on) {
  hal::CanFrame frame;
  frame.id = 0x111;
  frame.size = 8;
  while (go_on) {
    const auto sent = co_await bus.send(frame, clock.now() + 1s);
    ++(sent ? passed.sent : passed.failed);
  }
}
// How a coroutine of a test ends: by cancellation, or by a mistake.
void ended_by(std::exception_ptr error) {
  if (!error) return;
  try {
    std::rethrow_exception(error);
  } catch (const boost::system::system_error& end) {
    if (end.code() != boost::asio::error::operation_aborted) throw;
  }
}

struct SocketCanOnAStandIn : testing::Test {
  SocketCanOnAStandIn() {
    io.poll();
    kernel.say_up("can7");
    until([&] { return bus.troubles().empty(); });
  }
  void until(const std::function<bool()>& holds) {
    const hal::Time late = clock.now() + 10s;
    while (!holds() && clock.now() < late) {
      io.restart();
      io.run_one_for(1ms);
    }
    ASSERT_TRUE(holds());
  }
  // Sends one that nobody confirms: when it failed, after the beginning, and why.
  hal::Task<void> send_in_vain(hal::Duration patience, std::optional<hal::Duration>& took) {
    const hal::Time began = clock.now();
    const auto sent = co_await bus.send({.id = 0x111}, began + patience);
    EXPECT_TRUE(!sent && sent.error() == boost::system::errc::timed_out);
    took = clock.now() - began;
  }

  StandInKernel kernel;
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  drivers::SocketCan bus{{"can7"}, io.get_executor(), clock};
};

// Each by its own deadline, whichever of them began to wait first.
TEST_F(SocketCanOnAStandIn, WhatNobodyConfirmsFailsAtItsDeadline) {
  std::optional<hal::Duration> late, early, middle;
  boost::asio::co_spawn(io, send_in_vain(300ms, late), ended_by);
  boost::asio::co_spawn(io, send_in_vain(100ms, early), ended_by);
  boost::asio::co_spawn(io, send_in_vain(200ms, middle), ended_by);
  until([&] { return late && early && middle; });
  EXPECT_GE(*early, 100ms);
  EXPECT_LT(*early, 190ms);
  EXPECT_GE(*middle, 200ms);
  EXPECT_LT(*middle, 290ms);
  EXPECT_GE(*late, 300ms);
  EXPECT_LT(*late, 1s);
}

// Within one turn of the event loop, as in a program that runs: between turns Asio gives back what
// it keeps for the next handler.
hal::Task<void> pass(const StandInKernel& kernel, Passed& passed, int cycles) {
  for (int i = 0; i < cycles; ++i) {
    const int received = passed.received + kFrames, sent = passed.sent + 1;
    for (canid_t id = 0x200; id < 0x200 + kFrames; ++id) kernel.bring(id);
    while (passed.received < received || passed.sent < sent) {
      kernel.confirm();
      co_await boost::asio::post(boost::asio::use_awaitable);
    }
  }
}

TEST_F(SocketCanOnAStandIn, AThousandCyclesOfElevenFramesAllocateNothing) {
  Passed passed;
  bool go_on = true;
  boost::asio::co_spawn(io, receive_all(bus, passed), ended_by);
  boost::asio::co_spawn(io, send_all(bus, clock, passed, go_on), ended_by);
  std::uint64_t counted = 0, by_asio = 0;
  const auto count = [&]() -> hal::Task<void> {
    co_await pass(kernel, passed, 100);
    counted = drivers_test::allocations();
    by_asio = aligned;
    co_await pass(kernel, passed, kCycles);
    counted = drivers_test::allocations() - counted;
    by_asio = aligned - by_asio;
    go_on = false;
    io.stop();
  };
  boost::asio::co_spawn(io, count(), ended_by);
  io.restart();
  io.run();
  EXPECT_EQ(counted, 0U);
  EXPECT_EQ(by_asio, 0U);
  EXPECT_EQ(passed.received, (100 + kCycles) * kFrames);
  EXPECT_GE(passed.sent, 100 + kCycles);
  EXPECT_EQ(passed.failed, 0);
}

}  // namespace
