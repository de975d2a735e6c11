// What must be known about a text before a TOML parser sees it.
#pragma once

#include <string>
#include <vector>

namespace mission {

struct TomlError {
  int line{};    // From 1.
  int column{};  // From 1, in characters.
  std::string message;
};

// The first character of each line that is not UTF-8, or not ASCII although it stands outside
// quotes and comments: TOML allows neither, and toml++ 3.3 looks such letters up in a table that
// does not hold them all (github.com/marzer/tomlplusplus/issues/295).
std::vector<TomlError> strange_characters(const std::vector<std::string>& lines);

}  // namespace mission
