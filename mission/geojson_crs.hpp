// In which coordinates a map is drawn, and turning degrees into metres.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nav/site_map.hpp"

namespace mission {

enum class Crs { local, wgs84 };

// What a "crs" member names: "local", or one of the many names of longitude and latitude on WGS84.
// Empty for anything else.
std::optional<Crs> crs_named(std::string_view name);

// Where W lies on the earth: its origin, degrees and metres above the ellipsoid.
struct GeoOrigin {
  double lon_deg{};
  double lat_deg{};
  double h_m{};
};

// Every coordinate is a possible longitude and latitude, and the map is less than 1 unit wide and
// high: no site in metres is that small.
bool looks_like_degrees(const nav::RawSite& site);

// The first position drawn; empty when there is none.
std::optional<Eigen::Vector2d> first_position(const nav::RawSite& site);

// Replaces longitudes and latitudes (x, y; degrees) by metres east and north in the plane tangent
// at the origin. Returns an error for each feature with a position that is not on the globe.
std::vector<std::string> to_local(nav::RawSite& site, const GeoOrigin& origin);

}  // namespace mission
