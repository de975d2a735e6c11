#include "drivers/resync.hpp"

#include <gtest/gtest.h>

#include <random>

namespace drivers {
namespace {

// '#', a length n, n bytes, and their sum.
Look look(ByteView front) {
  if (front[0] != '#') return Look::none("no start");
  if (front.size() < 2) return Look::more();
  const std::size_t size = 3U + front[1];
  if (front.size() < size) return Look::more();
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i + 1 < size; ++i) sum = static_cast<std::uint8_t>(sum + front[i]);
  return sum == front[size - 1] ? Look::frame(size) : Look::none("checksum");
}

Bytes frame(const Bytes& payload) {
  Bytes bytes{'#', static_cast<std::uint8_t>(payload.size())};
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  std::uint8_t sum = 0;
  for (const auto byte : bytes) sum = static_cast<std::uint8_t>(sum + byte);
  bytes.push_back(sum);
  return bytes;
}

std::vector<Bytes> drain(Resync& resync) {
  std::vector<Bytes> frames;
  while (const auto view = resync.next(look)) frames.emplace_back(view->begin(), view->end());
  return frames;
}

TEST(Resync, FindsFramesHoweverTheBytesArrive) {
  std::mt19937 random(1);
  std::vector<Bytes> sent;
  Bytes stream;
  for (int i = 0; i < 200; ++i) {
    Bytes payload(random() % 40);
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
    sent.push_back(frame(payload));
    stream.insert(stream.end(), sent.back().begin(), sent.back().end());
  }
  for (const std::size_t piece : {1U, 2U, 7U, 100U, 100000U}) {
    Resync resync(300);
    std::vector<Bytes> got;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      resync.feed(ByteView(stream).subspan(at, std::min(piece, stream.size() - at)));
      for (Bytes& bytes : drain(resync)) got.push_back(std::move(bytes));
    }
    EXPECT_EQ(got, sent) << piece;
    EXPECT_TRUE(resync.skipped().empty());
  }
}

TEST(Resync, LosesOnlyTheDamagedFrameAndCountsWhatItPassedOver) {
  const Bytes good = frame({1, 2, 3}), last = frame({4});
  Bytes damaged = frame({7, 8, 9});
  damaged[3] ^= 0x10;
  Bytes stream{'x', 'y'};
  for (const Bytes& part : {good, damaged, last})
    stream.insert(stream.end(), part.begin(), part.end());
  Resync resync(300);
  resync.feed(stream);
  EXPECT_EQ(drain(resync), (std::vector<Bytes>{good, last}));
  EXPECT_EQ(resync.skipped().at("checksum").times, 1U);
  EXPECT_EQ(resync.skipped().at("no start").times, 2U);
  EXPECT_EQ(resync.skipped().at("no start").bytes + resync.skipped().at("checksum").bytes,
            2 + damaged.size());
}

TEST(Resync, HoldsNoMoreThanTheLongestFrame) {
  Resync resync(16);
  for (int i = 0; i < 1000; ++i) {
    const std::uint8_t endless[] = {'#', 200, '#', 200};
    resync.feed(endless);
    EXPECT_TRUE(drain(resync).empty());
    EXPECT_LE(resync.waiting(), 16U);
  }
}

TEST(Bytes, ReadWhatTheyWroteAtBothEnds) {
  Bytes bytes;
  append_little<std::int16_t>(bytes, -2);
  append_big<std::uint32_t>(bytes, 0x01020304);
  append_big<float>(bytes, 1.5F);
  EXPECT_EQ(bytes, (Bytes{0xFE, 0xFF, 1, 2, 3, 4, 0x3F, 0xC0, 0, 0}));
  EXPECT_EQ(little<std::int16_t>(bytes, 0), -2);
  EXPECT_EQ(big<std::uint32_t>(bytes, 2), 0x01020304U);
  EXPECT_EQ(little<std::uint32_t>(bytes, 2), 0x04030201U);
  EXPECT_EQ(big<float>(bytes, 6), 1.5F);
}

}  // namespace
}  // namespace drivers
