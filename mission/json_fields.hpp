// Structures to JSON and back without loss: one description of a structure's fields serves both.
//
// Doubles are written as text and read by from_chars: they come back bit for bit, which numbers of
// a JSON parser need not.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <boost/json.hpp>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "hal/values.hpp"

namespace mission {

// Fewest digits that read back the same, with blanks between; "inf" and "nan" too.
inline std::string exact_text(const double* values, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("{}{}", i == 0 ? "" : " ", values[i]);
  return text;
}

// Throws std::runtime_error unless the text holds exactly so many.
inline void read_exact_text(std::string_view text, double* values, std::size_t count) {
  const char *at = text.data(), *end = at + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && (at == end || *at++ != ' ')) throw std::runtime_error("a number is missing");
    const auto [next, error] = std::from_chars(at, end, values[i]);
    if (error != std::errc()) throw std::runtime_error("what should be a number is none");
    at = next;
  }
  if (at != end) throw std::runtime_error("there are too many numbers");
}

// Eigen's fixed matrices, column by column, and poses are texts of so many numbers.
template <class T>
struct Numbers {
  static constexpr std::size_t kCount = 0;
};
template <int R, int C, int O>
struct Numbers<Eigen::Matrix<double, R, C, O>> {
  static constexpr std::size_t kCount = static_cast<std::size_t>(R) * C;
  static void to(const Eigen::Matrix<double, R, C, O>& m, double* all) {
    std::copy(m.data(), m.data() + kCount, all);
  }
  static void from(const double* all, Eigen::Matrix<double, R, C, O>& m) {
    std::copy(all, all + kCount, m.data());
  }
};
template <>
struct Numbers<Eigen::Isometry3d> {
  static constexpr std::size_t kCount = 16;
  static void to(const Eigen::Isometry3d& T, double* all) {
    std::copy(T.data(), T.data() + kCount, all);
  }
  static void from(const double* all, Eigen::Isometry3d& T) {
    std::copy(all, all + kCount, T.data());
  }
};
template <>
struct Numbers<hal::Pose2> {
  static constexpr std::size_t kCount = 3;
  static void to(const hal::Pose2& pose, double* all) {
    all[0] = pose.position_m.x(), all[1] = pose.position_m.y(), all[2] = pose.heading_rad;
  }
  static void from(const double* all, hal::Pose2& pose) { pose = {{all[0], all[1]}, all[2]}; }
};

// A structure of its own: describe(fields, structure) names its fields.
class JsonOut {
 public:
  template <class T>
  void operator()(const char* key, const T& value) {
    object_[key] = of(value);
  }
  boost::json::object taken() { return std::move(object_); }

  template <class T>
  static boost::json::value of(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      return static_cast<std::int64_t>(value);
    } else if constexpr (std::is_same_v<T, double>) {
      return boost::json::string(exact_text(&value, 1));
    } else if constexpr (std::is_arithmetic_v<T>) {
      return value;
    } else if constexpr (std::is_same_v<T, std::string>) {
      return boost::json::string(value);
    } else if constexpr (std::is_same_v<T, hal::Time>) {
      return value.time_since_epoch().count();
    } else if constexpr (Numbers<T>::kCount > 0) {
      double all[Numbers<T>::kCount];
      Numbers<T>::to(value, all);
      return boost::json::string(exact_text(all, Numbers<T>::kCount));
    } else {
      JsonOut out;
      T copy = value;
      describe(out, copy);
      return out.taken();
    }
  }
  template <class T>
  static boost::json::value of(const std::optional<T>& value) {
    return value ? of(*value) : boost::json::value(nullptr);
  }
  template <class T>
  static boost::json::value of(const std::vector<T>& values) {
    boost::json::array all;
    for (const T& value : values) all.push_back(of(value));
    return all;
  }
  template <class A, class B>
  static boost::json::value of(const std::pair<A, B>& both) {
    return boost::json::array{of(both.first), of(both.second)};
  }

 private:
  boost::json::object object_;
};

// Throws std::exception for what is missing or of another kind.
class JsonIn {
 public:
  explicit JsonIn(const boost::json::object& object) : object_(object) {}

  template <class T>
  void operator()(const char* key, T& value) {
    read(object_.at(key), value);
  }

  template <class T>
  static void read(const boost::json::value& json, T& value) {
    if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(json.to_number<std::int64_t>());
    } else if constexpr (std::is_same_v<T, double>) {
      read_exact_text(json.as_string(), &value, 1);
    } else if constexpr (std::is_same_v<T, bool>) {
      value = json.as_bool();
    } else if constexpr (std::is_arithmetic_v<T>) {
      value = json.to_number<T>();
    } else if constexpr (std::is_same_v<T, std::string>) {
      value = std::string(json.as_string());
    } else if constexpr (std::is_same_v<T, hal::Time>) {
      value = hal::Time(hal::Duration(json.to_number<std::int64_t>()));
    } else if constexpr (Numbers<T>::kCount > 0) {
      double all[Numbers<T>::kCount];
      read_exact_text(json.as_string(), all, Numbers<T>::kCount);
      Numbers<T>::from(all, value);
    } else {
      JsonIn in(json.as_object());
      describe(in, value);
    }
  }
  template <class T>
  static void read(const boost::json::value& json, std::optional<T>& value) {
    value.reset();
    if (!json.is_null()) read(json, value.emplace());
  }
  template <class T>
  static void read(const boost::json::value& json, std::vector<T>& values) {
    values.clear();
    for (const boost::json::value& each : json.as_array()) read(each, values.emplace_back());
  }
  template <class A, class B>
  static void read(const boost::json::value& json, std::pair<A, B>& both) {
    const boost::json::array& two = json.as_array();
    if (two.size() != 2) throw std::runtime_error("a pair is not two");
    read(two[0], both.first);
    read(two[1], both.second);
  }

 private:
  const boost::json::object& object_;
};

}  // namespace mission
