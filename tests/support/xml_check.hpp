// A strict, small judge of XML: enough to say that a page has every tag closed and every name
// escaped.
#pragma once

#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace test {

// Empty when the text is a well-formed element (after an optional <!DOCTYPE ...>), else what is
// wrong and where. Knows elements, quoted attributes, comments and the five entities plus &#N;.
class XmlCheck {
 public:
  static std::string problem_in(std::string_view text) {
    XmlCheck check(text);
    return check.run();
  }

 private:
  explicit XmlCheck(std::string_view text) : text_(text) {}

  std::string run() {
    if (text_.starts_with("<!DOCTYPE")) at_ = text_.find('>') + 1;
    bool any = false;
    while (at_ < text_.size()) {
      const bool outside = open_.empty();
      if (text_[at_] == '<') {
        if (outside && any) return problem("a second root element");
        any = true;
        if (std::string p = tag(); !p.empty()) return p;
      } else if (outside && !is_space(text_[at_])) {
        return problem("text outside the root element");
      } else if (std::string p = character("<>"); !p.empty()) {
        return p;
      }
    }
    return open_.empty() ? (any ? "" : "nothing") : "never closed: " + open_.back();
  }

  static bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
  static bool is_name(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == ':';
  }

  std::string problem(const std::string& what) const {
    return what + " at " + std::to_string(at_) + ": " +
           std::string(text_.substr(at_ > 30 ? at_ - 30 : 0, 60));
  }

  std::string name() {
    const std::size_t from = at_;
    while (at_ < text_.size() && is_name(text_[at_])) ++at_;
    return std::string(text_.substr(from, at_ - from));
  }
  void spaces() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }
  bool take(std::string_view token) {
    if (!text_.substr(at_).starts_with(token)) return false;
    at_ += token.size();
    return true;
  }

  std::string tag() {
    if (take("<!--")) {
      at_ = text_.find("-->", at_);
      return at_ == std::string_view::npos ? "comment never ends" : (at_ += 3, "");
    }
    if (take("</")) {
      const std::string closed = name();
      if (open_.empty() || open_.back() != closed) return problem("closes " + closed);
      open_.pop_back();
      return take(">") ? "" : problem("no > after " + closed);
    }
    take("<");
    const std::string opened = name();
    if (opened.empty()) return problem("a < that begins no tag");
    if (std::string p = attributes(); !p.empty()) return p;
    if (take("/>")) return "";
    open_.push_back(opened);
    return take(">") ? "" : problem("no > after " + opened);
  }

  std::string attributes() {
    std::vector<std::string> seen;
    while (true) {
      spaces();
      const std::string key = name();
      if (key.empty()) return "";
      for (const std::string& other : seen) {
        if (other == key) return problem("attribute twice: " + key);
      }
      seen.push_back(key);
      if (!take("=\"")) return problem("attribute without a quoted value: " + key);
      while (at_ < text_.size() && text_[at_] != '"') {
        if (std::string p = character("<"); !p.empty()) return p;
      }
      if (!take("\"")) return problem("value never ends: " + key);
    }
  }

  std::string character(std::string_view forbidden) {
    const char c = text_[at_];
    if (static_cast<unsigned char>(c) < 0x20 && !is_space(c)) return problem("control character");
    // A > in text is allowed by the standard, but is a sign of something not escaped.
    if (forbidden.find(c) != std::string_view::npos && !in_style()) return problem("not escaped");
    ++at_;
    if (c != '&') return "";
    for (const std::string_view entity : {"amp;", "lt;", "gt;", "quot;", "apos;"}) {
      if (take(entity)) return "";
    }
    if (!take("#")) return problem("unknown entity");
    const std::string digits = name();
    return !digits.empty() && take(";") ? "" : problem("broken character reference");
  }

  bool in_style() const { return !open_.empty() && open_.back() == "style"; }

  std::string_view text_;
  std::size_t at_ = 0;
  std::vector<std::string> open_;
};

}  // namespace test
