// Voxel maps are outside bytes once they lie in a folder: none may crash the reader, and one that
// it accepts can be written again, either way, and gives the same map.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "mission/octomap_io.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto read = mission::parse_octomap(bytes, "fuzz.ot");
  if (!read || read->map.grid().size() > 1'000'000) return 0;
  for (const auto format : {mission::OctomapFormat::full, mission::OctomapFormat::binary}) {
    const auto back = mission::parse_octomap(mission::octomap_bytes(read->map, format), "again");
    if (!back || !back->ours || back->map != read->map) std::abort();
  }
  return 0;
}
