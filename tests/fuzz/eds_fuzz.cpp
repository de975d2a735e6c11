// Device descriptions come from anywhere: they load or every error has a text.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/eds.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto read = drivers::eds::parse(text, "fuzz.eds");
  if (!read) {
    if (read.error().empty() || read.error().size() > 51) std::abort();
    for (const auto& error : read.error())
      if (error.line < 1 || error.remedy.empty()) std::abort();
    return 0;
  }
  for (const auto& [at, entry] : read->parts)
    if (read->find(at) != &entry || !read->objects.contains(at.index)) std::abort();
  return 0;
}
