// `vantage decode` as a person or a script uses it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "tests/tools/vantage_test.hpp"

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Decode = test::VantageTest;

constexpr const char* kDrive =
    "(10.000000) can0 111#0096000000000000\n"
    "(10.020000) can0 211#0100010000010005\n"
    "(10.040000) can0 7FF#00\n";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST_F(Decode, TellsPeopleEveryMessageAndWhatWasSkipped) {
  const auto outcome = run("decode agilex " + write("drive.log", kDrive).string());
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(
      lines_of(outcome.out),
      ElementsAre("10.000000 > motion command  forward_mmps=150  turn_mradps=0  lateral_mmps=0  "
                  "steering_mrad=0",
                  "10.020000 < system state  vehicle=e-stop pressed  mode=standby  battery_v=25.6"
                  "  fault_bits=256  count=5  fault=vendor bit 8: note the bit and the firmware "
                  "version and ask the maker; restart the base if it stays"));
  EXPECT_THAT(lines_of(outcome.err), ElementsAre("2 messages (< from the device, > to it)",
                                                 "skipped: unknown id: 1 times, 1 bytes"));
}

TEST_F(Decode, GivesScriptsOneJsonObjectALine) {
  const auto outcome = run("decode agilex --json " + write("drive.log", kDrive).string());
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, IsEmpty());
  const auto lines = lines_of(outcome.out);
  ASSERT_EQ(lines.size(), 3U);
  const auto motion = boost::json::parse(lines[0]);
  EXPECT_EQ(motion.at("t_s").as_double(), 10.0);
  EXPECT_FALSE(motion.at("from_device").as_bool());
  EXPECT_EQ(motion.at("message").as_string(), "motion command");
  EXPECT_EQ(motion.at("fields").at("forward_mmps").as_int64(), 150);
  EXPECT_EQ(boost::json::parse(lines[1]).at("fields").at("battery_v").as_double(), 25.6);
  EXPECT_EQ(
      boost::json::parse(lines[2]),
      boost::json::parse(R"({"messages":2,"skipped":[{"why":"unknown id","times":1,"bytes":1}]})"));
}

TEST_F(Decode, GivesTablesOneRowAValue) {
  const auto log = write("drive.log", "can0 705#05\ncan0 080#\n");
  const auto outcome = run("decode canopen --csv " + log.string());
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out,
            "message_number,t_s,from_device,message,field,value\n"
            "1,,true,heartbeat,node,5\n"
            "1,,true,heartbeat,state,operational\n"
            "1,,true,heartbeat,toggle,false\n"
            "2,,false,SYNC,,\n");
}

TEST_F(Decode, TakesTheSidesOfADumpAsTheyAreOrSwapped) {
  const auto dump = write("dump",
                          "< 2026/01/02 03:04:05.0  length=8 from=0 to=7\n"
                          " 01 02 00 00 00 08 79 cc\n--\n"
                          "> 2026/01/02 03:04:05.1  length=6 from=0 to=5\n"
                          " 01 02 01 81 61 e8\n--\n");
  EXPECT_THAT(run("decode modbus " + dump.string()).out,
              HasSubstr("< read discrete inputs  unit=1  first=0  bits=[1 0 0 0 0 0 0 1]"));
  // The other way round requests are no replies.
  EXPECT_EQ(run("decode modbus --swap " + dump.string()).code, 1);
}

TEST_F(Decode, PrintsOnlyWhatCanBePrinted) {
  const auto file = write("gpsd.log",
                          "{\"class\":\"VERSION\",\"release\":\"3.\\u0001\xC3\xA9\"}\n"
                          "{\"class\":\"D\xC3\xA9\"}\n");
  for (const char* style : {"", "--json ", "--csv "}) {
    const auto outcome = run("decode gpsd " + std::string(style) + file.string());
    EXPECT_THAT(outcome.out, testing::AllOf(HasSubstr("3."), HasSubstr("C3"))) << style;
    for (const char c : outcome.out) EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << int{c};
  }
}

TEST_F(Decode, RefusesWhatItCannotUseAndSaysWhy) {
  const auto log = write("drive.log", kDrive).string();
  const std::tuple<std::string, int, std::string> cases[] = {
      {"toaster " + log, 2, "DEVICE = toaster: no such device; use one of agilex, canopen"},
      {"agilex " + log + ".gone", 2, "cannot read"},
      {"agilex --format tape " + log, 2, "--format = tape: no such format; use detect, pcap"},
      {"agilex --format pcap " + log, 2, "drive.log: no pcap or pcapng file"},
      {"agilex --json --csv " + log, 2, "excludes"},
      {"agilex", 2, "required"},
      {"agilex " + write("words.txt", "hello\n").string(), 1,
       "no message of agilex (read as raw)"}};
  for (const auto& [arguments, code, message] : cases) {
    const auto outcome = run("decode " + arguments);
    EXPECT_EQ(outcome.code, code) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(message)) << arguments;
    EXPECT_THAT(outcome.out, IsEmpty()) << arguments;
  }
}

TEST_F(Decode, ReadsRecordingsOfRealDevices) {
  const std::filesystem::path folder = VANTAGE_SOURCE_DIR "/../shared/data/recordings";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recordings in " << folder;
  const std::tuple<const char*, const char*, std::size_t> files[] = {
      {"agilex", "can/agilex_scout_v1_candump_short.txt", 7},
      {"agilex", "can/real_device_snippets.candump.txt", 12},
      {"canopen", "can/pycanopen_localnode_sdo_heartbeat.log", 49},
      {"canopen", "can/real_device_snippets.candump.txt", 72},
      {"modbus", "modbus/pymodbus_rtu_mbpoll.socat_hex.txt", 9}};
  for (const auto& [device, file, messages] : files) {
    const auto outcome =
        run(std::string("decode --json ") + device + " " + (folder / file).string());
    EXPECT_EQ(outcome.code, 0) << file;
    EXPECT_EQ(lines_of(outcome.out).size(), messages + 1) << device << " " << file;
  }
}

}  // namespace
