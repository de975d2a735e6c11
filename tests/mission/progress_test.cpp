#include "mission/progress.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace mission {
namespace {

Progress some_progress() {
  return {"Phase I", 12, 26, "inner", 0.632, 45231, 11560, 14530.4};
}

TEST(Progress, LineNamesPhaseStationAreaCoverageVoxelsAndTimes) {
  EXPECT_EQ(progress_line(some_progress()),
            "Phase I  12/26 inner  cover 63.2 %  occupied 45,231  3:12:40  left 4:02:10");
}

TEST(Progress, LeavesOutWhatIsNotKnown) {
  EXPECT_EQ(progress_line({"planning", 0, 0, "", {}, 0, 3, {}}), "planning  0:03");
  EXPECT_EQ(progress_line({"Phase II", 2, 0, "moat", {}, 9, 60, {}}),
            "Phase II  2 moat  occupied 9  1:00");
}

TEST(Progress, NeverWiderThanEightyColumns) {
  Progress progress = some_progress();
  for (std::size_t length = 0; length < 200; ++length) {
    progress.area = std::string(length, 'x');
    EXPECT_LE(progress_line(progress).size(), kProgressColumns);
  }
  EXPECT_TRUE(progress_line(progress).ends_with("3:12:40  left 4:02:10"));  // Only the name gives.
  progress.phase = std::string(300, 'p');
  EXPECT_LE(progress_line(progress).size(), kProgressColumns);
}

TEST(Progress, CutsNamesBetweenCharacters) {
  EXPECT_EQ(shortened("Müller-Höfe", 7), "Mülle..");
  EXPECT_EQ(shortened("Höfe", 4), "Höfe");
  EXPECT_EQ(shortened("Höfe", 1), ".");
  EXPECT_EQ(shortened("Höfe", 0), "");
}

TEST(Progress, WritesTimesAndCountsForPeople) {
  EXPECT_EQ(duration_text(7), "0:07");
  EXPECT_EQ(duration_text(59.6), "1:00");
  EXPECT_EQ(duration_text(2 * 86400 + 3 * 3600 + 12 * 60 + 40), "2d 03:12:40");
  EXPECT_EQ(duration_text(-1), "0:00");
  EXPECT_EQ(count_text(0), "0");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(count_text(1000), "1,000");
  EXPECT_EQ(count_text(15500000), "15,500,000");
}

TEST(ProgressPrinter, UpdatesOneLineOnATerminal) {
  std::ostringstream out;
  {
    ProgressPrinter printer(out, true);
    printer.show({"a", 0, 0, "", {}, 0, 1, {}});
    printer.show({"b", 0, 0, "", {}, 0, 2, {}});
    printer.message("note");
  }
  EXPECT_EQ(out.str(), "\r\x1b[Ka  0:01\r\x1b[Kb  0:02\r\x1b[Knote\nb  0:02\n");
}

TEST(ProgressPrinter, WritesPlainLinesElsewhereAndNoneTwice) {
  std::ostringstream out;
  ProgressPrinter printer(out, false);
  printer.show({"a", 0, 0, "", {}, 0, 1, {}});
  printer.show({"a", 0, 0, "", {}, 0, 1, {}});
  printer.message("note");
  printer.finish();
  EXPECT_EQ(out.str(), "a  0:01\nnote\n");
}

TEST(ProgressPrinter, KeepsControlCharactersOfNamesOffTheTerminal) {
  EXPECT_EQ(progress_line({"p", 1, 2, "a\x1b[2J\nb", {}, 0, 0, {}}), "p  1/2 a [2J b  0:00");
}

}  // namespace
}  // namespace mission
