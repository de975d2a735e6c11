// Lengths, areas and places as messages say them.
#pragma once

#include <cstdio>
#include <string>

#include "nav/geometry.hpp"

namespace nav {

// "12.50" with the given number of decimals.
inline std::string decimal(double value, int decimals = 2) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

inline std::string in_m(double length_m) {
  return decimal(length_m) + " m";
}
inline std::string in_m2(double area_m2) {
  return decimal(area_m2) + " m2";
}
inline std::string in_words(PointMm p) {
  return "(" + decimal(to_m(p).x()) + ", " + decimal(to_m(p).y()) + ")";
}
inline std::string in_deg(double angle_deg) {
  return decimal(angle_deg, 1) + " deg";
}
// "1 vertex", "3 vertices"
inline std::string counted(int n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

}  // namespace nav
