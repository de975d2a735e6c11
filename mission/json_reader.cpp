#include "mission/json_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mission {

namespace json = boost::json;

const char* kind_name(const json::value& value) {
  switch (value.kind()) {
    case json::kind::null:
      return "null";
    case json::kind::bool_:
      return "true or false";
    case json::kind::string:
      return "a text";
    case json::kind::array:
      return "an array";
    case json::kind::object:
      return "an object";
    default:
      return "a number";
  }
}

void Messages::add(std::string text) {
  if (full()) {
    ++more_;
  } else {
    texts_.push_back(std::move(text));
  }
}

std::vector<std::string> Messages::taken() {
  if (more_ > 0) texts_.push_back(fmt::format("... and {} more like these", more_));
  more_ = 0;
  return std::move(texts_);
}

bool JsonReader::parse(json::value& root) {
  json::stream_parser parser;
  boost::system::error_code code;
  const std::size_t read = parser.write_some(text_.data(), text_.size(), code);
  std::size_t at = read;
  if (!code) {
    at = std::min(text_.find_first_not_of(" \t\r\n", read), text_.size());
    if (at < text_.size()) code = json::error::extra_data;
  }
  if (!code) parser.finish(code);
  if (!code) {
    root = parser.release();
    return true;
  }
  const std::string near = at < text_.size() ? fmt::format(" at '{}'", shown(at)) : "";
  errors_.add(fmt::format("{}: this is not valid JSON: {}{}", place(at), code.message(), near));
  return false;
}

// A few characters of the text, on one line.
std::string JsonReader::shown(std::size_t offset) const {
  std::string_view some = text_.substr(offset, 20);
  some = some.substr(0, some.find_first_of("\r\n"));
  std::string plain;
  for (const char c : some) {
    plain += (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) ? '?' : c;
  }
  return plain;
}

std::vector<JsonStep> JsonReader::path_to(const Node& node) {
  std::vector<JsonStep> path;
  for (const Node* at = &node; at->parent; at = at->parent) path.push_back(at->step);
  std::reverse(path.begin(), path.end());
  return path;
}

std::string JsonReader::place(std::size_t offset) const {
  return file_name_ + ":" + places_.line_column(offset);
}

std::string JsonReader::message(const Node& at, const std::string& what) const {
  const std::string label = label_.empty() ? "" : label_ + ": ";
  return place(places_.find(path_to(at))) + ": " + label + what;
}

void JsonReader::say(Messages& messages, const Node& at, const std::string& what) {
  if (messages.full()) {
    messages.add_more();  // Spares finding the place.
  } else {
    messages.add(message(at, what));
  }
}

const json::object* JsonReader::object_at(const Node& node, const char* what) {
  if (node.value.is_object()) return &node.value.get_object();
  error(node, fmt::format("{} must be an object {{...}}, not {}", what, kind_name(node.value)));
  return nullptr;
}

const json::array* JsonReader::array_at(const Node& node, const char* what) {
  if (node.value.is_array()) return &node.value.get_array();
  error(node, fmt::format("{} must be an array [...], not {}", what, kind_name(node.value)));
  return nullptr;
}

std::optional<double> JsonReader::number(const Node& parent, const json::object& object,
                                         const char* key) {
  const json::value* value = object.if_contains(key);
  if (!value || value->is_null()) return std::nullopt;
  boost::system::error_code code;
  const double read = value->is_number() ? value->to_number<double>(code) : 0.0;
  if (value->is_number() && !code && std::isfinite(read)) return read;
  const char* found = value->is_number() ? "one too large to read" : kind_name(*value);
  error({*value, &parent, key}, fmt::format("\"{}\" must be a number, not {}", key, found));
  return std::nullopt;
}

}  // namespace mission
