// Maps are outside bytes: none may crash the reader, the repair or the free space, and what comes
// through without errors keeps the promises of nav/polygons.hpp.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "mission/site_io.hpp"
#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "nav/rings.hpp"

namespace {

constexpr std::size_t kBytesMax = 16 << 10;
constexpr std::size_t kVerticesMax = 400;

void require(bool holds) {
  if (!holds) std::abort();
}

std::size_t vertices(const nav::RawSite& site) {
  std::size_t count = 0;
  for (const auto& feature : site.features) {
    for (const auto& polygon : feature.polygons_m) {
      for (const auto& ring : polygon) count += ring.size();
    }
    for (const auto& line : feature.lines_m) count += line.size();
  }
  return count;
}

void require_clean(const nav::Polygons& polygons) {
  require(nav::contacts(nav::edges(polygons)).empty());
  for (const nav::Polygon& polygon : polygons) {
    require(nav::twice_area_mm2(polygon.outer) > 0);
    for (const nav::Ring& hole : polygon.holes) require(nav::twice_area_mm2(hole) < 0);
  }
}

void check_map(const nav::SiteMap& map) {
  require(!map.regions.empty());
  require_clean(map.boundary);
  require_clean(map.obstacles);
  require_clean(map.keep_out);
  for (const nav::SegmentMm& edge : nav::edges(map.obstacles)) nav::on_target(map, edge);
  for (const nav::FreeArea& area : nav::free_areas(map, 0.5, 0.01)) {
    require_clean(area.standable);
    require(!area.drivable.empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > kBytesMax) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const mission::LoadedSite site = mission::parse_site(text, "fuzz.geojson");
  if (vertices(site.raw) > kVerticesMax) return 0;
  const nav::RepairedSite repaired = nav::repair_site(site.raw, 30);
  if (site.errors.empty() && repaired.errors.empty()) check_map(repaired.map);
  return 0;
}
