// EDS files as text: sections of KEY=VALUE lines, each with its place.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "drivers/eds.hpp"

namespace drivers::eds {

struct Value {
  std::string text;
  int line{};
};

struct Section {
  int line{};
  std::map<std::string, Value> values;  // Keys in lower case.

  const Value* find(const std::string& key) const;
};

// Section names in lower case. Blank lines and lines that begin with ';' or '#' are comments.
class Text {
 public:
  Text(std::string_view text, std::string_view file);

  const std::map<std::string, Section>& sections() const { return sections_; }
  const Section* find(const std::string& name) const;
  const std::string& file() const { return file_; }

  // Collects what is wrong, up to a bound.
  void refuse(int line, std::string field, std::string value, std::string remedy);
  const Errors& errors() const { return errors_; }

 private:
  void read_line(std::string_view line, int number);

  std::string file_;
  std::map<std::string, Section> sections_;
  Section* section_ = nullptr;
  std::string section_name_;
  Errors errors_;
};

std::string lower(std::string_view text);
std::string_view trimmed(std::string_view text);

// 31, 0x1F, 037 (octal, as in C), -5, $NODEID, $NODEID+0x180, 0x180+$NODEID.
std::optional<Number> parse_number(std::string_view text);

}  // namespace drivers::eds
