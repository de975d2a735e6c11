#include "nav/registration/cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "nav/registration/cloud_fields.hpp"

namespace nav {
namespace {

using fields::shown;

constexpr std::string_view kBetween = " \t,;";

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

struct Columns {
  std::array<std::size_t, 3> xyz{0, 1, 2};
  std::size_t least() const { return 1 + *std::max_element(xyz.begin(), xyz.end()); }
};

bool is_comment(std::string_view line) {
  return line.starts_with('#') || line.starts_with("//");
}

// A header names its columns; nothing where one of x, y, z is missing.
std::optional<Columns> named_columns(const std::vector<std::string_view>& header) {
  Columns columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string wanted(1, "xyz"[axis]);
    const auto at = std::find_if(header.begin(), header.end(), [&](std::string_view word) {
      const std::string had = lower(word);
      return had == wanted || had == wanted + "_m" || had == "\"" + wanted + "\"";
    });
    if (at == header.end()) return std::nullopt;
    columns.xyz[axis] = static_cast<std::size_t>(at - header.begin());
  }
  return columns;
}

CloudResult<void> parse_row(const std::vector<std::string_view>& row, const Columns& columns,
                            std::string_view file, int line, Eigen::Vector3f& point) {
  if (row.size() < columns.least())
    return CloudError{
        std::string(file), line,
        fmt::format("{} columns where x, y and z need {}: complete or delete the line", row.size(),
                    columns.least())};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string_view word = row[columns.xyz[axis]];
    const auto value = fields::number<double>(word);
    if (!value)
      return CloudError{std::string(file), line,
                        fmt::format("column {} ({}): {} is not a number; write metres with a "
                                    "decimal point",
                                    columns.xyz[axis] + 1, "xyz"[axis], shown(word))};
    point[static_cast<Eigen::Index>(axis)] = static_cast<float>(*value);
  }
  return {};
}

}  // namespace

std::string CloudError::text() const {
  return line > 0 ? fmt::format("{}:{}: {}", file, line, what) : fmt::format("{}: {}", file, what);
}

void throw_exception_from_error(const CloudError& error, const boost::source_location&) {
  throw std::runtime_error(error.text());
}

CloudResult<Points> parse_text_cloud(std::string_view bytes, std::string_view file) {
  fields::Lines lines(bytes);
  Columns columns;
  Points points;
  bool first = true;
  for (std::string_view line; lines.next(line);) {
    const auto row = fields::words(line, kBetween);
    if (row.empty() || is_comment(line)) continue;
    if (std::exchange(first, false)) {
      // A header, or the number of points on a line of its own as some programs write it.
      if (row.size() == 1 && fields::number<std::uint64_t>(row[0])) continue;
      if (!fields::number<double>(row[0])) {
        const auto named = named_columns(row);
        if (!named)
          return CloudError{std::string(file), lines.number(),
                            fmt::format("the header {} names no columns x, y and z: name them so, "
                                        "or leave the header out",
                                        shown(line))};
        columns = *named;
        continue;
      }
    }
    Eigen::Vector3f point;
    if (const auto parsed = parse_row(row, columns, file, lines.number(), point); !parsed)
      return parsed.error();
    points.push_back(point);
  }
  if (points.empty())
    return CloudError{std::string(file), 0, "no points in it: expected lines of x y z in metres"};
  return points;
}

CloudResult<Points> parse_cloud(std::string_view bytes, std::string_view file) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n"))
    return parse_ply_cloud(bytes, file);
  if (bytes.starts_with("# .PCD") || bytes.starts_with("VERSION"))
    return parse_pcd_cloud(bytes, file);
  if (bytes.substr(0, 4096).find('\0') != std::string_view::npos)
    return CloudError{std::string(file), 0,
                      "binary, but neither PLY nor PCD: convert it to one of PLY, PCD, CSV, XYZ"};
  return parse_text_cloud(bytes, file);
}

}  // namespace nav
