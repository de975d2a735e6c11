// `vantage explain`.
#include <gmock/gmock.h>

#include "tests/tools/vantage_test.hpp"

namespace {

using testing::HasSubstr;

class Explain : public test::VantageTest {};

TEST_F(Explain, SaysCauseEffectAndRemedy) {
  const auto outcome = run("explain F012");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("F012-drive-silent: stop\n"));
  for (const char* part : {"cause   no power", "effect  the robot stands", "remedy  check the"})
    EXPECT_THAT(outcome.out, HasSubstr(part));
}

TEST_F(Explain, AnswersInJson) {
  const auto one = run("explain drive-silent --json").json();
  EXPECT_EQ(one.at("fault").at("id"), "F012-drive-silent");
  EXPECT_EQ(one.at("fault").at("action"), "stop");
  const auto all = run("explain --all --json").json();
  EXPECT_GT(all.at("faults").as_array().size(), 80U);
  EXPECT_EQ(all.at("faults").at(1).at("id"), "F001-estop-pressed");
}

TEST_F(Explain, PrintsTheManualsPage) {
  EXPECT_EQ(run("explain --all --markdown").out,
            test::read_text(std::string(VANTAGE_SOURCE_DIR) + "/docs/faults.md"));
  EXPECT_THAT(run("explain --all").out, HasSubstr("\nF012-drive-silent "));
}

TEST_F(Explain, GuessesWhatWasMeant) {
  const auto outcome = run("explain drive-silnet");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("no fault 'drive-silnet'; did you mean 'drive-silent'"));
  EXPECT_THAT(run("explain F012-drive-silnt").err, HasSubstr("did you mean 'F012-drive-silent'"));
  EXPECT_THAT(run("explain xyzzy").err, HasSubstr("no fault 'xyzzy'; `vantage explain --all`"));
}

TEST_F(Explain, RefusesHalfQuestions) {
  for (const char* line : {"explain", "explain F012 --all", "explain F012 --markdown"})
    EXPECT_EQ(run(line).code, 2) << line;
}

}  // namespace
