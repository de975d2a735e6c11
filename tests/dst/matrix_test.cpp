// Every fault of every device has its reaction. `vantage-dst --matrix` prints the table.
#include "tests/dst/rig/matrix.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace dst {

void PrintTo(const Cell& cell, std::ostream* to) {
  *to << cell.role << " " << cell.fault;
}

namespace {

class Matrix : public testing::TestWithParam<Cell> {};

TEST_P(Matrix, AnswersEveryFaultOfEveryDevice) {
  const Cell& cell = GetParam();
  const Outcome outcome = run_cell(cell);
  EXPECT_EQ(objection(cell, outcome), "") << row(cell, outcome);
}

INSTANTIATE_TEST_SUITE_P(Devices, Matrix, testing::ValuesIn(matrix()), [](const auto& param) {
  return std::string(param.param.role) + "_" + std::string(param.param.fault);
});

// Slower than the wheels, it does not make the robot lose its way: it comes home.
TEST(SlowImu, LeavesTheRobotWhereItBelievesToBe) {
  const auto slow = std::ranges::find_if(
      matrix(), [](const Cell& cell) { return cell.role == "imu" && cell.fault == "slow"; });
  ASSERT_NE(slow, matrix().end());
  const Outcome outcome = run_cell(*slow);
  EXPECT_TRUE(outcome.completed) << outcome.end;
  EXPECT_LT(outcome.from_start_m, 0.1);
}

TEST(MatrixTable, HasEveryFaultOfEveryDevice) {
  std::set<std::pair<std::string_view, std::string_view>> cells;
  for (const Cell& cell : matrix()) cells.emplace(cell.role, cell.fault);
  EXPECT_EQ(cells.size(), std::size(kRoles) * 8);
  for (const Cell& cell : matrix()) {
    EXPECT_EQ(sim::parse_unit_fault(cell.fault).error, "") << cell.fault;
    EXPECT_NE(std::ranges::find(kRoles, cell.role), std::end(kRoles)) << cell.role;
  }
}

}  // namespace
}  // namespace dst
