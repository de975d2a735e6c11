// Whether the gate is on time on a machine that plans on all of its processors: the program that
// anybody may run on theirs, `build/release/tests/gate_lateness --help`.
#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/tools/vantage_test.hpp"

namespace {

using testing::HasSubstr;

class GateLateness : public test::VantageTest {
 protected:
  test::Outcome measure(const std::string& options) const {
    return test::run_program("tests/gate_lateness",
                             VANTAGE_SOURCE_DIR "/configs/missions/church.toml " + options,
                             folder_.path());
  }
};

// 20 s, nightly 5 min. Twice: on a machine that is itself a guest, others may take the processor
// away once.
TEST_F(GateLateness, IsAtMost5msUnderFullPlanningLoadIn999CyclesOf1000) {
  const std::string seconds = std::getenv("VANTAGE_NIGHTLY") != nullptr ? "300" : "20";
  test::Outcome outcome = measure("--seconds " + seconds);
  std::printf("%s", outcome.out.c_str());
  ASSERT_NE(outcome.code, 2) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("p99.9"));
  if (outcome.out.find("nothing is asked of it") != std::string::npos)
    GTEST_SKIP() << "no real-time scheduling here";
  if (outcome.code != 0) {
    outcome = measure("--seconds " + seconds);
    std::printf("%s", outcome.out.c_str());
  }
  EXPECT_EQ(outcome.code, 0);
}

TEST_F(GateLateness, IsFoundWhereItIsMoreThanWasAsked) {
  const test::Outcome outcome = measure("--seconds 2 --max-ms 0.0001");
  if (outcome.out.find("nothing is asked of it") != std::string::npos)
    GTEST_SKIP() << "no real-time scheduling here";
  EXPECT_EQ(outcome.code, 1) << outcome.out << outcome.err;
}

}  // namespace
