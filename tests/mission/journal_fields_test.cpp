// What the system's journal keeps of what the program says, and what a reload finds.
#include "mission/journal_fields.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "mission/config_changes.hpp"
#include "mission/faults.hpp"

namespace {

using mission::journal_fields;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

std::string id(std::string_view id) {
  return "MESSAGE_ID=" + std::string(id);
}

TEST(JournalFields, OfPlainWordsAreTheWords) {
  EXPECT_THAT(journal_fields("Phase I  3/9"), ElementsAre("MESSAGE=Phase I  3/9", "PRIORITY=6"));
}

TEST(JournalFields, NameTheFaultThatStopsTheRobot) {
  EXPECT_THAT(
      journal_fields("the robot is stopped: F802-power-cut: power failed; F010 and so on"),
      ElementsAre(testing::StartsWith("MESSAGE=the robot is stopped: F802-power-cut: "),
                  "PRIORITY=3", "FAULT_ID=F802-power-cut", id(mission::message_id::kStopped)));
}

TEST(JournalFields, OfAReleaseAreNoError) {
  const auto fields = journal_fields("the robot was released after F802-power-cut");
  EXPECT_THAT(fields, Contains("PRIORITY=5"));
  EXPECT_THAT(fields, Contains(id(mission::message_id::kReleased)));
}

TEST(JournalFields, FindEveryFaultOfTheTableWithItsPriority) {
  for (const mission::FaultEntry& fault : mission::all_faults()) {
    const auto fields = journal_fields(fmt::format("because of {}: so", fault.id));
    EXPECT_THAT(fields, Contains(fmt::format("FAULT_ID={}", fault.id)));
    const bool stops = fault.action == mission::Action::stop;
    const bool holds =
        fault.action == mission::Action::hold || fault.action == mission::Action::home;
    EXPECT_THAT(fields, Contains(stops ? "PRIORITY=3" : holds ? "PRIORITY=4" : "PRIORITY=5"));
  }
}

TEST(ConfigChanges, AreNoneBetweenTheSame) {
  EXPECT_THAT(mission::config_changes({}, {}), IsEmpty());
}

TEST(ConfigChanges, NameWhatHasAnotherValueWhatIsNewAndWhatIsGone) {
  mission::MissionConfig now, next;
  now.regions["moat"] = "manual";
  next.regions["court"] = "robot";
  next.phase1.candidates = 7;
  EXPECT_THAT(mission::config_changes(now, next),
              ElementsAre("phase1.candidates: 7 instead of 1000", "regions.court: robot, new",
                          "regions.moat: no longer manual"));
}

}  // namespace
