#include "drivers/modbus_client.hpp"

#include <atomic>
#include <boost/asio/experimental/concurrent_channel.hpp>
#include <boost/asio/this_coro.hpp>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

#include "drivers/kept_stream.hpp"
#include "drivers/modbus_line.hpp"

namespace drivers {
namespace {

namespace asio = boost::asio;
namespace errc = boost::system::errc;
using boost::system::error_code;
using Words = std::vector<std::uint16_t>;
using Bits = std::vector<bool>;

// A request on its way to the thread, and its outcome on the way back.
struct Call {
  explicit Call(const asio::any_io_executor& executor) : done(executor, 1) {}

  ModbusRequest request;
  std::atomic<bool> abandoned = false;
  asio::experimental::concurrent_channel<void(error_code, ModbusOutcome)> done;
};

class AUnit;

}  // namespace

struct ModbusBus::State {
  State(Address its_address, const asio::any_io_executor& its_executor, const hal::Clock& clock,
        Config config)
      : address(std::move(its_address)),
        executor(its_executor),
        line(address, clock, config),
        thread([this] { work(); }) {}

  static hal::Task<ModbusOutcome> perform(std::shared_ptr<State> self, ModbusRequest request);
  void work();
  void end();

  const Address address;
  asio::any_io_executor executor;
  std::map<std::uint8_t, std::unique_ptr<AUnit>> units;

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::shared_ptr<Call>> waiting;
  bool ending = false;

  ModbusLine line;  // The thread's.
  std::thread thread;
};

void ModbusBus::State::work() {
  for (;;) {
    std::shared_ptr<Call> call;
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [this] { return ending || !waiting.empty(); });
      if (ending) return;
      call = std::move(waiting.front());
      waiting.pop_front();
    }
    if (!call->abandoned) call->done.try_send(error_code{}, line.perform(call->request));
  }
}

void ModbusBus::State::end() {
  {
    const std::lock_guard lock(mutex);
    ending = true;
    for (const auto& call : waiting) call->done.close();
    waiting.clear();
  }
  changed.notify_one();
  thread.join();
}

hal::Task<ModbusOutcome> ModbusBus::State::perform(std::shared_ptr<State> self,
                                                   ModbusRequest request) {
  const auto call = std::make_shared<Call>(self->executor);
  call->request = request;
  {
    const std::lock_guard lock(self->mutex);
    if (self->ending || self->waiting.size() >= kWaitingMax)
      co_return ModbusOutcome{errc::make_error_code(errc::no_buffer_space), {}, {}, std::nullopt};
    self->waiting.push_back(call);
  }
  self->changed.notify_one();
  struct Abandon {
    Call& call;
    ~Abandon() { call.abandoned = true; }
  } const abandon{*call};
  auto [error, outcome] = co_await call->done.async_receive(kUseTuple);
  if (error) throw boost::system::system_error(asio::error::operation_aborted);
  co_return std::move(outcome);
}

namespace {

class AUnit final : public ModbusBus::Unit {
 public:
  using Perform = std::function<hal::Task<ModbusOutcome>(ModbusRequest)>;

  AUnit(std::uint8_t number, std::string address, Perform perform)
      : number_(number), address_(std::move(address)), perform_(std::move(perform)) {}

  hal::Task<hal::Result<Words>> read_input(Range range) override {
    return read(modbus::Function::read_input, range, &ModbusOutcome::words);
  }
  hal::Task<hal::Result<Words>> read_holding(Range range) override {
    return read(modbus::Function::read_holding, range, &ModbusOutcome::words);
  }
  hal::Task<hal::Result<Bits>> read_coils(Range range) override {
    return read(modbus::Function::read_coils, range, &ModbusOutcome::bits);
  }
  hal::Task<hal::Result<Bits>> read_discrete(Range range) override {
    return read(modbus::Function::read_discrete, range, &ModbusOutcome::bits);
  }
  hal::Task<hal::Result<void>> write_register(std::uint16_t at, std::uint16_t value) override {
    return write({number_, modbus::Function::write_register, at, value});
  }
  hal::Task<hal::Result<void>> write_coil_raw(std::uint16_t at, std::uint16_t value) override {
    return write({number_, modbus::Function::write_coil, at, value});
  }

  std::string address() const override { return address_; }
  std::vector<Trouble> troubles() const override {
    return trouble_ ? std::vector{*trouble_} : std::vector<Trouble>{};
  }

 private:
  template <class Values>
  hal::Task<hal::Result<Values>> read(modbus::Function function, Range range,
                                      Values ModbusOutcome::*values) {
    auto outcome = co_await perform_({number_, function, range.first, range.count});
    trouble_ = outcome.trouble;
    if (outcome.error) co_return outcome.error;
    co_return std::move(outcome.*values);
  }
  hal::Task<hal::Result<void>> write(ModbusRequest request) {
    const auto outcome = co_await perform_(request);
    trouble_ = outcome.trouble;
    if (outcome.error) co_return outcome.error;
    co_return hal::Result<void>{};
  }

  std::uint8_t number_;
  std::string address_;
  Perform perform_;
  std::optional<Trouble> trouble_;
};

}  // namespace

ModbusBus::ModbusBus(Address address, const asio::any_io_executor& executor,
                     const hal::Clock& clock, Config config)
    : state_(std::make_shared<State>(std::move(address), executor, clock, config)) {}

ModbusBus::~ModbusBus() {
  state_->end();
}

ModbusBus::Unit& ModbusBus::unit(std::uint8_t number) {
  auto& unit = state_->units[number];
  if (!unit) {
    const std::string address = std::visit(
        [number](auto where) {
          where.unit = number;
          return to_text(LinkAddress(where));
        },
        state_->address);
    unit = std::make_unique<AUnit>(number, address,
                                   [state = std::weak_ptr(state_)](ModbusRequest request) {
                                     return State::perform(std::shared_ptr(state), request);
                                   });
  }
  return *unit;
}

}  // namespace drivers
