// What every codec of a stream promises of any bytes: however they arrive, the same frames; and
// every byte is in a frame, counted as skipped, or waiting.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers_fuzz {

inline void require(bool holds) {
  if (!holds) std::abort();
}

struct Cut {
  std::vector<drivers::Bytes> frames;
  std::size_t skipped{}, waiting{};
};

template <class LookAt>
Cut cut(drivers::ByteView bytes, LookAt&& look, std::size_t frame_max, std::size_t piece) {
  drivers::Resync resync(frame_max);
  Cut result;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    resync.feed(bytes.subspan(at, std::min(piece, bytes.size() - at)));
    while (const auto frame = resync.next(look))
      result.frames.emplace_back(frame->begin(), frame->end());
  }
  for (const auto& [why, skipped] : resync.skipped()) result.skipped += skipped.bytes;
  result.waiting = resync.waiting();
  return result;
}

template <class LookAt>
std::vector<drivers::Bytes> check_stream(drivers::ByteView bytes, LookAt&& look,
                                         std::size_t frame_max) {
  Cut whole = cut(bytes, look, frame_max, bytes.size() + 1);
  const Cut pieces = cut(bytes, look, frame_max, 1 + bytes.size() / 7);
  require(whole.frames == pieces.frames);
  std::size_t total = whole.skipped + whole.waiting;
  for (const drivers::Bytes& frame : whole.frames) total += frame.size();
  require(total == bytes.size());
  return std::move(whole.frames);
}

// Every message has a name, and fields with names.
inline void check_offline(drivers::OfflineDecoder& decoder, drivers::ByteView bytes) {
  drivers::Captured captured;
  captured.bytes = bytes;
  decoder.feed(captured, [](const drivers::Message& message) {
    require(!message.name.empty());
    for (const drivers::Field& field : message.fields) require(!field.name.empty());
  });
}

}  // namespace drivers_fuzz
