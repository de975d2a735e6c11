#include "tools/captures_tcp.hpp"

namespace captures {

void TcpSide::add(const Segment& segment, const Out& out, const Gap& gap) {
  const std::uint32_t sequence = segment.sequence + (segment.begins ? 1 : 0);
  if (!first_ || segment.begins) {
    if (first_) finish(out, gap);  // The same ports are used again.
    first_ = sequence;
    next_ = 0;
  }
  if (segment.bytes.empty()) return;
  // How far from the byte expected, in either direction.
  const auto expected = static_cast<std::uint32_t>(*first_ + static_cast<std::uint64_t>(next_));
  std::int64_t at = next_ + static_cast<std::int32_t>(sequence - expected);
  drivers::ByteView bytes = segment.bytes;
  if (at < next_) {  // Sent again, at least in part.
    const auto known = static_cast<std::uint64_t>(next_ - at);
    if (known >= bytes.size()) return;
    bytes = bytes.subspan(known);
    at = next_;
  }
  Waiting& waiting = waiting_[at];
  if (waiting.bytes.size() >= bytes.size()) return;
  waiting_bytes_ += bytes.size() - waiting.bytes.size();
  waiting = {segment.t_s, drivers::Bytes(bytes.begin(), bytes.end())};
  give_out(out);
  while (waiting_bytes_ > kWaitingMax) jump(out, gap);
}

void TcpSide::finish(const Out& out, const Gap& gap) {
  while (!waiting_.empty()) jump(out, gap);
}

void TcpSide::give_out(const Out& out) {
  while (!waiting_.empty() && waiting_.begin()->first <= next_) {
    const auto front = waiting_.extract(waiting_.begin());
    const auto& [t_s, bytes] = front.mapped();
    waiting_bytes_ -= bytes.size();
    const auto known = static_cast<std::size_t>(next_ - front.key());
    if (known >= bytes.size()) continue;
    out(t_s, drivers::ByteView(bytes).subspan(known));
    next_ += static_cast<std::int64_t>(bytes.size() - known);
  }
}

void TcpSide::jump(const Out& out, const Gap& gap) {
  const std::int64_t to = waiting_.begin()->first;
  if (to > next_) gap(static_cast<std::size_t>(to - next_));
  next_ = std::max(next_, to);
  give_out(out);
}

}  // namespace captures
