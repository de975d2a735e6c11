#include "mission/json_places.hpp"

#include <algorithm>

namespace mission {
namespace {

constexpr std::size_t kNowhere = std::string_view::npos;

// UTF-8: the further bytes of a character are 10xxxxxx.
bool begins_character(char c) {
  return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
}

}  // namespace

JsonPlaces::JsonPlaces(std::string_view text) : text_(text) {
  std::size_t characters = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i % kStride == 0) characters_.push_back(characters);
    if (begins_character(text[i])) ++characters;
    if (text[i] == '\n') line_starts_.push_back(i + 1);
  }
}

std::size_t JsonPlaces::characters_before(std::size_t offset) const {
  if (characters_.empty()) return 0;
  const std::size_t block = std::min(offset / kStride, characters_.size() - 1);
  std::size_t characters = characters_[block];
  for (std::size_t i = block * kStride; i < offset; ++i) {
    if (begins_character(text_[i])) ++characters;
  }
  return characters;
}

std::string JsonPlaces::line_column(std::size_t offset) const {
  offset = std::min(offset, text_.size());
  const auto after = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const std::size_t column = characters_before(offset) - characters_before(*(after - 1)) + 1;
  return std::to_string(after - line_starts_.begin()) + ":" + std::to_string(column);
}

std::size_t JsonPlaces::find(const std::vector<JsonStep>& path) const {
  std::size_t at = skip_space(0);
  for (const JsonStep& step : path) {
    std::size_t next = kNowhere;
    if (const auto* key = std::get_if<std::string>(&step)) {
      next = member(at, *key);
    } else {
      const std::vector<std::size_t> all = elements(at);
      const std::size_t index = std::get<std::size_t>(step);
      if (index < all.size()) next = all[index];
    }
    if (next == kNowhere) break;
    at = next;
  }
  return at;
}

std::vector<std::size_t> JsonPlaces::elements(std::size_t offset) const {
  std::vector<std::size_t> all;
  if (offset >= text_.size() || text_[offset] != '[') return all;
  std::size_t at = skip_space(offset + 1);
  while (at < text_.size() && text_[at] != ']') {
    all.push_back(at);
    at = skip_space(skip_value(at));
    if (at < text_.size() && text_[at] == ',') at = skip_space(at + 1);
  }
  return all;
}

std::size_t JsonPlaces::member(std::size_t object, const std::string& key) const {
  std::size_t found = kNowhere;
  if (object >= text_.size() || text_[object] != '{') return found;
  std::size_t at = skip_space(object + 1);
  while (at < text_.size() && text_[at] != '}') {
    const std::size_t key_end = skip_string(at);
    const std::string_view name = text_.substr(at + 1, key_end - at - 2);
    at = skip_space(skip_space(key_end) + 1);  // Past the colon.
    if (name == key) found = at;
    at = skip_space(skip_value(at));
    if (at < text_.size() && text_[at] == ',') at = skip_space(at + 1);
  }
  return found;
}

std::size_t JsonPlaces::skip_space(std::size_t at) const {
  return std::min(text_.find_first_not_of(" \t\r\n", at), text_.size());
}

std::size_t JsonPlaces::skip_string(std::size_t at) const {
  for (++at; at < text_.size() && text_[at] != '"'; ++at) {
    if (text_[at] == '\\') ++at;
  }
  return std::min(at + 1, text_.size());
}

std::size_t JsonPlaces::skip_value(std::size_t at) const {
  int depth = 0;
  while (at < text_.size()) {
    const char c = text_[at];
    if (c == '"') {
      at = skip_string(at);
    } else if (c == '[' || c == '{') {
      ++depth;
      ++at;
      continue;
    } else if (c == ']' || c == '}') {
      --depth;
      ++at;
    } else if (depth > 0) {
      ++at;
      continue;
    } else {
      return std::min(text_.find_first_of(" \t\r\n,]}", at), text_.size());
    }
    if (depth <= 0) return at;
  }
  return at;
}

}  // namespace mission
