// Clouds that other programs wrote: none may crash the reader or make it take more memory than the
// file could hold, and what it refuses it explains.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "nav/registration/cloud_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto cloud = nav::parse_cloud(bytes, "fuzz");
  // A point takes three bytes at least; packed ones may take a hundredth of that.
  if (cloud && (cloud->empty() || cloud->size() > 100 * size)) std::abort();
  if (!cloud && cloud.error().text().size() < sizeof "fuzz: ") std::abort();
  return 0;
}
