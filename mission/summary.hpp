// The run in numbers, for programs: summary.json.
#pragma once

#include <boost/json/object.hpp>
#include <cstdint>
#include <optional>

#include "mission/record.hpp"

namespace mission {

// What is known of the files beside the record.
struct ProductFacts {
  std::optional<Eigen::Vector3d> map_ot_offset_m;  // Point in W = point in map.ot + this.
  std::uint64_t cloud_points{};
  double cloud_grid_m{};
  int cloud_doublings{};  // How often the grid was doubled to keep the cloud within its bound.
};

// Units are in the keys, angles in degrees, lengths rounded to 1 mm, frame W. Holds no wall-clock
// times: the same run gives the same summary. What does not apply is null.
boost::json::object summarise(const RunRecord& record, const ProductFacts& products);

}  // namespace mission
