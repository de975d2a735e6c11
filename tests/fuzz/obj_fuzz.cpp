#include <cstdint>
#include <cstdlib>
#include <string>

#include "sim/mesh.hpp"

// Any bytes: either a usable mesh or an error that names a line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = sim::parse_obj({reinterpret_cast<const char*>(data), size}, "fuzz.obj");
  if (parsed.errors.empty() == parsed.mesh.triangles.empty()) std::abort();
  for (const std::string& error : parsed.errors)
    if (!error.starts_with("fuzz.obj:")) std::abort();
  for (const auto& triangle : parsed.mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (!parsed.mesh.W_vertices_m.at(vertex).allFinite()) std::abort();
  return 0;
}
