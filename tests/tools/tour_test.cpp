// `vantage tour` as a person or a script runs it.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/tools/vantage_test.hpp"

namespace {

using test::Outcome;
using testing::HasSubstr;

class Tour : public test::VantageTest {};

constexpr std::array<std::array<int, 2>, 7> kPlaces{
    {{0, 0}, {90, 10}, {20, 80}, {70, 75}, {45, 5}, {5, 40}, {60, 40}}};

double length_of(std::size_t a, std::size_t b) {
  return std::floor(std::hypot(kPlaces[a][0] - kPlaces[b][0], kPlaces[a][1] - kPlaces[b][1]) + 0.5);
}

// The shortest closed tour, by asking every order.
double shortest() {
  std::array<std::size_t, kPlaces.size()> order{};
  std::iota(order.begin(), order.end(), 0u);
  double best = 1e9;
  do {
    double length = 0;
    for (std::size_t i = 0; i < order.size(); ++i)
      length += length_of(order[i], order[(i + 1) % order.size()]);
    best = std::min(best, length);
  } while (std::next_permutation(order.begin() + 1, order.end()));
  return best;
}

TEST_F(Tour, IsTheShortestThatAnyOrderGives) {
  std::string text =
      "NAME : seven\nTYPE : TSP\nDIMENSION : 7\nEDGE_WEIGHT_TYPE : EUC_2D\n"
      "NODE_COORD_SECTION\n";
  for (std::size_t i = 0; i < kPlaces.size(); ++i)
    text += std::to_string(i + 1) + " " + std::to_string(kPlaces[i][0]) + " " +
            std::to_string(kPlaces[i][1]) + "\n";
  const auto file = write("seven.tsp", text + "EOF\n").string();
  const Outcome outcome = run("tour --json " + file);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("length").to_number<double>(), shortest());
  EXPECT_TRUE(answer.at("proven").as_bool());
  double length = 0;
  const auto& order = answer.at("order").as_array();
  ASSERT_EQ(order.size(), kPlaces.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    length += length_of(order[i].to_number<std::size_t>() - 1,
                        order[(i + 1) % order.size()].to_number<std::size_t>() - 1);
  EXPECT_EQ(length, shortest());
  EXPECT_EQ(run("tour --start 8 " + file).code, 2);
}

TEST_F(Tour, ErrorsAreToldAsEveryCommandTellsThem) {
  const auto file = write("wrong.tsp", "NAME : x\nTYPE : TSP\nDIMENSION : two\n").string();
  const Outcome outcome = run("tour --json " + file);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("wrong.tsp:3"));
  const auto answer = outcome.json();
  EXPECT_FALSE(answer.at("ok").as_bool());
  EXPECT_EQ(answer.at("errors").at(0).at("line").to_number<int>(), 3);
}

}  // namespace
