// Recordings of real devices, where they are at hand, and the containers that they come in.
#pragma once

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/resync.hpp"
#include "drivers/text.hpp"

namespace drivers_test {

using drivers::Bytes;
using drivers::ByteView;

inline std::optional<std::string> recording(const std::string& name) {
  const std::filesystem::path path =
      std::filesystem::path(VANTAGE_SOURCE_DIR) / "../shared/data/recordings" / name;
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(file), {});
}

// Reads a recording into `text` or skips the test, saying so.
#define RECORDING_OR_SKIP(text, name)                               \
  const auto text##_recording = ::drivers_test::recording(name);    \
  if (!text##_recording) GTEST_SKIP() << "no recording " << (name); \
  const std::string& text = *text##_recording

inline Bytes bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}

// "02 7f" or "02:7F" or "027f"
inline Bytes from_hex(std::string_view text) {
  std::string digits;
  for (const char c : text)
    if (std::isxdigit(static_cast<unsigned char>(c))) digits += c;
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(drivers::hex_pair(digits.substr(i, 2))));
  return bytes;
}

inline Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// The payloads of a pcap of UDP over Ethernet and IPv4.
inline std::vector<Bytes> udp_payloads(std::string_view pcap) {
  const ByteView bytes = drivers::as_bytes(pcap);
  std::vector<Bytes> payloads;
  for (std::size_t at = 24; at + 16 <= bytes.size();) {
    const std::size_t size = drivers::little<std::uint32_t>(bytes, at + 8);
    const ByteView packet = bytes.subspan(at + 16, size);
    const std::size_t head = 14 + 4 * (packet[14] & 15U) + 8;
    payloads.emplace_back(packet.begin() + static_cast<std::ptrdiff_t>(head), packet.end());
    at += 16 + size;
  }
  return payloads;
}

// The TCP payloads of a pcapng that were sent from `port`.
inline std::vector<Bytes> tcp_payloads(std::string_view pcapng, std::uint16_t port) {
  const ByteView bytes = drivers::as_bytes(pcapng);
  std::vector<Bytes> payloads;
  for (std::size_t at = 0; at + 12 <= bytes.size();) {
    const std::size_t size = drivers::little<std::uint32_t>(bytes, at + 4);
    if (drivers::little<std::uint32_t>(bytes, at) == 6) {
      const ByteView packet =
          bytes.subspan(at + 28, drivers::little<std::uint32_t>(bytes, at + 20));
      const std::size_t ip_size = drivers::big<std::uint16_t>(packet, 16);
      const std::size_t tcp = 14 + 4 * (packet[14] & 15U);
      const std::size_t data = tcp + 4 * (packet[tcp + 12] >> 4);
      if (drivers::big<std::uint16_t>(packet, tcp) == port && 14 + ip_size > data)
        payloads.emplace_back(packet.begin() + static_cast<std::ptrdiff_t>(data),
                              packet.begin() + static_cast<std::ptrdiff_t>(14 + ip_size));
    }
    at += size;
  }
  return payloads;
}

std::string md5_hex(ByteView bytes);

// The same bytes each time, none of them a frame.
inline Bytes noise(std::size_t size) {
  std::mt19937 random(8);
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

template <class LookAt>
std::vector<Bytes> frames_in(ByteView stream, LookAt&& look, std::size_t frame_max,
                             std::size_t piece = SIZE_MAX) {
  drivers::Resync resync(frame_max);
  std::vector<Bytes> frames;
  for (std::size_t at = 0; at < stream.size(); at += std::min(piece, stream.size() - at)) {
    resync.feed(stream.subspan(at, std::min(piece, stream.size() - at)));
    while (const auto frame = resync.next(look)) frames.emplace_back(frame->begin(), frame->end());
  }
  return frames;
}

// What every stream codec promises: however the bytes arrive, cut anywhere, with any byte flipped
// and with garbage between, all undamaged frames come out and nothing else. Enough bytes follow to
// end any frame that the damage made look longer.
template <class LookAt>
void expect_whole_frames_survive(const std::vector<Bytes>& frames, LookAt&& look,
                                 std::size_t frame_max, const Bytes& garbage) {
  const auto got = [&](std::vector<Bytes> parts) {
    parts.push_back(noise(frame_max));
    return frames_in(joined(parts), look, frame_max);
  };
  for (const std::size_t piece : {1U, 3U, 64U})
    EXPECT_EQ(frames_in(joined(frames), look, frame_max, piece), frames) << piece;
  for (std::size_t f = 0; f + 1 < frames.size(); ++f) {
    std::vector<Bytes> rest = frames;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(f));
    // A text is whole without its line end.
    const std::size_t least = frames[f].back() == '\n' ? frames[f].size() - 2 : frames[f].size();
    for (std::size_t at = 0; at < least; ++at) {
      std::vector<Bytes> cut = frames;
      cut[f].resize(at);
      EXPECT_EQ(got(cut), rest) << "frame " << f << " cut at " << at;
    }
    std::vector<Bytes> dirty = frames;
    dirty.insert(dirty.begin() + static_cast<std::ptrdiff_t>(f), garbage);
    EXPECT_EQ(got(dirty), frames) << "garbage before frame " << f;
  }
}

// The same for bytes flipped one at a time; for frames with a checksum that sees every flip.
template <class LookAt>
void expect_flips_cost_one_frame(const std::vector<Bytes>& frames, LookAt&& look,
                                 std::size_t frame_max) {
  for (std::size_t f = 0; f < frames.size(); ++f) {
    std::vector<Bytes> rest = frames;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(f));
    for (std::size_t at = 0; at < frames[f].size(); ++at) {
      std::vector<Bytes> flipped = frames;
      flipped[f][at] ^= static_cast<std::uint8_t>(1U << (at % 7));
      flipped.push_back(noise(frame_max));
      EXPECT_EQ(frames_in(joined(flipped), look, frame_max), rest)
          << "frame " << f << " flipped at " << at;
    }
  }
}

}  // namespace drivers_test
