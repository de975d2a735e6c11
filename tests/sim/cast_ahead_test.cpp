// Turns that are cast before they are asked for are those that would be cast then.
#include "sim/cast_ahead.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <random>

#include "sim/sim_clock.hpp"
#include "tests/sim/room.hpp"

namespace {

using namespace std::chrono_literals;

constexpr hal::Duration kTurnTime = 40ms, kArcTime = 30ms;
constexpr sim::MirrorArc kArc{.beams = 37, .angle_first_rad = -0.9, .angle_step_rad = 0.05};
constexpr std::uint64_t kSeed = 7;

hal::Time start_of(std::uint64_t turn) {
  return hal::Time(turn * kTurnTime);
}

// Turns evenly from when it is told to.
class ToldPan final : public sim::PanTruth {
 public:
  void turn(hal::Time now, double rate_radps) {
    from_rad_ = angle_rad(now);
    from_ = now;
    rate_radps_ = rate_radps;
    ++changes_;
  }
  double angle_rad(hal::Time time) const override {
    return from_rad_ + rate_radps_ * hal::seconds(time - from_);
  }
  std::uint64_t changes() const override { return changes_; }

 private:
  hal::Time from_{};
  double from_rad_{}, rate_radps_{};
  std::uint64_t changes_{};
};

// A robot in a room whose pan unit is told something now and then, and who drives on at times.
struct Room {
  const sim::Mesh mesh = sim_test::room(10, 8, 5);
  const sim::Scene scene{mesh};
  boost::asio::io_context io;
  sim::SimClock clock{io};
  sim::WorldConfig config;
  sim::World world{scene, config};
  ToldPan pan;
  sim::ScannerModel ranges;
  const Eigen::Isometry3d T_P_L{Eigen::Translation3d(0.1, 0, 0.2) *
                                Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX())};

  Room() { EXPECT_TRUE(world.put_robot({{0.5, -0.3}, 0.4}, 0)); }

  sim::CastAhead ahead(int threads) {
    return {{.ranges = ranges, .T_P_L = T_P_L, .seed = kSeed, .threads = threads},
            world,
            clock,
            pan,
            start_of};
  }
  // One turn by itself, when it is asked for.
  std::vector<float> cast_now(std::uint64_t turn) {
    sim::ProfileCaster caster(scene, ranges, kArc, T_P_L, kSeed);
    const sim::MirrorTurn one{turn, pan.angle_rad(start_of(turn)),
                              pan.angle_rad(start_of(turn) + kArcTime)};
    std::vector<float> ranges_m(kArc.beams);
    caster.cast(world.robot().T_W_S(world.config().scanner.height_m), {&one, 1}, 1, ranges_m);
    return ranges_m;
  }
};

class CastAhead : public testing::TestWithParam<int> {};

TEST_P(CastAhead, TellsWhatWouldBeCastWhenItIsAskedFor) {
  Room room;
  sim::CastAhead ahead = room.ahead(GetParam());
  ahead.set_arc(kArc, kArcTime);
  std::mt19937 dice(3);
  const auto one_of = [&](unsigned sides) { return dice() % sides == 0; };
  std::uint64_t every = 1, asked = 0;
  for (std::uint64_t turn = 0; turn < 3000; turn += every, ++asked) {
    room.clock.run_until(start_of(turn));
    const unsigned turns = turn % 1000 < 500 ? 8 : 150;  // From change to change.
    if (one_of(turns)) room.pan.turn(room.clock.now(), 0.1 * (dice() % 7) - 0.3);
    if (one_of(300)) every = 1 + dice() % 3;
    if (one_of(400)) turn += dice() % 100;  // Nobody asks for a while.
    if (one_of(500)) ahead.set_arc(kArc, kArcTime);
    if (one_of(200)) (void)room.world.command({one_of(2) ? 0.3 : 0.0, 0.1});
    const auto told_m = ahead.of(turn, every);
    ASSERT_EQ(std::vector(told_m.begin(), told_m.end()), room.cast_now(turn)) << turn;
  }
  EXPECT_GT(ahead.turns_cast(), asked) << "nothing is cast ahead";
}

INSTANTIATE_TEST_SUITE_P(Threads, CastAhead, testing::Values(1, 2, 3));

// What is being cast when nobody wants it any more is given up.
TEST(CastAheadEnd, MayComeWhileItCasts) {
  Room room;
  room.pan.turn({}, 0.2);
  for (int i = 0; i < 20; ++i) {
    sim::CastAhead ahead = room.ahead(2);
    ahead.set_arc(kArc, kArcTime);
    for (std::uint64_t turn = 0; turn < 130; ++turn) (void)ahead.of(turn);
    ahead.set_arc(kArc, kArcTime);
    for (std::uint64_t turn = 0; turn < 20; ++turn) (void)ahead.of(turn);
  }
}

}  // namespace
