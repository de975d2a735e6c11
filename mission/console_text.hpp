// Text as a plain terminal takes it. Pure.
#pragma once

#include <string>
#include <string_view>

namespace mission {

// Lines that end with CR LF, none longer than 79 characters: longer ones are broken between words,
// and go on indented by two. What is no printable ASCII becomes '?'. Nothing for nothing.
std::string console_text(std::string_view text);

}  // namespace mission
