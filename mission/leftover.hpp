// What Phase II leaves, in words and figures: for the end's reason, the summary and the report.
#pragma once

#include <boost/json/value.hpp>
#include <optional>
#include <string>

#include "mission/record.hpp"

namespace mission {

// "proven: even if everything unseen were air, no view would see more than 12 unseen voxels of
// the box"
std::string in_words(const Leftover& left);

// Seen-occupied voxels as a share of these and the boundary unseen ones that some cell can see:
// what the robot could have done. Empty when there are none.
std::optional<double> seen_of_visible(const VoxelCounts& counts, const Leftover& left);

// Both null when the run has none: "leftover", and "density" without a goal.
boost::json::value leftover_json(const RunRecord& record);
boost::json::value density_json(const DensityFacts& density);

// Sentences for the report; empty without anything to say.
std::string leftover_text(const RunRecord& record);

}  // namespace mission
