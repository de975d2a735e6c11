// "Did you mean": which known names a mistyped one resembles.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mission {

// Fewest insertions, deletions, substitutions and swaps of neighbours that turn a into b (each
// place edited at most once: optimal string alignment).
int edit_distance(std::string_view a, std::string_view b);

// How unlike `typed` is to `known`: 0 when only case, dashes or camel case differ; a missing or
// other unit suffix counts half an edit (range_max -> range_max_m), swapped words 0.7
// (max_range_m), some of its words 1 (grazing_deg -> grazing_max_deg). At least kUnlike when nobody
// would confuse them.
inline constexpr double kUnlike = 1e9;
double unlikeness(std::string_view typed, std::string_view known);

// The known names that `typed` most resembles, best first: those as near as the nearest, at most
// two; empty when none is near.
std::vector<std::string> closest(std::string_view typed, const std::vector<std::string>& known);

// "; did you mean 'a' or 'b'?", or "" for no names.
std::string did_you_mean(const std::vector<std::string>& names);

// "a, b, c"
std::string listed(const std::vector<std::string>& names);

}  // namespace mission
