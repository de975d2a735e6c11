// What readers of JSON files have in common: values with their place, and messages that name it.
#pragma once

#include <boost/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mission/json_places.hpp"

namespace mission {

// "null", "a number", ...
const char* kind_name(const boost::json::value& value);

// The first messages in full, the rest as a number: a broken file of 10,000 features needs no
// 10,000 lines.
class Messages {
 public:
  static constexpr std::size_t kMax = 50;

  bool full() const { return texts_.size() >= kMax; }
  std::size_t count() const { return texts_.size() + more_; }
  void add(std::string text);
  void add_more() { ++more_; }
  std::vector<std::string> taken();

 private:
  std::vector<std::string> texts_;
  std::size_t more_ = 0;
};

class JsonReader {
 public:
  // The text must outlive this.
  JsonReader(std::string_view text, std::string file_name)
      : file_name_(std::move(file_name)), text_(text), places_(text) {}

 protected:
  // A value and the way to it.
  struct Node {
    const boost::json::value& value;
    const Node* parent = nullptr;
    JsonStep step{};

    Node element(std::size_t i) const { return {value.get_array()[i], this, i}; }
  };

  // False with one error when the text is no JSON.
  bool parse(boost::json::value& root);

  static std::vector<JsonStep> path_to(const Node& node);
  std::string place(std::size_t offset) const;  // "file:line:column"
  std::string message(const Node& at, const std::string& what) const;
  void error(const Node& at, const std::string& what) { say(errors_, at, what); }
  void note(const Node& at, const std::string& what) { say(notes_, at, what); }

  // Null, with an error, when the value is something else.
  const boost::json::object* object_at(const Node& node, const char* what);
  const boost::json::array* array_at(const Node& node, const char* what);
  // Empty when the member is missing or null, and, with an error, when it is no finite number.
  std::optional<double> number(const Node& parent, const boost::json::object& object,
                               const char* key);

  const std::string file_name_;
  const std::string_view text_;
  const JsonPlaces places_;
  std::string label_;  // What is being read; part of every message. May be empty.
  Messages errors_;
  Messages notes_;

 private:
  void say(Messages& messages, const Node& at, const std::string& what);
  std::string shown(std::size_t offset) const;
};

}  // namespace mission
