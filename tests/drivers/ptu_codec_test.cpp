#include "drivers/ptu_codec.hpp"

#include <numbers>

#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::frames_in;

PtuAnswer answer_of(std::string_view text) {
  const auto frames = frames_in(as_bytes(text), look_ptu, kPtuLineMax);
  EXPECT_EQ(frames.size(), 1U) << text;
  return frames.empty() ? PtuAnswer{} : parse_ptu(frames[0]);
}

// "\r\n" and "\x20" as the transcripts write them.
std::string unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\')
      out += text[i];
    else if (text[++i] == 'r')
      out += '\r';
    else if (text[i] == 'n')
      out += '\n';
    else if (text[i] == 'x')
      out += static_cast<char>(hex_pair(text.substr(i + 1))), i += 2;
  }
  return out;
}

TEST(Ptu, TranscriptsOfRealUnitsAreRead) {
  RECORDING_OR_SKIP(text, "ptu/transcripts.txt");
  std::vector<std::string> got;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view line = take_field(rest, '\n');
    if (!line.starts_with("< ")) continue;
    const std::string bytes = unescaped(line.substr(2));
    for (const Bytes& frame : frames_in(as_bytes(bytes), look_ptu, kPtuLineMax)) {
      const PtuAnswer answer = parse_ptu(frame);
      std::string said =
          (answer.ok ? "ok" : "no") + std::string(" [") + answer.echo + "] " + answer.text;
      for (int i = 0; i < answer.pan_limits; ++i) said += " P";
      for (int i = 0; i < answer.tilt_limits; ++i) said += " T";
      got.push_back(said);
    }
  }
  EXPECT_EQ(
      got,
      (std::vector<std::string>{
          "ok [] ", "ok [] ", "ok [] Current Pan position is -2500", "ok [] ", "ok [] ",
          "ok [] Current Pan position is 2500", "ok [E] Echoing ON",
          "ok [] 23.142857 seconds arc per position", "ok [] 11.571429 seconds arc per position",
          "ok [] Maximum Pan speed is 12000 positions/sec", "ok [] Independent speed control mode",
          "ok [] 23.142857", "no [] Illegal Command Entered", "ok []  T T", "ok [] 13.2,99,97,104",
          "ok []  P P T T", "ok [PP] 120", "ok [] -45"}));
}

TEST(Ptu, NumbersComeTerseOrVerbose) {
  EXPECT_EQ(ptu_integer(answer_of("* -2500\r\n")), -2500);
  EXPECT_EQ(ptu_integer(answer_of("PP * 120\r\n")), 120);
  EXPECT_EQ(ptu_integer(answer_of("* Current Pan position is -2500\r\n")), -2500);
  EXPECT_EQ(ptu_numbers(answer_of("\n* 23.142857\r\n")), std::vector<double>{23.142857});
  EXPECT_FALSE(ptu_integer(answer_of("*\r\n")));
  EXPECT_FALSE(ptu_integer(answer_of("* 23.5\r\n")));
  EXPECT_FALSE(ptu_integer(answer_of("! 5\r\n")));
}

TEST(Ptu, LimitsThatAreHitComeBetween) {
  const PtuAnswer answer = answer_of("!P!T* -7\r\n");
  EXPECT_TRUE(answer.ok);
  EXPECT_EQ(answer.pan_limits, 1);
  EXPECT_EQ(answer.tilt_limits, 1);
  EXPECT_EQ(ptu_integer(answer), -7);
  const PtuAnswer reset = answer_of("!T!T!P!P*");
  EXPECT_TRUE(reset.ok);
  EXPECT_EQ(reset.pan_limits + reset.tilt_limits, 4);
}

TEST(Ptu, RefusalsAreNamedAndKeepTheirText) {
  const auto name = [](std::string_view text) { return ptu_fault(answer_of(text))->name; };
  EXPECT_EQ(name("! Illegal Command Entered\r\n"), "illegal command");
  EXPECT_EQ(name("! Maximum allowable Pan position is 3090\r\n"), "beyond a limit");
  EXPECT_EQ(name("! Something else\r\n"), "refused");
  EXPECT_EQ(answer_of("! Something else\r\n").text, "Something else");
  EXPECT_EQ(ptu_fault(answer_of("* 1\r\n")), nullptr);
}

TEST(Ptu, AnglesAreRoundedToSteps) {
  PtuAxis axis;
  axis.arcsec_per_step = 46.2857;
  EXPECT_NEAR(axis.angle_rad(-2500), 2500 * 46.2857 / 3600 * std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(axis.steps(axis.angle_rad(-2500)), -2500);
  EXPECT_EQ(axis.steps(axis.angle_rad(-2500) + 0.4 * axis.angle_rad(-1)), -2500);
  EXPECT_EQ(axis.steps(axis.angle_rad(-2500) + 0.6 * axis.angle_rad(-1)), -2501);
  axis.counter_clockwise = true;
  EXPECT_GT(axis.angle_rad(1), 0);
  EXPECT_EQ(axis.steps(axis.angle_rad(77)), 77);
}

TEST(Ptu, HealthIsCelsius) {
  const auto health = ptu_health(answer_of("\n* 13.2,99,97,104\r\n"));
  ASSERT_TRUE(health);
  EXPECT_EQ(health->supply_v, 13.2);
  EXPECT_NEAR(health->head_c, 37.2222, 1e-4);
  EXPECT_NEAR(health->pan_c, 36.1111, 1e-4);
  EXPECT_NEAR(health->tilt_c, 40, 1e-9);
  EXPECT_FALSE(ptu_health(answer_of("* 13.2,99\r\n")));
}

TEST(Ptu, RequestsEndInABlank) {
  EXPECT_EQ(ptu_query("PP"), bytes_of("PP "));
  EXPECT_EQ(ptu_command("PP", -2500), bytes_of("PP-2500 "));
  const auto steps = ptu_startup();
  ASSERT_GT(steps.size(), 6U);
  EXPECT_EQ(steps[0].request, bytes_of(" "));
  EXPECT_EQ(steps[1].request, bytes_of("ED "));
}

TEST(Ptu, WholeAnswersSurviveDamage) {
  const std::vector<Bytes> frames{bytes_of("* -2500\r\n"), bytes_of("!T!T!P!P*"),
                                  bytes_of("! Illegal Command Entered\r\n"), bytes_of("*\r\n"),
                                  bytes_of("* 7\r\n")};
  for (const std::size_t piece : {1U, 2U, 100U})
    EXPECT_EQ(frames_in(drivers_test::joined(frames), look_ptu, kPtuLineMax, piece), frames);
  // Answers carry no checksum; what is not text costs only its line.
  std::vector<Bytes> dirty = frames;
  dirty[0][3] = 0xFF;
  EXPECT_EQ(frames_in(drivers_test::joined(dirty), look_ptu, kPtuLineMax),
            (std::vector<Bytes>{frames[1], frames[2], frames[3], frames[4]}));
}

TEST(Ptu, OfflineNamesRequestsAnswersAndRefusals) {
  const auto decoder = ptu_offline();
  std::vector<std::string> names;
  Captured captured;
  const auto feed = [&](bool from_device, std::string_view text) {
    captured.from_device = from_device;
    captured.bytes = as_bytes(text);
    decoder->feed(captured, [&](const Message& m) { names.push_back(m.name); });
  };
  feed(false, "PP ");
  feed(true, "* 12\r\nhello\r\n! Illegal Command Entered\r\n");
  EXPECT_EQ(names, (std::vector<std::string>{"request", "answer", "refusal"}));
  EXPECT_EQ(decoder->skipped().at("no answer").bytes, 7U);
}

}  // namespace
}  // namespace drivers
