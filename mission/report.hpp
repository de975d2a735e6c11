// The run for people: one HTML file that needs no network, no script and no other file.
#pragma once

#include <string>

#include "mission/record.hpp"
#include "mission/summary.hpp"

namespace mission {

// Draws whatever the record holds: also of a run that ended early, or of a plan without scans. The
// text is XML as well (every tag closed), refers to nothing outside itself, follows the reader's
// light or dark preference and prints on A4. The same record gives the same bytes.
std::string report_html(const RunRecord& record, const ProductFacts& products);

}  // namespace mission
