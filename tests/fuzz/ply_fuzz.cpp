// Clouds are outside bytes once they lie in a folder: none may crash the reader, and one that it
// accepts has a point for every twelve bytes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "mission/ply.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto cloud = mission::parse_ply(bytes, "fuzz.ply");
  if (cloud && cloud->W_points_m.size() * 12 > size) std::abort();
  if (!cloud && cloud.error().text().empty()) std::abort();
  return 0;
}
