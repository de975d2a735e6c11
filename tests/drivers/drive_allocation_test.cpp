// The drive's loop, fifty times a second for hours: once it runs it allocates nothing. Counted over
// 1,000 of its cycles, with what the base sends in that time.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/container/static_vector.hpp>

#include "drivers/agilex_drive.hpp"
#include "hal/wake.hpp"
#include "tests/drivers/allocations.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace {

// Time that a test moves on by hand.
class SteppedClock final : public hal::Clock {
 public:
  hal::Time now() const override { return now_; }
  hal::Task<void> sleep_until(hal::Time wake) override {
    while (now_ < wake) co_await moved_.wait();
  }
  void step(hal::Duration by) {
    now_ += by;
    moved_.notify();
  }

 private:
  hal::Time now_{std::chrono::seconds(1)};
  hal::Wake moved_;
};

// A base that reports as its manual says, in command, without a simulated world.
class SteadyBase final : public hal::CanBus {
 public:
  explicit SteadyBase(hal::Clock& clock) : clock_(clock) {}

  // What it sends in the 20 ms from now on.
  void report() {
    using namespace drivers;
    ++cycle_;
    if (cycle_ % 5 == 1) {
      agilex::SystemState state;
      state.mode = agilex::ControlMode::can;
      state.battery_v = 26;
      state.count = count_++;
      put(agilex::encode(state));
    }
    put(agilex::encode(agilex::MotionState{}));
    for (std::uint8_t motor = 1; motor <= 4; ++motor) {
      put(agilex::encode(agilex::MotorFast{.motor = motor}));
      put(agilex::encode(agilex::MotorSlow{.motor = motor}));
    }
    put(agilex::encode(agilex::Odometry{cycle_, cycle_}));
    heard_.notify();
  }

  hal::Task<hal::Result<void>> send(hal::CanFrame, hal::Time) override {
    ++sent_;
    co_return hal::Result<void>{};
  }
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    while (waiting_.empty()) co_await heard_.wait();
    const hal::ReceivedFrame frame = waiting_.front();
    waiting_.erase(waiting_.begin());
    ++told_;
    co_return frame;
  }

  int sent() const { return sent_; }
  int told() const { return told_; }

 private:
  void put(const hal::CanFrame& frame) { waiting_.push_back({clock_.now(), frame}); }

  hal::Clock& clock_;
  hal::Wake heard_;
  boost::container::static_vector<hal::ReceivedFrame, 64> waiting_;
  std::int32_t cycle_{};
  std::uint8_t count_{};
  int sent_{}, told_{};
};

TEST(DriveAllocation, AThousandCyclesOfAnAgilexDriveAllocateNothing) {
  using namespace std::chrono_literals;
  boost::asio::io_context io;
  SteppedClock clock;
  SteadyBase base(clock);
  drivers::AgilexDrive drive({}, clock, base);
  const auto rethrow = [](std::exception_ptr error) {
    if (error) std::rethrow_exception(error);
  };
  boost::asio::co_spawn(io, drive.run(), rethrow);
  int travels = 0;
  boost::asio::co_spawn(
      io,
      [](drivers::AgilexDrive& of, int& count) -> hal::Task<void> {
        for (;;) {
          const auto travel = co_await of.next_travel();
          if (travel) ++count;
        }
      }(drive, travels),
      rethrow);
  int commanded = 0;
  boost::asio::co_spawn(
      io,
      [](drivers::AgilexDrive& of, hal::Clock& at, int& count) -> hal::Task<void> {
        for (;;) {
          const hal::Twist slow{0.01, 0};
          const auto done = co_await of.command(slow);
          if (done) ++count;
          co_await at.sleep_for(20ms);
        }
      }(drive, clock, commanded),
      rethrow);
  const auto cycles = [&](int count) {
    for (int i = 0; i < count; ++i) {
      base.report();
      clock.step(20ms);
      io.restart();
      io.poll();
    }
  };
  cycles(100);
  ASSERT_EQ(drive.state(), drivers::DeviceState::running);
  const int sent = base.sent(), told = base.told(), before_commanded = commanded;
  const int before_travels = travels;
  const std::uint64_t before = drivers_test::allocations();
  cycles(1000);
  EXPECT_EQ(drivers_test::allocations() - before, 0U);
  EXPECT_GE(base.sent() - sent, 1000);
  EXPECT_EQ(base.told() - told, 10'200);
  EXPECT_GE(commanded - before_commanded, 990);
  EXPECT_GE(travels - before_travels, 990);
}

}  // namespace
