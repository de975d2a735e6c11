// Every fault of every device, once: what the operator reads, whether the robot is held, and
// whether the mission is completed when the fault has gone.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tests/dst/rig/mission.hpp"

namespace dst {

struct Cell {
  std::string_view role, fault;
  // One of the names that must have been told, as Outcome::named has them; empty: the fault changes
  // nothing that anybody could tell, and must change nothing else.
  std::string_view named;
  bool held{};
};

const std::vector<Cell>& matrix();

// The cell's fault from the robot's start on the way for a while, in a quiet yard.
Outcome run_cell(const Cell& cell);

// Why the outcome is not as the cell expects; empty: it is.
std::string objection(const Cell& cell, const Outcome& outcome);

// "imu      garbage     held   4 scans in 123 s   imu: unreadable; ..."
std::string row(const Cell& cell, const Outcome& outcome);

}  // namespace dst
