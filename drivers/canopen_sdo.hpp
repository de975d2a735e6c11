// SDO transfers as pure state machines: step(frame, time) -> frame. Expedited and segmented.
#pragma once

#include <functional>
#include <optional>
#include <variant>

#include "drivers/canopen_codec.hpp"
#include "hal/values.hpp"

namespace drivers::canopen {

struct Address {
  std::uint16_t index{};
  std::uint8_t sub{};
  bool operator==(const Address&) const = default;
};

struct SdoTimes {
  hal::Duration reply_max = std::chrono::milliseconds(300);  // Silence before asking again.
  int retries = 2;  // Of the first request; a transfer in segments is not taken up again.
};

// Why a transfer failed.
struct SdoFailure {
  std::uint32_t abort_code{};
  bool by_node{};  // The node refused; else the client gave up.
};

// The master's side of one transfer. Replies to other transfers, late and doubled ones are ignored.
class SdoClient {
 public:
  static constexpr std::size_t kBytesMax = 1 << 16;

  static SdoClient read(std::uint8_t node, Address address, SdoTimes times = {});
  // data: 1 to kBytesMax bytes; up to 4 go expedited.
  static SdoClient write(std::uint8_t node, Address address, Bytes data, SdoTimes times = {});

  // Call once to begin, then with every frame that arrives and, without one, at wake_up() or later.
  // What is to be sent now, if anything.
  std::optional<hal::CanFrame> step(const hal::CanFrame* frame, hal::Time now);

  bool done() const { return phase_ == Phase::done || failure_.has_value(); }
  const std::optional<SdoFailure>& failure() const { return failure_; }
  const Bytes& data() const { return data_; }  // What was read, once done without failure.
  hal::Time wake_up() const { return deadline_; }

 private:
  enum class Phase { idle, first, segments, done };

  SdoClient(std::uint8_t node, Address address, bool writes, Bytes data, SdoTimes times);
  hal::CanFrame ask(const Sdo& request, hal::Time now);
  Sdo first_request() const;
  std::optional<hal::CanFrame> on_silence(hal::Time now);
  std::optional<hal::CanFrame> on_first_reply(const Sdo& reply, hal::Time now);
  std::optional<hal::CanFrame> on_segment(const Sdo& reply, hal::Time now);
  std::optional<hal::CanFrame> next_segment(hal::Time now);
  hal::CanFrame give_up(std::uint32_t abort_code);

  std::uint8_t node_{};
  Address address_;
  bool writes_{};
  Bytes data_;
  SdoTimes times_;
  Phase phase_ = Phase::idle;
  std::size_t sent_{};  // Bytes in segments so far, of a write.
  std::optional<std::uint32_t> announced_;
  bool toggle_{};
  int tries_{};
  hal::Time deadline_{};
  std::optional<Sdo> last_;  // The segment answered last: its double is ignored.
  std::optional<SdoFailure> failure_;
};

// The node's side, as drives do it: for simulated drives and tests.
class SdoServer {
 public:
  // The bytes of an object, or an abort code.
  using Read = std::function<std::variant<Bytes, std::uint32_t>(Address)>;
  // 0, or an abort code.
  using Write = std::function<std::uint32_t(Address, ByteView)>;

  SdoServer(std::uint8_t node, Read read, Write write)
      : node_(node), read_(std::move(read)), write_(std::move(write)) {}

  // The reply to a frame, if it is a request to this node.
  std::optional<hal::CanFrame> step(const hal::CanFrame& frame);

 private:
  Sdo reply(SdoKind kind) const;
  hal::CanFrame abort(std::uint32_t code);
  hal::CanFrame begin_read();
  hal::CanFrame begin_write(const Sdo& request);
  hal::CanFrame read_segment(const Sdo& request);
  hal::CanFrame write_segment(const Sdo& request);

  std::uint8_t node_;
  Read read_;
  Write write_;
  enum class Busy { no, reading, writing } busy_ = Busy::no;
  Address address_;
  Bytes data_;
  std::size_t sent_{};
  std::optional<std::uint32_t> announced_;
  bool toggle_{};
};

}  // namespace drivers::canopen
