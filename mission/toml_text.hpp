// TOML text to a table, going on after syntax errors so that one run can name them all.
#pragma once

#ifndef TOML_EXCEPTIONS
#define TOML_EXCEPTIONS 0
#endif
#include <toml++/toml.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mission {

struct TomlError {
  int line{};
  int column{};
  std::string message;
};

struct TomlText {
  std::optional<toml::table> table;  // Empty when not even a part can be read.
  std::vector<TomlError> errors;
};

// A line that cannot be read is left out, with the whole table when the line is its [header].
// Texts over 256 KiB, or with keys nested more than 64 deep, are refused.
TomlText parse_toml(std::string_view text);

}  // namespace mission
