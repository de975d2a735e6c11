// One direction of a TCP connection: segments as captured -> bytes in order.
#pragma once

#include <functional>
#include <map>
#include <optional>

#include "drivers/bytes.hpp"

namespace captures {

class TcpSide {
 public:
  // Segments that came too early wait, at most this many bytes of them: then the gap is given up.
  static constexpr std::size_t kWaitingMax = 1 << 20;

  struct Segment {
    std::uint32_t sequence{};
    bool begins{};  // SYN: counts one before the data.
    std::optional<double> t_s;
    drivers::ByteView bytes;
  };
  // `out` gets bytes that follow without a gap what it got before, unless `gap` was called between:
  // with the number of bytes that the capture does not have.
  using Out = std::function<void(std::optional<double> t_s, drivers::ByteView bytes)>;
  using Gap = std::function<void(std::size_t bytes)>;

  void add(const Segment& segment, const Out& out, const Gap& gap);
  // Nothing more comes: gives out what waits.
  void finish(const Out& out, const Gap& gap);

 private:
  struct Waiting {
    std::optional<double> t_s;
    drivers::Bytes bytes;
  };
  void give_out(const Out& out);
  void jump(const Out& out, const Gap& gap);

  // Bytes are counted from the first one seen, so that 32-bit sequence numbers may wrap.
  std::optional<std::uint32_t> first_;
  std::int64_t next_{};
  std::map<std::int64_t, Waiting> waiting_;
  std::size_t waiting_bytes_{};
};

}  // namespace captures
