// Reads a site folder: the map (GeoJSON, see configs/sites/FORMAT.md) and the name of the 3-D
// model.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mission/geojson_crs.hpp"
#include "nav/site_map.hpp"

namespace mission {

// What a map file says, as drawn: nothing repaired, longitudes and latitudes turned into metres.
struct LoadedSite {
  nav::RawSite raw;
  std::optional<GeoOrigin> origin;  // Where W's origin lies on the earth, if the map tells.
  std::filesystem::path map_file;
  std::optional<std::filesystem::path> model_file;  // Empty: the site has no 3-D model.
  std::vector<std::string> notes;   // What was assumed or ignored, "file:line:column: ...".
  std::vector<std::string> errors;  // Not empty: refuse to start. "file:line:column: feature ..."
};

// The map is footprint.geojson in the folder, the model is model.obj or else the only *.obj there.
// A path to a map file means that map and the model beside it. Never throws for what files hold.
LoadedSite load_site(const std::filesystem::path& folder);

// The same from the text of a map; without a model.
LoadedSite parse_site(std::string_view json, std::string_view file_name);

}  // namespace mission
