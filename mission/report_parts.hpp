// The parts that report_html puts together. All pure: a record in, HTML out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mission/record.hpp"
#include "mission/report_facts.hpp"

namespace mission::report {

// The record with what every part needs of it, worked out once.
struct Facts {
  const RunRecord& record;
  std::vector<AreaFacts> areas;  // One per RunRecord::plans.
  Coverage all;

  explicit Facts(const RunRecord& run);
  // As though every station of the tours were scanned.
  static Facts as_planned(const RunRecord& run);

 private:
  Facts(const RunRecord& run, std::vector<AreaFacts> facts);
};

std::string style();                       // report_style.cpp
std::string site_map(const Facts& facts);  // report_map.cpp: SVG and legend
// The same as an SVG file of its own.
std::string site_map_svg(const Facts& facts, const std::string& title, const std::string& subtitle);
std::string voxel_curves(const RunRecord& run);      // report_charts.cpp: totals, and gain per scan
std::string pose_error_chart(const RunRecord& run);  // report_charts.cpp; empty without truth

// report_tables.cpp
std::string voxel_table(const RunRecord& run);  // The columns of the paper's Tables I and II.
std::string coverage_table(const Facts& facts);
std::string gap_tables(const Facts& facts);
std::string overlap_table(const Facts& facts);  // With the weak links below; empty without a plan.
std::string station_table(const Facts& facts);
std::string scan_table(const RunRecord& run);
std::string registration_table(const RunRecord& run);  // Empty: none was registered.
std::string pose_table(const RunRecord& run);
std::string dropped_table(const RunRecord& run);

}  // namespace mission::report
