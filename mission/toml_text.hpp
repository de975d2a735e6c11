// TOML text to a table, going on after syntax errors so that one run can name them all.
#pragma once

// The library's own assertions stay on and become exceptions: some broken texts ("[&") run into
// them (github.com/marzer/tomlplusplus/issues/294). Include it only from here.
#include <stdexcept>
namespace mission {
struct TomlAssertion : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] inline void toml_assertion(const char* text) {
  throw TomlAssertion(text);
}
}  // namespace mission
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(holds) ((holds) ? void() : ::mission::toml_assertion(#holds))
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mission/toml_scan.hpp"

namespace mission {

struct TomlText {
  std::optional<toml::table> table;  // Empty when not even a part can be read.
  std::vector<TomlError> errors;
};

// A line that cannot be read, or is not UTF-8, is left out, with the whole table when the line is
// its [header]. Texts over 256 KiB, or with keys nested more than 64 deep, are refused.
TomlText parse_toml(std::string_view text);

}  // namespace mission
