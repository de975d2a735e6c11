// How the last run ended, and so how the robot comes up.
#include "mission/boot_mark.hpp"

#include <gtest/gtest.h>

namespace {

using mission::Boot;
using mission::boot_after;
using mission::BootMark;
using State = BootMark::State;

TEST(BootMark, IsReadAsItWasWritten) {
  for (const State state : {State::running, State::hung, State::held, State::ended}) {
    const BootMark mark{state, "6e0c1d4f8a21"};
    EXPECT_EQ(mission::mark_of(text_of(mark)), mark);
  }
}

TEST(BootMark, IsNothingWhenItIsNotWhole) {
  for (const char* text :
       {"", "ended", "ended ", "ended \n", "ended 6e0c", "ended 6e0c\nx", "ended 6e 0c\n",
        "Ended 6e0c\n", "endless 6e0c\n", "6e0c\n", "running 6e0c\n\n"})
    EXPECT_EQ(mission::mark_of(text), std::nullopt) << text;
}

TEST(BootMark, OnlyARunThatEndedInOrderLetsTheRobotStartByItself) {
  for (const char* boot_id : {"one", "two"})
    for (const char* stopped_with : {"", "success 0", "watchdog ABRT", "signal KILL"})
      EXPECT_EQ(boot_after(BootMark{State::ended, "one"}, boot_id, stopped_with), Boot::clean);
}

TEST(BootMark, ARobotThatWasLeftStoppedIsNoCrash) {
  EXPECT_EQ(boot_after(BootMark{State::held, "one"}, "two", "success 0"), Boot::clean);
}

TEST(NextStart, IsReadAsItWasWrittenAndAsUsualOtherwise) {
  using mission::NextStart;
  for (const NextStart next : {NextStart::as_usual, NextStart::anew, NextStart::from_start})
    EXPECT_EQ(mission::next_start_of(text_of(next)), next);
  for (const char* text : {"", "anew", "anew\n\n", "Anew\n", "from start"})
    EXPECT_EQ(mission::next_start_of(text), NextStart::as_usual) << text;
}

TEST(BootMark, AMachineThatStartedAnewMeansThatThePowerWasCut) {
  for (const State state : {State::running, State::hung})
    EXPECT_EQ(boot_after(BootMark{state, "one"}, "two", ""), Boot::power_cut);
}

TEST(BootMark, NothingKnownIsHeldToBeAPowerCut) {
  EXPECT_EQ(boot_after(std::nullopt, "one", ""), Boot::power_cut);
  EXPECT_EQ(boot_after(std::nullopt, "one", "success 0"), Boot::power_cut);
}

TEST(BootMark, TellsAWatchdogFromACrashAndFromAProgramThatWasKilled) {
  const BootMark running{State::running, "one"}, hung{State::hung, "one"};
  EXPECT_EQ(boot_after(hung, "one", ""), Boot::watchdog_restart);
  EXPECT_EQ(boot_after(running, "one", "watchdog ABRT"), Boot::watchdog_restart);
  EXPECT_EQ(boot_after(running, "one", "core-dump SEGV"), Boot::crash);
  EXPECT_EQ(boot_after(running, "one", "exit-code 2"), Boot::crash);
  EXPECT_EQ(boot_after(running, "one", ""), Boot::crash);
  EXPECT_EQ(boot_after(running, "one", "signal KILL"), Boot::power_cut);
}

}  // namespace
