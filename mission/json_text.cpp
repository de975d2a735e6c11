#include "mission/json_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/json/serialize.hpp>
#include <cmath>
#include <numbers>

namespace mission {
namespace {

namespace json = boost::json;

std::string number_text(double value) {
  if (!std::isfinite(value)) return "null";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

bool is_scalar(const json::value& value) {
  return !value.is_object() && !value.is_array();
}

// indent < 0: everything on one line.
class Printer {
 public:
  std::string take() { return std::move(out_); }

  void print(const json::value& value, int indent) {
    if (const auto* object = value.if_object()) {
      print_object(*object, indent);
    } else if (const auto* array = value.if_array()) {
      print_array(*array, indent);
    } else if (const auto* number = value.if_double()) {
      out_ += number_text(*number);
    } else {
      out_ += json::serialize(value);
    }
  }

 private:
  static int deeper(int indent) { return indent < 0 ? indent : indent + 2; }

  void new_line(int indent) {
    if (indent >= 0) out_.append(1, '\n').append(static_cast<std::size_t>(indent), ' ');
  }

  void print_object(const json::object& object, int indent) {
    if (object.empty()) {
      out_ += "{}";
      return;
    }
    char before = '{';
    for (const auto& member : object) {
      out_ += std::exchange(before, ',');
      new_line(deeper(indent));
      out_ += json::serialize(json::value(member.key()));
      out_ += indent < 0 ? ":" : ": ";
      print(member.value(), deeper(indent));
    }
    new_line(indent);
    out_ += '}';
  }

  void print_array(const json::array& array, int indent) {
    const bool flat = indent < 0 || std::all_of(array.begin(), array.end(), is_scalar);
    out_ += '[';
    for (std::size_t i = 0; i < array.size(); ++i) {
      if (i > 0) out_ += indent < 0 || !flat ? "," : ", ";
      if (!flat) new_line(deeper(indent));
      print(array[i], deeper(indent));
    }
    if (!flat) new_line(indent);
    out_ += ']';
  }

  std::string out_;
};

}  // namespace

std::string json_line(const json::value& value) {
  Printer printer;
  printer.print(value, -1);
  return printer.take();
}

std::string json_pretty(const json::value& value) {
  Printer printer;
  printer.print(value, 0);
  return printer.take() + "\n";
}

double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double whole = std::round(value * scale);
  // + 0.0 turns -0 into 0.
  return std::abs(whole) < 9e15 ? whole / scale + 0.0 : value;
}

boost::json::object exact_json(const hal::Pose2& pose) {
  return {{"x_m", pose.position_m.x()},
          {"y_m", pose.position_m.y()},
          {"heading_deg", pose.heading_rad * 180 / std::numbers::pi}};
}

}  // namespace mission
