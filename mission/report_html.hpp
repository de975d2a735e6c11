// Pieces of HTML that is XML as well: every tag closed, every name escaped, no named entities.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mission::html {

// Text for an element or a quoted attribute. Bytes that are not UTF-8, and control characters,
// become U+FFFD.
std::string escaped(std::string_view text);

// One more element: <tag class="...">inner</tag>; inner is HTML already.
std::string element(std::string_view tag, std::string_view inner, std::string_view css_class = {});

// 1,234.5 (digits behind the point as told; a dash for what is not a number).
std::string number(double value, int decimals);
std::string percent(std::optional<double> share);

enum class Align { text, word, right };  // Text may wrap, words and numbers do not.

struct Column {
  std::string title;  // Text, not HTML.
  Align align = Align::right;
};

// A table that scrolls sideways on its own when it is wider than the page.
class Table {
 public:
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  // One cell (HTML) per column.
  void row(const std::vector<std::string>& cells, std::string_view css_class = {});
  bool empty() const { return rows_.empty(); }
  std::string html() const;

 private:
  std::vector<Column> columns_;
  std::string rows_;
};

}  // namespace mission::html
