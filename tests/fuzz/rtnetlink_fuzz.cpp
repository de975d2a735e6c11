// Whatever comes from the kernel's socket: it ends, in no more interfaces than there are headers.
#include <cstdlib>

#include "drivers/rtnetlink_codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto interfaces = drivers::rtnetlink::decode({data, size});
  if (interfaces.size() > size / 16) std::abort();
  for (const auto& interface : interfaces)
    if (interface.name.size() > size || interface.kind.size() > size) std::abort();
  return 0;
}
