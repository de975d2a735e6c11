#include "tools/vantage_decode_output.hpp"

#include <fmt/format.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>

#include "mission/json_text.hpp"

namespace decode {
namespace {

using drivers::Field;
using drivers::Message;

constexpr std::size_t kShownMax = 8;  // Of a vector, to people.

// Devices send what they like; what is printed is ASCII that can be printed: other bytes as \xNN.
std::string printable(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c >= ' ' && c <= '~' ? std::string(1, c)
                                   : fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
  return result;
}

std::string scalar_text(const Field& field) {
  return std::visit(
      []<class T>(const T& value) -> std::string {
        if constexpr (std::is_same_v<T, std::vector<double>>)
          return fmt::format("{}", fmt::join(value, " "));
        else if constexpr (std::is_same_v<T, std::string>)
          return printable(value);
        else
          return fmt::format("{}", value);
      },
      field.value);
}

std::string human_text(const Field& field) {
  const auto* numbers = std::get_if<std::vector<double>>(&field.value);
  if (numbers == nullptr) return scalar_text(field);
  if (numbers->size() <= kShownMax) return fmt::format("[{}]", scalar_text(field));
  return fmt::format("[{} ... {} in all]",
                     fmt::join(numbers->begin(), numbers->begin() + kShownMax, " "),
                     numbers->size());
}

std::string skipped_text(const drivers::SkippedBy& skipped) {
  std::string text;
  for (const auto& [why, by] : skipped)
    text += fmt::format("skipped: {}: {} times, {} bytes\n", why, by.times, by.bytes);
  return text;
}

class Human : public Output {
 public:
  Human(std::FILE* out, std::FILE* err) : out_(out), err_(err) {}

  void message(const Message& message) override {
    const std::string time = message.t_s ? fmt::format("{:.6f} ", *message.t_s) : "";
    std::string line =
        fmt::format("{}{} {}", time, message.from_device ? "<" : ">", printable(message.name));
    for (const Field& field : message.fields)
      line += fmt::format("  {}={}", field.name, human_text(field));
    fmt::print(out_, "{}\n", line);
  }
  void end(const Totals& totals) override {
    fmt::print(err_, "{} messages (< from the device, > to it)\n{}", totals.messages,
               skipped_text(totals.skipped));
  }

 private:
  std::FILE* out_;
  std::FILE* err_;
};

boost::json::value json_value(const Field& field) {
  return std::visit(
      []<class T>(const T& value) -> boost::json::value {
        if constexpr (std::is_same_v<T, std::vector<double>>)
          return boost::json::array(value.begin(), value.end());
        else if constexpr (std::is_same_v<T, std::string>)
          return boost::json::value(printable(value));
        else
          return boost::json::value(value);
      },
      field.value);
}

class Json : public Output {
 public:
  explicit Json(std::FILE* out) : out_(out) {}

  void message(const Message& message) override {
    boost::json::object object;
    if (message.t_s) object["t_s"] = *message.t_s;
    object["from_device"] = message.from_device;
    object["message"] = printable(message.name);
    boost::json::object& fields = (object["fields"] = boost::json::object()).get_object();
    for (const Field& field : message.fields) add(fields, field);
    line(object);
  }
  void end(const Totals& totals) override {
    boost::json::array skipped;
    for (const auto& [why, by] : totals.skipped)
      skipped.push_back({{"why", why}, {"times", by.times}, {"bytes", by.bytes}});
    line({{"messages", totals.messages}, {"skipped", skipped}});
  }

 private:
  // A name that comes again (faults do) becomes a list.
  static void add(boost::json::object& fields, const Field& field) {
    auto value = json_value(field);
    const auto found = fields.find(field.name);
    if (found == fields.end()) {
      fields.emplace(field.name, std::move(value));
      return;
    }
    if (!found->value().is_array()) found->value() = boost::json::array{found->value()};
    found->value().get_array().push_back(std::move(value));
  }
  void line(const boost::json::object& object) {
    fmt::print(out_, "{}\n", mission::json_line(object));
  }

  std::FILE* out_;
};

// One row per value: messages differ in what they have.
class Csv : public Output {
 public:
  Csv(std::FILE* out, std::FILE* err) : out_(out), err_(err) {
    fmt::print(out_, "message_number,t_s,from_device,message,field,value\n");
  }

  void message(const Message& message) override {
    const std::string time = message.t_s ? fmt::format("{:.6f}", *message.t_s) : "";
    const std::string head = fmt::format("{},{},{},{}", ++number_, time, message.from_device,
                                         quoted(printable(message.name)));
    if (message.fields.empty()) fmt::print(out_, "{},,\n", head);
    for (const Field& field : message.fields)
      fmt::print(out_, "{},{},{}\n", head, quoted(field.name), quoted(scalar_text(field)));
  }
  void end(const Totals& totals) override { fmt::print(err_, "{}", skipped_text(totals.skipped)); }

 private:
  static std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string result = "\"";
    for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
    return result + "\"";
  }

  std::FILE* out_;
  std::FILE* err_;
  std::uint64_t number_{};
};

}  // namespace

std::unique_ptr<Output> make_output(Style style, std::FILE* out, std::FILE* err) {
  switch (style) {
    case Style::json:
      return std::make_unique<Json>(out);
    case Style::csv:
      return std::make_unique<Csv>(out, err);
    case Style::human:
      break;
  }
  return std::make_unique<Human>(out, err);
}

}  // namespace decode
