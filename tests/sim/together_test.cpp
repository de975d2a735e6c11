// How tasks that live together end.
#include "hal/together.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <stdexcept>

#include "sim/sim_clock.hpp"

namespace {

using namespace std::chrono_literals;

struct Together : testing::Test {
  boost::asio::io_context io;
  sim::SimClock clock{io};

  hal::Task<void> lives(hal::Duration span) { co_await clock.sleep_for(span); }
  hal::Task<void> fails(hal::Duration after) {
    co_await clock.sleep_for(after);
    throw std::runtime_error("broken");
  }
  // When both are over, and why.
  std::string end_of(hal::Task<void> one, hal::Task<void> other) {
    std::string end;
    boost::asio::co_spawn(io, hal::first_of(std::move(one), std::move(other)),
                          [&](std::exception_ptr problem, int) {
                            end = "well";
                            try {
                              if (problem) std::rethrow_exception(problem);
                            } catch (const std::exception& e) {
                              end = e.what();
                            }
                          });
    clock.run([&] { return !end.empty() || clock.now() > hal::Time(1h); });
    return end;
  }
};

TEST_F(Together, OneThatEndsWellEndsTheOther) {
  EXPECT_EQ(end_of(lives(1s), lives(2h)), "well");
  EXPECT_EQ(clock.now(), hal::Time(1s));
}

TEST_F(Together, OneThatFailsEndsTheOtherAndItsReasonIsKept) {
  EXPECT_EQ(end_of(fails(1s), lives(2h)), "broken");
  EXPECT_EQ(end_of(lives(2h), fails(1s)), "broken");
  EXPECT_EQ(clock.now(), hal::Time(2s));
}

TEST_F(Together, WhatFailsAfterwardsIsNobodysReason) {
  EXPECT_EQ(end_of(lives(1s), fails(2h)), "well");
}

}  // namespace
