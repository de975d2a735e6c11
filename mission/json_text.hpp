// JSON as text, the same text for the same values on every machine.
#pragma once

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <string>

#include "hal/values.hpp"

namespace mission {

// On one line, keys in the order they were put in. Doubles have the fewest digits that read back to
// the same double and always look like doubles ("2.0", "1e-07"); what JSON cannot say (infinity,
// not a number) becomes null.
std::string json_line(const boost::json::value& value);

// The same for people: two spaces per level, one member per line; arrays of numbers stay on a line.
std::string json_pretty(const boost::json::value& value);

// To that many decimals, so that people read 12.346 rather than 12.345678901234567.
double rounded(double value, int decimals);

// x_m, y_m and heading_deg, not rounded: for decisions.
boost::json::object exact_json(const hal::Pose2& pose);

}  // namespace mission
