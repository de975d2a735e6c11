#include "drivers/canopen_sdo.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <random>

#include "tests/drivers/can_frames.hpp"

namespace drivers::canopen {
namespace {

using drivers_test::can;
using std::chrono::milliseconds;

constexpr hal::Time at_ms(int ms) {
  return hal::Time(milliseconds(ms));
}

Bytes pattern(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 + 7);
  return bytes;
}

// A node that remembers what is written.
class Node {
 public:
  explicit Node(std::uint8_t id)
      : server_(
            id,
            [this](Address at) -> std::variant<Bytes, std::uint32_t> {
              const auto found = values_.find({at.index, at.sub});
              if (found == values_.end()) return std::uint32_t{0x06020000};
              return found->second;
            },
            [this](Address at, ByteView data) -> std::uint32_t {
              if (at.index == 0x1000) return 0x06010002;
              values_[{at.index, at.sub}] = Bytes(data.begin(), data.end());
              return 0;
            }) {}

  std::optional<hal::CanFrame> step(const hal::CanFrame& frame) { return server_.step(frame); }
  Bytes& value(Address at) { return values_[{at.index, at.sub}]; }

 private:
  std::map<std::pair<std::uint16_t, std::uint8_t>, Bytes> values_;
  SdoServer server_;
};

// Runs a transfer over a link that does `damage` to what passes (it may drop, double or keep).
// Returns the simulated milliseconds it took.
template <class Damage>
int run(SdoClient& client, Node& node, Damage damage) {
  std::deque<hal::CanFrame> to_node, to_client;
  const auto send = [&](std::deque<hal::CanFrame>& queue, const hal::CanFrame& frame) {
    for (int copies = damage(); copies > 0; --copies) queue.push_back(frame);
  };
  if (const auto first = client.step(nullptr, at_ms(0))) send(to_node, *first);
  int ms = 0;
  for (; ms < 600000 && !client.done(); ++ms) {
    if (!to_node.empty()) {
      const auto reply = node.step(to_node.front());
      to_node.pop_front();
      if (reply) send(to_client, *reply);
    }
    std::optional<hal::CanFrame> next;
    if (!to_client.empty()) {
      next = client.step(&to_client.front(), at_ms(ms));
      to_client.pop_front();
    } else {
      next = client.step(nullptr, at_ms(ms));
    }
    if (next) send(to_node, *next);
  }
  return ms;
}

int unharmed() {
  return 1;
}

TEST(Sdo, WritesAndReadsBackEverySize) {
  for (std::size_t size = 1; size < 80; ++size) {
    Node node(5);
    auto write = SdoClient::write(5, {0x2000, 1}, pattern(size));
    run(write, node, unharmed);
    ASSERT_TRUE(write.done() && !write.failure()) << size;
    EXPECT_EQ(node.value({0x2000, 1}), pattern(size));
    auto read = SdoClient::read(5, {0x2000, 1});
    run(read, node, unharmed);
    ASSERT_TRUE(read.done() && !read.failure()) << size;
    EXPECT_EQ(read.data(), pattern(size));
  }
}

TEST(Sdo, MovesTheLargestValue) {
  Node node(1);
  node.value({0x1F50, 1}) = pattern(SdoClient::kBytesMax);
  auto read = SdoClient::read(1, {0x1F50, 1});
  run(read, node, unharmed);
  ASSERT_TRUE(read.done() && !read.failure());
  EXPECT_EQ(read.data(), pattern(SdoClient::kBytesMax));
}

TEST(Sdo, SpeaksLikeTheTracesOfRealDrives) {
  auto write = SdoClient::write(2, {0x1017, 0}, {0xE8, 0x03});
  EXPECT_EQ(write.step(nullptr, at_ms(0)), can("602#2B171000E8030000"));
  const auto done = can("582#6017100000000000");
  EXPECT_EQ(write.step(&done, at_ms(9)), std::nullopt);
  EXPECT_TRUE(write.done() && !write.failure());
  auto read = SdoClient::read(2, {0x1018, 1});
  EXPECT_EQ(read.step(nullptr, at_ms(0)), can("602#4018100100000000"));
  const auto reply = can("582#4318100160030000");
  EXPECT_EQ(read.step(&reply, at_ms(9)), std::nullopt);
  EXPECT_EQ(read.data(), (Bytes{0x60, 3, 0, 0}));
}

TEST(Sdo, SegmentsAlternateTheToggle) {
  Node node(5);
  node.value({0x1008, 0}) = pattern(10);
  auto read = SdoClient::read(5, {0x1008, 0});
  const char* const exchange[][2] = {{"605#4008100000000000", "585#410810000A000000"},
                                     {"605#6000000000000000", "585#0007264564 83A2C1"},
                                     {"605#7000000000000000", "585#19E0FF1E00000000"}};
  auto request = read.step(nullptr, at_ms(0));
  for (const auto& [asked, answered] : exchange) {
    std::string compact = answered;
    std::erase(compact, ' ');
    ASSERT_EQ(request, can(asked));
    const auto reply = node.step(*request);
    ASSERT_EQ(reply, can(compact));
    request = read.step(&*reply, at_ms(1));
  }
  EXPECT_EQ(request, std::nullopt);
  EXPECT_EQ(read.data(), pattern(10));
}

TEST(Sdo, TellsWhyTheNodeRefused) {
  Node node(5);
  auto read = SdoClient::read(5, {0x1234, 0});
  run(read, node, unharmed);
  ASSERT_TRUE(read.failure());
  EXPECT_EQ(read.failure()->abort_code, 0x06020000U);
  EXPECT_TRUE(read.failure()->by_node);
  for (const std::size_t size : {4U, 40U}) {
    auto write = SdoClient::write(5, {0x1000, 0}, pattern(size));
    run(write, node, unharmed);
    ASSERT_TRUE(write.failure());
    EXPECT_EQ(write.failure()->abort_code, 0x06010002U);
  }
}

TEST(Sdo, AsksAgainAndThenGivesUpWithAnAbort) {
  auto read = SdoClient::read(5, {0x6041, 0}, {milliseconds(100), 2});
  const auto request = can("605#4041600000000000");
  EXPECT_EQ(read.step(nullptr, at_ms(0)), request);
  EXPECT_EQ(read.step(nullptr, at_ms(99)), std::nullopt);
  EXPECT_EQ(read.wake_up(), at_ms(100));
  EXPECT_EQ(read.step(nullptr, at_ms(100)), request);
  EXPECT_EQ(read.step(nullptr, at_ms(200)), request);
  EXPECT_EQ(read.step(nullptr, at_ms(299)), std::nullopt);
  EXPECT_EQ(read.step(nullptr, at_ms(300)), can("605#8041600000000405"));
  ASSERT_TRUE(read.failure());
  EXPECT_EQ(read.failure()->abort_code, 0x05040000U);
  EXPECT_FALSE(read.failure()->by_node);
  const auto late = can("585#4B41600037070000");
  EXPECT_EQ(read.step(&late, at_ms(301)), std::nullopt);
}

TEST(Sdo, IgnoresRepliesToOthers) {
  auto read = SdoClient::read(5, {0x6041, 0});
  read.step(nullptr, at_ms(0));
  for (const char* other :
       {"585#4B40600006000000", "584#4B41600037070000", "585#6041600000000000",
        "585#8041600100000206", "605#4041600000000000", "705#05", "585#A041600000000000"}) {
    const auto frame = can(other);
    EXPECT_EQ(read.step(&frame, at_ms(1)), std::nullopt) << other;
    EXPECT_FALSE(read.done()) << other;
  }
  const auto reply = can("585#4B41600037070000");
  read.step(&reply, at_ms(2));
  EXPECT_EQ(read.data(), (Bytes{0x37, 0x07}));
}

TEST(Sdo, RefusesValuesThatAreNotAsLongAsAnnounced) {
  for (const char* last : {"585#0B41424344450000", "585#0141424344454647"}) {
    auto read = SdoClient::read(5, {0x1008, 0});
    read.step(nullptr, at_ms(0));
    const auto begin = can("585#4108100006000000"), segment = can(last);
    read.step(&begin, at_ms(1));
    const auto abort = read.step(&segment, at_ms(2));
    EXPECT_EQ(abort, can("605#8008100010000706")) << last;
  }
  auto read = SdoClient::read(5, {0x1008, 0});
  read.step(nullptr, at_ms(0));
  const auto begin = can("585#41081000FFFFFFFF");
  EXPECT_EQ(read.step(&begin, at_ms(1)), can("605#8008100005000405"));
}

TEST(Sdo, AWrongToggleAbortsButADoubledSegmentDoesNot) {
  const auto begin = can("585#4108100010000000"), first = can("585#0041424344454647"),
             wrong = can("585#0048494A4B4C4D4E");
  auto read = SdoClient::read(5, {0x1008, 0});
  read.step(nullptr, at_ms(0));
  read.step(&begin, at_ms(1));
  read.step(&first, at_ms(2));
  EXPECT_EQ(read.step(&first, at_ms(3)), std::nullopt);
  EXPECT_FALSE(read.done());
  EXPECT_EQ(read.step(&wrong, at_ms(4)), can("605#8008100000000305"));
  EXPECT_TRUE(read.failure());
}

TEST(Sdo, ServerRefusesBlockTransfersAndStraySegments) {
  Node node(5);
  EXPECT_EQ(node.step(can("605#A008100005000000")), can("585#8008100001000405"));
  EXPECT_EQ(node.step(can("604#A008100005000000")), std::nullopt);
  EXPECT_EQ(node.step(can("605#6000000000000000")), can("585#8008100001000405"));
}

// On a link that loses and doubles frames a transfer ends with the right bytes or a failure, never
// with wrong bytes, and always in bounded time.
TEST(Sdo, NeverDeliversWrongBytesOverALossyLink) {
  std::mt19937 random(7);
  int good = 0, failed = 0;
  for (int i = 0; i < 2000; ++i) {
    Node node(9);
    const Bytes value = pattern(1 + random() % 40);
    const bool writes = i % 2 == 0;
    const auto bad_percent = random() % 20;
    const auto damage = [&] {
      if (random() % 100 >= bad_percent) return 1;
      return random() % 2 == 0 ? 0 : 2;
    };
    auto client =
        writes ? SdoClient::write(9, {0x2000, 0}, value) : SdoClient::read(9, {0x2000, 0});
    if (!writes) node.value({0x2000, 0}) = value;
    const int ms = run(client, node, damage);
    ASSERT_TRUE(client.done()) << i;
    EXPECT_LT(ms, 5000);
    if (client.failure()) {
      ++failed;
      continue;
    }
    ++good;
    EXPECT_EQ(writes ? node.value({0x2000, 0}) : client.data(), value) << i;
  }
  EXPECT_GT(good, 500);
  EXPECT_GT(failed, 50);
}

}  // namespace
}  // namespace drivers::canopen
