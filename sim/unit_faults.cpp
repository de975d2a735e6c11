#include "sim/unit_faults.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/container/static_vector.hpp>
#include <boost/system/errc.hpp>
#include <charconv>
#include <exception>
#include <map>
#include <optional>
#include <vector>

namespace sim {
namespace {

using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

struct Name {
  UnitFault fault;
  std::string_view text;
  double amount;  // The usual one; 0: takes none.
};
constexpr Name kNames[] = {
    {UnitFault::none, "none", 0},
    {UnitFault::off, "off", 0},
    {UnitFault::stuck, "stuck", 0},
    {UnitFault::garbage, "garbage", 0},
    {UnitFault::wrong, "wrong", 0.5},
    {UnitFault::slow, "slow", 3},
    {UnitFault::delayed, "delayed", 0.5},
    {UnitFault::intermittent, "intermittent", 2},
    {UnitFault::duplicated_reordered, "duplicated_reordered", 0},
};

std::string all_names() {
  std::string list;
  for (const Name& name : kNames) (list += list.empty() ? "" : ", ") += name.text;
  return list;
}

// Why a fault cannot have that amount, or "".
std::string objection(UnitFault fault, double amount) {
  switch (fault) {
    case UnitFault::wrong:
      return amount >= -1 && amount <= 100 && amount != 0 ? ""
                                                          : "a share of -1 to 100 other than 0";
    case UnitFault::slow:
      return amount > 1 && amount <= 1000 ? "" : "a factor above 1, at most 1000";
    case UnitFault::delayed:
      return amount > 0 && amount <= 60 ? "" : "seconds above 0, at most 60";
    case UnitFault::intermittent:
      return amount >= 0.01 && amount <= 3600 ? "" : "seconds of 0.01 to 3600";
    default:
      return "no amount";
  }
}

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

void garble(hal::CanFrame& frame, Dice& dice) {
  frame.id = static_cast<std::uint32_t>(dice.below(frame.extended ? 1U << 29 : 1U << 11));
  for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(dice.next());
}
void garble(Bytes& bytes, Dice& dice) {
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(dice.next());
}

// What goes out in place of what a unit sends.
template <class Message>
class Outgoing {
 public:
  using Messages = boost::container::static_vector<Message, 4>;

  explicit Outgoing(UnitFaults& faults) : faults_(faults) {}

  // Nothing to do and nothing held back.
  bool transparent() const { return faults_.is(UnitFault::none) && !held_; }

  Messages in_place_of(Message message, std::uint32_t kind) {
    if (faults_.generation() != generation_) stuck_.clear();
    generation_ = faults_.generation();
    Messages out;
    if (!faults_.silent()) add(out, std::move(message), kind);
    if (held_ && (out.size() > 1 || !faults_.is(UnitFault::duplicated_reordered) || !held_now_)) {
      out.push_back(std::move(*held_));
      held_.reset();
    }
    held_now_ = false;
    return out;
  }

 private:
  void add(Messages& out, Message message, std::uint32_t kind) {
    Dice& dice = faults_.dice();
    if (faults_.is(UnitFault::stuck)) {
      message = stuck_.try_emplace(kind, std::move(message)).first->second;
    } else if (faults_.is(UnitFault::garbage)) {
      garble(message, dice);
    } else if (faults_.is(UnitFault::duplicated_reordered)) {
      if (dice.hit(0.25)) out.push_back(message);
      if (!held_ && dice.hit(0.25)) {
        held_ = std::move(message);
        held_now_ = true;
        return;
      }
    }
    out.push_back(std::move(message));
  }

  UnitFaults& faults_;
  std::uint64_t generation_{};
  std::map<std::uint32_t, Message> stuck_;
  std::optional<Message> held_;  // Goes out behind the next one.
  bool held_now_ = false;        // By the message at hand.
};

// A link and its unit's faults. Shared with what is under way delayed.
template <class Link, class Message>
struct Faulty {
  Faulty(Link& its_link, hal::Clock& its_clock, UnitFaults& its_faults)
      : link(&its_link), clock(its_clock), faults(its_faults), outgoing(its_faults) {}

  Link* link;  // Null when the unit is gone.
  hal::Clock& clock;
  UnitFaults& faults;
  Outgoing<Message> outgoing;
  std::size_t delayed{};
};

void rethrow(std::exception_ptr problem) {
  if (problem) std::rethrow_exception(problem);
}

// Sends each message through `send(link, message)`: now, or later on its own.
template <class State, class Message, class Send>
hal::Task<hal::Result<void>> send_all(std::shared_ptr<State> state, Message message,
                                      std::uint32_t kind, Send send) {
  hal::Result<void> result;
  for (auto& each : state->outgoing.in_place_of(std::move(message), kind)) {
    if (state->faults.delay() == hal::Duration{}) {
      if (auto sent = co_await send(*state->link, each); !sent) result = sent;
    } else if (state->delayed < kDelayedMax) {
      ++state->delayed;
      auto later = [](std::shared_ptr<State> self, Message late, hal::Time due,
                      Send send_late) -> hal::Task<void> {
        co_await self->clock.sleep_until(due);
        --self->delayed;
        if (self->link != nullptr) co_await send_late(*self->link, late);
      };
      boost::asio::co_spawn(
          co_await boost::asio::this_coro::executor,
          later(state, std::move(each), state->clock.now() + state->faults.delay(), send), rethrow);
    }
  }
  co_return result;
}

}  // namespace

FaultText parse_unit_fault(std::string_view text) {
  const auto colon = text.find(':');
  const auto wanted = text.substr(0, colon);
  for (const Name& name : kNames) {
    if (name.text != wanted) continue;
    if (colon == std::string_view::npos) return {{name.fault, name.amount}, ""};
    const auto amount = number(text.substr(colon + 1));
    const auto why = amount ? objection(name.fault, *amount) : objection(name.fault, -2);
    if (why.empty()) return {{name.fault, *amount}, ""};
    return {{}, "\"" + std::string(text) + "\": " + std::string(wanted) + " takes " + why};
  }
  return {{}, "\"" + std::string(text) + "\" is no fault of a unit: there are " + all_names()};
}

std::string to_text(FaultSetting setting) {
  for (const Name& name : kNames) {
    if (name.fault != setting.fault) continue;
    std::string text(name.text);
    if (name.amount == 0) return text;
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, setting.amount).ptr;
    return text + ":" + std::string(digits, end);
  }
  return "none";
}

void UnitFaults::set(FaultSetting setting) {
  setting_ = setting;
  since_ = clock_.now();
  ++generation_;
  if (on_set_) on_set_();
}

bool UnitFaults::silent() const {
  if (is(UnitFault::off)) return true;
  if (!is(UnitFault::intermittent)) return false;
  const auto period = hal::from_seconds(setting_.amount);
  return (clock_.now() - since_) % period < period / 2;
}

hal::Duration UnitFaults::delay() const {
  return is(UnitFault::delayed) ? hal::from_seconds(setting_.amount) : hal::Duration{};
}

hal::Duration UnitFaults::slowed(hal::Duration pause) const {
  return is(UnitFault::slow) ? hal::from_seconds(hal::seconds(pause) * setting_.amount) : pause;
}

struct FaultyCan::State : Faulty<hal::CanBus, hal::CanFrame> {
  using Faulty::Faulty;
};
FaultyCan::FaultyCan(hal::CanBus& link, hal::Clock& clock, UnitFaults& faults)
    : state_(std::make_shared<State>(link, clock, faults)) {}
FaultyCan::~FaultyCan() {
  state_->link = nullptr;
}

hal::Task<hal::Result<void>> FaultyCan::send(hal::CanFrame frame, hal::Time deadline) {
  if (state_->outgoing.transparent()) return state_->link->send(frame, deadline);
  const hal::Duration patience = deadline - state_->clock.now();
  return send_all(state_, frame, frame.id,
                  [state = state_, patience](hal::CanBus& link, const hal::CanFrame& each) {
                    return link.send(each, state->clock.now() + patience);
                  });
}

hal::Task<hal::Result<hal::ReceivedFrame>> FaultyCan::receive() {
  for (;;) {
    auto received = co_await state_->link->receive();
    if (!received || !state_->faults.silent()) co_return received;
  }
}

struct FaultyStream::State : Faulty<hal::ByteStream, Bytes> {
  using Faulty::Faulty;
};
FaultyStream::FaultyStream(hal::ByteStream& link, hal::Clock& clock, UnitFaults& faults)
    : state_(std::make_shared<State>(link, clock, faults)) {}
FaultyStream::~FaultyStream() {
  state_->link = nullptr;
}

hal::Task<hal::Result<void>> FaultyStream::write(View bytes) {
  return write(bytes, 0);
}
hal::Task<hal::Result<void>> FaultyStream::write(View bytes, int kind) {
  if (state_->outgoing.transparent()) return state_->link->write(bytes);
  return send_all(state_, Bytes(bytes.begin(), bytes.end()), static_cast<std::uint32_t>(kind),
                  [](hal::ByteStream& link, const Bytes& each) { return link.write(each); });
}

hal::Task<hal::Result<std::size_t>> FaultyStream::read_some(std::span<std::uint8_t> into) {
  for (;;) {
    auto size = co_await state_->link->read_some(into);
    if (!size || !state_->faults.silent()) co_return size;
  }
}

struct FaultySender::State : Faulty<DatagramSender, Bytes> {
  using Faulty::Faulty;
};
FaultySender::FaultySender(DatagramSender& link, hal::Clock& clock, UnitFaults& faults)
    : state_(std::make_shared<State>(link, clock, faults)) {}
FaultySender::~FaultySender() {
  state_->link = nullptr;
}

hal::Task<void> FaultySender::send(View datagram) {
  return send(datagram, 0);
}
hal::Task<void> FaultySender::send(View datagram, int kind) {
  if (state_->outgoing.transparent()) {
    co_await state_->link->send(datagram);
    co_return;
  }
  co_await send_all(state_, Bytes(datagram.begin(), datagram.end()),
                    static_cast<std::uint32_t>(kind),
                    [](DatagramSender& link, const Bytes& each) -> hal::Task<hal::Result<void>> {
                      co_await link.send(each);
                      co_return hal::Result<void>{};
                    });
}

}  // namespace sim
