// Whatever a robot file says: an address that reads back as itself, or a text.
#include <cstdlib>
#include <string_view>

#include "drivers/link_address.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = drivers::parse_link_address(text);
  if (const auto* error = std::get_if<drivers::AddressError>(&parsed)) {
    if (error->what.empty()) std::abort();
    return 0;
  }
  const auto& address = std::get<drivers::LinkAddress>(parsed);
  const auto again = drivers::parse_link_address(drivers::to_text(address));
  if (std::get<drivers::LinkAddress>(again) != address) std::abort();
  return 0;
}
