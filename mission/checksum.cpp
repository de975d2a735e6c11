#include "mission/checksum.hpp"

#include <bit>
#include <cstring>

namespace mission {
namespace {

static_assert(std::endian::native == std::endian::little);

// One to one in the word for any value before, and the other way round.
std::uint64_t mixed(std::uint64_t value, std::uint64_t word) {
  return std::rotl((value ^ word) * 0xD6E8FEB86659FD93, 29) + 0xA0761D6478BD642F;
}

}  // namespace

void Checksum::add(std::string_view bytes) {
  const std::size_t whole = bytes.size() / 8 * 8;
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < whole; i += 8) {
    std::memcpy(&word, bytes.data() + i, 8);
    value_ = mixed(value_, word);
  }
  word = 0;
  if (whole < bytes.size()) std::memcpy(&word, bytes.data() + whole, bytes.size() - whole);
  value_ = mixed(mixed(value_, word), bytes.size());
}

std::uint64_t checksum_of(std::string_view bytes) {
  Checksum checksum;
  checksum.add(bytes);
  return checksum.value();
}

}  // namespace mission
