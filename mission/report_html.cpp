#include "mission/report_html.hpp"

#include <fmt/format.h>

#include <cmath>

#include "mission/progress.hpp"

namespace mission::html {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

// Length of the UTF-8 character at the front of the text, 0 when there is none.
std::size_t character_length(std::string_view text) {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  if (first == 0xE0 && byte(1) < 0xA0) return 0;                      // Longer than needed.
  if (first == 0xED && byte(1) >= 0xA0) return 0;                     // A surrogate.
  if (first == 0xEF && byte(1) == 0xBF && byte(2) >= 0xBE) return 0;  // Not a character in XML.
  if (first == 0xF0 && byte(1) < 0x90) return 0;
  if (first == 0xF4 && byte(1) >= 0x90) return 0;
  return length;
}

std::string_view entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

std::string_view css_class_of(Align align) {
  return align == Align::right ? "n" : align == Align::word ? "w" : "";
}

bool is_control(char c) {
  const auto code = static_cast<unsigned char>(c);
  return (code < 0x20 && c != '\n' && c != '\t') || code == 0x7F;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const std::string_view special = entity(text.front());
    if (length == 0 || is_control(text.front())) {
      out += kReplacement;
    } else {
      out += special.empty() ? text.substr(0, length) : special;
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string element(std::string_view tag, std::string_view inner, std::string_view css_class) {
  const std::string attribute = css_class.empty() ? "" : fmt::format(" class=\"{}\"", css_class);
  return fmt::format("<{}{}>{}</{}>", tag, attribute, inner, tag);
}

std::string number(double value, int decimals) {
  if (!std::isfinite(value) || std::abs(value) > 1e15) return "\u2013";
  std::string digits = fmt::format("{:.{}f}", std::abs(value), decimals);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  const bool is_zero = digits.find_first_not_of("0.") == std::string::npos;
  const std::string whole = count_text(std::stoull(digits.substr(0, point)));
  return (value < 0 && !is_zero ? "\u2212" : "") + whole + digits.substr(point);
}

std::string percent(std::optional<double> share) {
  return share ? number(100 * *share, 1) + " %" : "\u2013";
}

void Table::row(const std::vector<std::string>& cells, std::string_view css_class) {
  std::string line;
  for (std::size_t i = 0; i < cells.size() && i < columns_.size(); ++i) {
    line += element("td", cells[i], css_class_of(columns_[i].align));
  }
  rows_ += element("tr", line, css_class) + "\n";
}

std::string Table::html() const {
  std::string head;
  for (const Column& column : columns_) {
    head += element("th", escaped(column.title), css_class_of(column.align));
  }
  return "<div class=\"scroll\"><table><thead><tr>" + head + "</tr></thead>\n<tbody>\n" + rows_ +
         "</tbody></table></div>\n";
}

}  // namespace mission::html
