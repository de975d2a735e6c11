// Where in a JSON text a value stands: parsers give the value or the place, messages need both.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace mission {

// One step from a value to one inside it: a member's key or an element's index.
using JsonStep = std::variant<std::string, std::size_t>;

class JsonPlaces {
 public:
  // The text must outlive this.
  explicit JsonPlaces(std::string_view text);

  // "12:5": line and column of a byte, from 1; columns count characters of UTF-8.
  std::string line_column(std::size_t offset) const;

  // Offset of the value at the end of the path, or of the last value on it that exists. The text
  // must be valid JSON; of members with the same key the last is meant.
  std::size_t find(const std::vector<JsonStep>& path) const;

  // Offsets of the elements of the array at `offset`; empty when there is no array.
  std::vector<std::size_t> elements(std::size_t offset) const;

 private:
  static constexpr std::size_t kStride = 1024;

  std::size_t characters_before(std::size_t offset) const;
  std::size_t skip_space(std::size_t at) const;
  std::size_t skip_string(std::size_t at) const;
  std::size_t skip_value(std::size_t at) const;
  std::size_t member(std::size_t object, const std::string& key) const;

  std::string_view text_;
  std::vector<std::size_t> line_starts_{0};
  // Characters before every kStride-th byte: programs write whole maps on one line.
  std::vector<std::size_t> characters_;
};

}  // namespace mission
