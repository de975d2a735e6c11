#include "mission/site_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "mission/files.hpp"
#include "mission/geojson.hpp"
#include "mission/suggest.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMapBytesMax = std::size_t{256} << 20;

// Names of the files in the folder with the extension (lower case), sorted.
std::vector<std::string> files_with(const fs::path& folder, std::string_view extension) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::string own = it->path().extension().string();
    std::transform(own.begin(), own.end(), own.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (own == extension) names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

// "" when the folder holds its map.
std::string missing_map(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return fmt::format("{}: no such folder", folder.string());
  if (fs::exists(folder / "footprint.geojson", error)) return "";
  const std::vector<std::string> others = files_with(folder, ".geojson");
  if (others.empty()) {
    return fmt::format("{}: footprint.geojson is missing; draw the site's map there as GeoJSON",
                       folder.string());
  }
  return fmt::format(
      "{}: footprint.geojson is missing; rename the file that is the map ({}), or name the file "
      "instead of the folder",
      folder.string(), listed(others));
}

void find_model(const fs::path& folder, LoadedSite& site) {
  std::error_code error;
  if (fs::exists(folder / "model.obj", error)) {
    site.model_file = folder / "model.obj";
    return;
  }
  const std::vector<std::string> models = files_with(folder, ".obj");
  if (models.size() == 1) site.model_file = folder / models.front();
  if (models.size() > 1) {
    site.errors.push_back(fmt::format("{}: several models ({}); rename the one to use to model.obj",
                                      folder.string(), listed(models)));
  }
}

std::string folder_name(const fs::path& folder) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(folder, error);
  return (error ? folder : whole).filename().string();
}

}  // namespace

LoadedSite load_site(const fs::path& folder) {
  std::error_code error;
  const bool is_file = fs::is_regular_file(folder, error);
  const std::string missing = is_file ? "" : missing_map(folder);
  LoadedSite site;
  if (!missing.empty()) {
    site.errors = {missing};
    return site;
  }
  const fs::path map_file = is_file ? folder : folder / "footprint.geojson";
  const FileResult<std::string> text = read_file(map_file, kMapBytesMax);
  if (text.has_error()) {
    site.errors = {text.error().text()};
    return site;
  }
  site = parse_site(*text, map_file.string());
  if (!is_file) site.raw.name = folder_name(folder);
  site.map_file = map_file;
  find_model(is_file ? folder.parent_path() : folder, site);
  return site;
}

LoadedSite parse_site(std::string_view json, std::string_view file_name) {
  GeoJsonSite read = read_geojson(json, std::string(file_name));
  LoadedSite site;
  site.raw = std::move(read.raw);
  site.origin = read.origin;
  site.raw.name = fs::path(file_name).stem().string();
  site.map_file = fs::path(file_name);
  site.notes = std::move(read.notes);
  site.errors = std::move(read.errors);
  return site;
}

}  // namespace mission
