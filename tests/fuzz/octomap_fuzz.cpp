// Voxel maps are outside bytes once they lie in a folder: none may crash the reader, and one that
// it accepts can be written again and gives the same map.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "mission/octomap_io.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto map = mission::parse_octomap(bytes, "fuzz.ot");
  if (!map || map->grid.size() > 1'000'000) return 0;
  std::size_t nodes{};
  const std::string again = mission::octomap_bytes(
      map->grid, [&map](planning::Voxel v) { return map->at(v); }, nodes);
  const auto back = mission::parse_octomap(again, "again.ot");
  if (!back || back->states != map->states) std::abort();
  return 0;
}
