#include "mission/toml_scan.hpp"

#include <string_view>

namespace mission {
namespace {

// Bytes of the UTF-8 sequence that `text` starts with; 0 when it is none (RFC 3629: no overlong
// forms, no surrogates, nothing above U+10FFFF).
std::size_t sequence_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const unsigned second = byte(1);
  const bool bad = (first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
                   (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f);
  return bad ? 0 : length;
}

// Follows quotes and comments through a text, character by character.
class Quotes {
 public:
  bool outside() const { return quote_.empty() && !comment_; }

  // Takes what stands at the front of `rest`; returns how many bytes that is.
  std::size_t step(std::string_view rest) {
    if (comment_) return 1;
    if (!quote_.empty()) return step_inside(rest);
    if (rest[0] == '#') comment_ = true;
    if (rest[0] != '"' && rest[0] != '\'') return 1;
    quote_ = rest.substr(0, 3) == std::string(3, rest[0]) ? std::string(3, rest[0])
                                                          : std::string(1, rest[0]);
    return quote_.size();
  }

  void end_line() {
    comment_ = false;
    if (quote_.size() == 1) quote_.clear();  // The parser will object to it.
  }

 private:
  std::size_t step_inside(std::string_view rest) {
    if (rest[0] == '\\' && quote_[0] == '"' && rest.size() > 1 && (rest[1] & 0x80) == 0) return 2;
    if (!rest.starts_with(quote_)) return 1;
    const auto length = quote_.size();
    quote_.clear();
    return length;
  }

  std::string quote_;  // The quote that will end the text: ", ', three of them, or none.
  bool comment_ = false;
};

// 0 without one.
TomlError strange_in(std::string_view line, Quotes& quotes) {
  TomlError error;
  for (int column = 1; !line.empty(); ++column) {
    const auto length = sequence_length(line);
    if (error.column == 0 && length == 0) error = {0, column, "not UTF-8; save the file as UTF-8"};
    if (error.column == 0 && length > 1 && quotes.outside())
      error = {0, column, "not TOML: only ASCII stands outside quotes; put it in quotes"};
    const auto step = length > 1 ? length : quotes.step(line);
    column += step > length && length == 1 ? static_cast<int>(step) - 1 : 0;
    line.remove_prefix(step);
  }
  quotes.end_line();
  return error;
}

}  // namespace

std::vector<TomlError> strange_characters(const std::vector<std::string>& lines) {
  std::vector<TomlError> errors;
  Quotes quotes;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    TomlError error = strange_in(lines[i], quotes);
    if (error.column == 0) continue;
    error.line = static_cast<int>(i) + 1;
    errors.push_back(error);
  }
  return errors;
}

}  // namespace mission
