// GeoJSON (RFC 7946) as the maps of Vantage use it; the dialect is in configs/sites/FORMAT.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mission/geojson_crs.hpp"
#include "nav/site_map.hpp"

namespace mission {

struct GeoJsonSite {
  nav::RawSite raw;                 // Without a name; in metres.
  std::optional<GeoOrigin> origin;  // Where (0, 0) lies on the earth, if the map tells.
  std::vector<std::string> notes;
  std::vector<std::string> errors;
};

// Never throws for what the text holds. Everything wrong with it is reported at once, except that a
// text that is no JSON has one error.
GeoJsonSite read_geojson(std::string_view text, const std::string& file_name);

}  // namespace mission
