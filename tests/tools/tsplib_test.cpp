#include "tools/tsplib.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tools {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kHead = "NAME : t\nTYPE : TSP\n";

std::vector<std::vector<double>> costs(const std::string& text) {
  const LoadedTsp loaded = parse_tsp(kHead + text, "t.tsp");
  EXPECT_TRUE(loaded.errors.empty()) << loaded.errors.front().text();
  return loaded.tsp.problem.cost;
}

std::string error(const std::string& text) {
  const LoadedTsp loaded = parse_tsp(text, "t.tsp");
  EXPECT_EQ(loaded.errors.size(), 1u) << text;
  return loaded.errors.empty() ? "" : loaded.errors.front().text();
}

std::string plane(const std::string& type, const std::string& places) {
  return "DIMENSION : 2\nEDGE_WEIGHT_TYPE : " + type + "\nNODE_COORD_SECTION\n" + places + "EOF\n";
}

TEST(Tsplib, MeasuresAsTheFormatDefines) {
  const std::string places = "1 0 0\n2 3.2 4.4\n";  // sqrt(29.6) = 5.44 apart.
  EXPECT_EQ(costs(plane("EUC_2D", places))[0][1], 5);
  EXPECT_EQ(costs(plane("CEIL_2D", places))[0][1], 6);
  EXPECT_EQ(costs(plane("MAN_2D", places))[0][1], 8);
  EXPECT_EQ(costs(plane("MAX_2D", places))[0][1], 4);
  EXPECT_EQ(costs(plane("ATT", places))[0][1], 2);  // sqrt(2.96) = 1.72, rounded up.
  // The equator's quarter, as 90 deg of longitude on the format's own sphere.
  EXPECT_EQ(costs(plane("GEO", "1 0 0\n2 0 90\n"))[0][1], 10020);
  // Half a degree is written as thirty minutes.
  EXPECT_EQ(costs(plane("GEO", "1 0.30 0\n2 0 0\n"))[0][1], 56);
}

TEST(Tsplib, TakesNodesInAnyOrder) {
  EXPECT_EQ(costs("DIMENSION: 3\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n"
                  "3 0 30\n\n1 0 0\r\n2 +1e1 0.0\n"),
            costs("DIMENSION: 3\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n"
                  "1 0 0\n2 10 0\n3 0 30\nEOF\nafter the end: nothing is read\n"));
}

// The symmetric matrix 0 1 2 3 / 1 0 4 5 / 2 4 0 6 / 3 5 6 0, however it is listed.
TEST(Tsplib, ReadsEveryFormatOfListedWeights) {
  const std::vector<std::pair<std::string, std::string>> listings{
      {"FULL_MATRIX", "0 1 2 3 1 0 4 5 2 4 0 6 3 5 6 0"},
      {"UPPER_ROW", "1 2 3 4 5 6"},
      {"LOWER_ROW", "1 2 4 3 5 6"},
      {"UPPER_DIAG_ROW", "0 1 2 3 0 4 5 0 6 0"},
      {"LOWER_DIAG_ROW", "0 1 0 2 4 0 3 5 6 0"},
      {"UPPER_COL", "1 2 4 3 5 6"},
      {"LOWER_COL", "1 2 3 4 5 6"},
      {"UPPER_DIAG_COL", "0 1 0 2 4 0 3 5 6 0"},
      {"LOWER_DIAG_COL", "0 1 2 3 0 4 5 0 6 0"}};
  for (const auto& [format, numbers] : listings)
    EXPECT_THAT(costs("DIMENSION: 4\nEDGE_WEIGHT_TYPE: EXPLICIT\nEDGE_WEIGHT_FORMAT: " + format +
                      "\nEDGE_WEIGHT_SECTION\n" + numbers + "\nEOF\n"),
                ElementsAre(ElementsAre(0, 1, 2, 3), ElementsAre(1, 0, 4, 5),
                            ElementsAre(2, 4, 0, 6), ElementsAre(3, 5, 6, 0)))
        << format;
}

TEST(Tsplib, ReadsOneWayCostsAndPassesOverDisplayData) {
  const LoadedTsp loaded = parse_tsp(
      "TYPE: ATSP\nDIMENSION: 2\nEDGE_WEIGHT_TYPE: EXPLICIT\nEDGE_WEIGHT_FORMAT: FULL_MATRIX\n"
      "DISPLAY_DATA_TYPE: TWOD_DISPLAY\nDISPLAY_DATA_SECTION\n1 5 5\n2 7 7\n"
      "EDGE_WEIGHT_SECTION\n0 3\n4 0\n",
      "folder/one_way.atsp");
  ASSERT_TRUE(loaded.errors.empty()) << loaded.errors.front().text();
  EXPECT_EQ(loaded.tsp.name, "one_way");
  EXPECT_THAT(loaded.tsp.problem.cost, ElementsAre(ElementsAre(0, 3), ElementsAre(4, 0)));
  EXPECT_TRUE(loaded.tsp.problem.closed);
}

struct Slip {
  const char* name;
  std::string text;
  std::string where;
  std::string said;
};

class TsplibErrors : public testing::TestWithParam<Slip> {};

TEST_P(TsplibErrors, NameLineFieldValueAndRemedy) {
  const std::string told = error(GetParam().text);
  EXPECT_THAT(told, StartsWith(GetParam().where + ": "));
  EXPECT_THAT(told, HasSubstr(GetParam().said));
}

const std::string kListed = "DIMENSION: 3\nEDGE_WEIGHT_TYPE: EXPLICIT\n";

INSTANTIATE_TEST_SUITE_P(
    All, TsplibErrors,
    testing::Values(
        Slip{"empty", "", "t.tsp", "EDGE_WEIGHT_TYPE: is missing; add a line"},
        Slip{"no_dimension", "EDGE_WEIGHT_TYPE: GEO\n", "t.tsp:1:1", "DIMENSION: is missing"},
        Slip{"key", "NAME: a\nCAPACITY: 3\n", "t.tsp:2:1", "'CAPACITY': not a key of a TSP file"},
        Slip{"twice", "NAME: a\n\nNAME: b\n", "t.tsp:3:1", "NAME: given twice, first in line 1"},
        Slip{"type", "TYPE: CVRP\n", "t.tsp:1:1", "TYPE: 'CVRP' is not supported; use TSP or ATSP"},
        Slip{"section", "TOUR_SECTION\n1 2 3\n", "t.tsp:1:1", "'TOUR_SECTION' is neither"},
        Slip{"dimension", "DIMENSION: 3x\nNODE_COORD_SECTION\n", "t.tsp:1:1",
             "DIMENSION: '3x' is not a whole number from 1 to 4000"},
        Slip{"huge", "EDGE_WEIGHT_TYPE: GEO\nDIMENSION: 85900\n", "t.tsp:2:1", "from 1 to 4000"},
        Slip{"metric", "DIMENSION: 1\nEDGE_WEIGHT_TYPE: XRAY1\n", "t.tsp:2:1",
             "EDGE_WEIGHT_TYPE: 'XRAY1' is not supported; use one of EUC_2D, MAN_2D"},
        Slip{"format", kListed + "EDGE_WEIGHT_FORMAT: FUNCTION\n", "t.tsp:3:1",
             "EDGE_WEIGHT_FORMAT: 'FUNCTION' is not supported; use one of FULL_MATRIX"},
        Slip{"coordinate", plane("EUC_2D", "1 0 0\n2 0 1o\n"), "t.tsp:5:5",
             "NODE_COORD_SECTION: second coordinate: '1o' is not a number"},
        Slip{"short_line", plane("EUC_2D", "1 0\n"), "t.tsp:4:4", "'' is not a number"},
        Slip{"too_far", plane("EUC_2D", "1 0 1e300\n"), "t.tsp:4:5", "'1e300'"},
        Slip{"three_d", plane("EUC_2D", "1 0 1 2\n"), "t.tsp:4:1", "three dimensions"},
        Slip{"node", plane("EUC_2D", "3 0 1\n"), "t.tsp:4:1", "node 3 is not one of 1 to 2"},
        Slip{"node_twice", plane("EUC_2D", "1 0 1\n1 0 2\n"), "t.tsp:5:1", "node 1 is given twice"},
        Slip{"too_few", plane("EUC_2D", "1 0 1\n"), "t.tsp:4:1", "has 1 nodes, DIMENSION says 2"},
        Slip{"no_places", kHead + "DIMENSION: 2\nEDGE_WEIGHT_TYPE: GEO\n", "t.tsp:4:1",
             "NODE_COORD_SECTION: is missing; EDGE_WEIGHT_TYPE GEO needs it"},
        Slip{"weights", kListed + "EDGE_WEIGHT_FORMAT: UPPER_ROW\nEDGE_WEIGHT_SECTION\n1 2\n",
             "t.tsp:4:1", "has 2 numbers; UPPER_ROW of 3 nodes needs 3"},
        Slip{"negative", kListed + "EDGE_WEIGHT_SECTION\n1 -2 3\n", "t.tsp:4:1",
             "'-2' is negative"}),
    [](const auto& slip) { return std::string(slip.param.name); });

TEST(Tsplib, FileThatIsMissingIsNamed) {
  const LoadedTsp loaded = load_tsp("nowhere/there.tsp");
  ASSERT_EQ(loaded.errors.size(), 1u);
  EXPECT_THAT(loaded.errors[0].text(), HasSubstr("nowhere/there.tsp"));
}

}  // namespace
}  // namespace tools
