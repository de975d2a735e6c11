#include <map>
#include <tuple>
#include <type_traits>
#include <vector>

#include "drivers/modbus_errors.hpp"
#include "hal/wake.hpp"
#include "sim/links.hpp"
#include "sim/unit_faults.hpp"
#include "sim/wire.hpp"

namespace sim {

namespace errc = boost::system::errc;
using Words = std::vector<std::uint16_t>;
using Bits = std::vector<bool>;

namespace {

// As many as the protocol can carry.
constexpr std::uint16_t kWordsMax = 125, kBitsMax = 2000;

hal::Result<void> refused() {
  return error(errc::function_not_supported);
}

}  // namespace

hal::Result<Words> RegisterUnit::read_input(hal::RegisterRange) {
  return refused().error();
}
hal::Result<Words> RegisterUnit::read_holding(hal::RegisterRange) {
  return refused().error();
}
hal::Result<Bits> RegisterUnit::read_coils(hal::RegisterRange) {
  return refused().error();
}
hal::Result<Bits> RegisterUnit::read_discrete(hal::RegisterRange) {
  return refused().error();
}
hal::Result<void> RegisterUnit::write_register(std::uint16_t, std::uint16_t) {
  return refused();
}
hal::Result<void> RegisterUnit::write_coil_raw(std::uint16_t, std::uint16_t) {
  return refused();
}

struct RegisterWire::Bus final : hal::Registers {
  Bus(hal::Clock& its_clock, RegisterUnit& its_unit, const Config& its_config)
      : clock(its_clock), unit(its_unit), config(its_config), disturbance(config.seed) {}

  hal::Task<hal::Result<Words>> read_input(Range range) override {
    return read<Words>(3, range, &RegisterUnit::read_input, words_stuck);
  }
  hal::Task<hal::Result<Words>> read_holding(Range range) override {
    return read<Words>(4, range, &RegisterUnit::read_holding, words_stuck);
  }
  hal::Task<hal::Result<Bits>> read_coils(Range range) override {
    return read<Bits>(1, range, &RegisterUnit::read_coils, bits_stuck);
  }
  hal::Task<hal::Result<Bits>> read_discrete(Range range) override {
    return read<Bits>(2, range, &RegisterUnit::read_discrete, bits_stuck);
  }
  hal::Task<hal::Result<void>> write_register(std::uint16_t at, std::uint16_t value) override {
    return write(at, value, &RegisterUnit::write_register);
  }
  hal::Task<hal::Result<void>> write_coil_raw(std::uint16_t at, std::uint16_t value) override {
    return write(at, value, &RegisterUnit::write_coil_raw);
  }

  using Key = std::tuple<int, std::uint16_t, std::uint16_t>;  // Function, first, count.
  template <class Values>
  using Stuck = std::map<Key, Values>;
  template <class Values>
  using Reader = hal::Result<Values> (RegisterUnit::*)(Range);
  using Writer = hal::Result<void> (RegisterUnit::*)(std::uint16_t, std::uint16_t);

  template <class Values>
  hal::Task<hal::Result<Values>> read(int function, Range range, Reader<Values> reader,
                                      Stuck<Values>& stuck);
  hal::Task<hal::Result<void>> write(std::uint16_t at, std::uint16_t value, Writer writer);
  template <class Ask>
  auto exchange(Ask ask) -> hal::Task<decltype(ask())>;

  void cut();
  void forget_stuck_replies();
  hal::Duration time_to_reply() const;
  bool damages();

  // Shared with whoever has its turn, who may be unwound later than the wire.
  struct Queue {
    bool busy = false;
    hal::Wake changed;  // Free again.
  };
  class Turn {
   public:
    explicit Turn(std::shared_ptr<Queue> queue) : queue_(std::move(queue)) { queue_->busy = true; }
    ~Turn() {
      queue_->busy = false;
      queue_->changed.notify();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    std::shared_ptr<Queue> queue_;
  };

  hal::Clock& clock;
  RegisterUnit& unit;
  Config config;
  Disturbance disturbance;
  bool connected = true;
  std::uint64_t cuts{};
  std::shared_ptr<Queue> queue = std::make_shared<Queue>();
  std::uint64_t stuck_generation{};
  Stuck<Words> words_stuck;
  Stuck<Bits> bits_stuck;
};

// One turn on the bus: asks the unit when the request arrives there, or runs out of time.
template <class Ask>
auto RegisterWire::Bus::exchange(Ask ask) -> hal::Task<decltype(ask())> {
  while (queue->busy) co_await queue->changed.wait();
  const Turn turn(queue);
  const auto cuts_before = cuts;
  const bool passes = connected && disturbance.pass(1) == 1 && !disturbance.loses();
  const hal::Time times_out = clock.now() + config.reply_timeout;
  const hal::Time arrives = disturbance.arrival(clock.now() + time_to_reply());
  if (disturbance.cut_now()) cut();
  if (connected) co_await clock.sleep_until(passes ? std::min(arrives, times_out) : times_out);
  if (!connected || cuts != cuts_before) co_return error(errc::not_connected);
  if (!passes || (unit.faults() != nullptr && unit.faults()->silent()))
    co_return error(errc::timed_out);
  if (disturbance.doubles()) ask();
  auto reply = ask();
  if (arrives > times_out) co_return error(errc::timed_out);
  if (damages()) co_return error(errc::bad_message);
  co_return reply;
}

template <class Values>
hal::Task<hal::Result<Values>> RegisterWire::Bus::read(int function, Range range,
                                                       Reader<Values> reader,
                                                       Stuck<Values>& stuck) {
  constexpr std::uint16_t kMost = std::is_same_v<Values, Bits> ? kBitsMax : kWordsMax;
  if (range.count == 0 || range.count > kMost) co_return error(errc::invalid_argument);
  auto reply = co_await exchange([this, range, reader] { return (unit.*reader)(range); });
  forget_stuck_replies();
  if (reply && unit.faults() != nullptr && unit.faults()->is(UnitFault::stuck))
    co_return stuck.try_emplace({function, range.first, range.count}, *reply).first->second;
  co_return reply;
}

hal::Task<hal::Result<void>> RegisterWire::Bus::write(std::uint16_t at, std::uint16_t value,
                                                      Writer writer) {
  co_return co_await exchange([this, at, value, writer] { return (unit.*writer)(at, value); });
}

// Those of an earlier time.
void RegisterWire::Bus::forget_stuck_replies() {
  if (unit.faults() == nullptr || unit.faults()->generation() == stuck_generation) return;
  stuck_generation = unit.faults()->generation();
  words_stuck.clear();
  bits_stuck.clear();
}

hal::Duration RegisterWire::Bus::time_to_reply() const {
  const UnitFaults* const faults = unit.faults();
  return faults == nullptr ? config.reply_time
                           : faults->slowed(config.reply_time) + faults->delay();
}

bool RegisterWire::Bus::damages() {
  if (disturbance.corrupts()) return true;
  const UnitFaults* const faults = unit.faults();
  if (faults == nullptr) return false;
  // The reply to another request than the one that was made.
  if (faults->is(UnitFault::duplicated_reordered)) return disturbance.dice().hit(0.25);
  return faults->is(UnitFault::garbage);
}

void RegisterWire::Bus::cut() {
  if (!std::exchange(connected, false)) return;
  ++cuts;
}

RegisterWire::RegisterWire(hal::Clock& clock, RegisterUnit& unit, Config config)
    : bus_(std::make_unique<Bus>(clock, unit, config)) {}
RegisterWire::~RegisterWire() = default;

hal::Registers& RegisterWire::client() {
  return *bus_;
}
void RegisterWire::set_faults(const LinkFaults& faults) {
  bus_->disturbance.set(faults);
}
void RegisterWire::cut() {
  bus_->cut();
}
void RegisterWire::mend() {
  bus_->disturbance.mended();
  bus_->connected = true;
}

}  // namespace sim
