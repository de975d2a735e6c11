// What can be wrong with a simulated unit, switched on and off at run time.
//
// A unit takes a UnitFaults&, talks through one of the links below instead of its own end, and asks
// for what only it can do: keep to old values, be wrong, be slow.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "sim/link_faults.hpp"
#include "sim/links.hpp"

namespace sim {

enum class UnitFault : std::uint8_t {
  none,
  off,                   // Sends nothing, hears nothing.
  stuck,                 // Goes on sending what it sent first of each kind.
  garbage,               // Random bytes in place of everything that it sends.
  wrong,                 // Well-formed, with values that are off by `amount` of themselves.
  slow,                  // Everything takes `amount` times as long.
  delayed,               // What it sends comes `amount` seconds late.
  intermittent,          // Off and well by turns, each for half of `amount` seconds.
  duplicated_reordered,  // Of what it sends, some comes twice and some after the next.
};

struct FaultSetting {
  UnitFault fault = UnitFault::none;
  double amount{};

  bool operator==(const FaultSetting&) const = default;
};

// As in a robot file or on a command line: "off", "garbage", "slow:2.5". Without a number the
// amount is the usual one: wrong 0.5, slow 3, delayed 0.5 s, intermittent 2 s.
struct FaultText {
  FaultSetting setting;
  std::string error;  // What is wrong with the text and what to write instead; empty: nothing.
};
FaultText parse_unit_fault(std::string_view text);
std::string to_text(FaultSetting setting);

class UnitFaults {
 public:
  // seed: of what is random in garbage and in duplicated_reordered.
  explicit UnitFaults(hal::Clock& clock, std::uint64_t seed = 1) : clock_(clock), dice_(seed) {}

  void set(FaultSetting setting);
  // What a unit does at every setting, whether or not anybody speaks to it; {}: nothing. One
  // unit's.
  void on_set(std::function<void()> action) { on_set_ = std::move(action); }
  void clear() { set({}); }
  FaultSetting setting() const { return setting_; }
  bool is(UnitFault fault) const { return setting_.fault == fault; }

  // Off, or in an intermittent pause: sends nothing and hears nothing.
  bool silent() const;
  // Since when values do not change any more: Time::max() when they do.
  hal::Time stuck_since() const { return is(UnitFault::stuck) ? since_ : hal::Time::max(); }
  // What a value is to be multiplied with (1 when right), and how much slower all is (1 or more).
  double wrong_factor() const { return is(UnitFault::wrong) ? 1 + setting_.amount : 1; }
  double slowness() const { return is(UnitFault::slow) ? setting_.amount : 1; }
  hal::Duration delay() const;
  // A pause as long as the fault makes it.
  hal::Duration slowed(hal::Duration pause) const;

  Dice& dice() { return dice_; }
  // Counts the settings made: what was remembered under another one is out of date.
  std::uint64_t generation() const { return generation_; }

 private:
  hal::Clock& clock_;
  Dice dice_;
  FaultSetting setting_;
  std::function<void()> on_set_;
  hal::Time since_{};
  std::uint64_t generation_{};
};

// A unit's own end of a link, with its faults. `link` and `faults` must outlive it; what is delayed
// when it is destroyed is never sent. At most kDelayedMax messages are under way delayed; the
// newest is lost beyond that.
inline constexpr std::size_t kDelayedMax = 1024;

class FaultyCan final : public hal::CanBus {
 public:
  FaultyCan(hal::CanBus& link, hal::Clock& clock, UnitFaults& faults);
  ~FaultyCan() override;
  // Kinds, for `stuck`, are the ids.
  hal::Task<hal::Result<void>> send(hal::CanFrame frame, hal::Time deadline) override;
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

// Each write() is one message.
class FaultyStream final : public hal::ByteStream {
 public:
  FaultyStream(hal::ByteStream& link, hal::Clock& clock, UnitFaults& faults);
  ~FaultyStream() override;
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes) override;
  // For units whose messages differ in kind: stuck repeats the first of each kind.
  hal::Task<hal::Result<void>> write(std::span<const std::uint8_t> bytes, int kind);
  hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

class FaultySender final : public DatagramSender {
 public:
  FaultySender(DatagramSender& link, hal::Clock& clock, UnitFaults& faults);
  ~FaultySender() override;
  hal::Task<void> send(std::span<const std::uint8_t> datagram) override;
  hal::Task<void> send(std::span<const std::uint8_t> datagram, int kind);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace sim
