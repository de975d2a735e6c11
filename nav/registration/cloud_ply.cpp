#include <fmt/format.h>

#include "nav/registration/cloud_fields.hpp"

namespace nav {
namespace {

using fields::shown;
using fields::Type;

struct Property {
  std::string name;
  Type type;
  std::optional<Type> counted_by;  // A list: its length has this type.
};

struct Element {
  std::string name;
  std::uint64_t count{};
  std::vector<Property> properties;
};

enum class Format { unknown, ascii, little, big };

struct PlyHeader {
  Format format = Format::unknown;
  std::vector<Element> elements;
  int lines{};
};

std::optional<Type> type_named(std::string_view name) {
  struct Named {
    std::string_view name;
    Type type;
  };
  static constexpr Named kTypes[] = {
      {"char", {'i', 1}},  {"int8", {'i', 1}},    {"uchar", {'u', 1}},  {"uint8", {'u', 1}},
      {"short", {'i', 2}}, {"int16", {'i', 2}},   {"ushort", {'u', 2}}, {"uint16", {'u', 2}},
      {"int", {'i', 4}},   {"int32", {'i', 4}},   {"uint", {'u', 4}},   {"uint32", {'u', 4}},
      {"float", {'f', 4}}, {"float32", {'f', 4}}, {"double", {'f', 8}}, {"float64", {'f', 8}}};
  for (const Named& named : kTypes)
    if (named.name == name) return named.type;
  return std::nullopt;
}

// "" when fine.
std::string read_property(std::string_view line, Element& element) {
  Property property;
  std::string_view type = fields::take_word(line);
  if (type == "list") {
    property.counted_by = type_named(fields::take_word(line));
    type = fields::take_word(line);
    if (!property.counted_by || property.counted_by->kind == 'f')
      return "the length of a list must be a whole number";
  }
  const auto known = type_named(type);
  if (!known) return fmt::format("no such type: {}; PLY knows char to double", shown(type));
  property.type = *known;
  property.name = fields::take_word(line);
  element.properties.push_back(std::move(property));
  return {};
}

std::string read_header_line(std::string_view line, PlyHeader& header) {
  const std::string_view key = fields::take_word(line);
  if (key == "comment" || key == "obj_info" || key.empty()) return {};
  if (key == "format") {
    const std::string_view format = fields::take_word(line);
    header.format = format == "ascii"                  ? Format::ascii
                    : format == "binary_little_endian" ? Format::little
                    : format == "binary_big_endian"    ? Format::big
                                                       : Format::unknown;
    if (header.format != Format::unknown) return {};
    return fmt::format("format {} is not one of ascii, binary_little_endian, binary_big_endian",
                       shown(format));
  }
  if (key == "element") {
    Element element;
    element.name = fields::take_word(line);
    const std::string_view word = fields::take_word(line);
    const auto count = fields::number<std::uint64_t>(word);
    if (!count) return fmt::format("element {}: {} is no count", element.name, shown(word));
    element.count = *count;
    header.elements.push_back(std::move(element));
    return {};
  }
  if (key != "property") return fmt::format("unexpected {} in the header", shown(key));
  if (header.elements.empty()) return "a property before any element";
  return read_property(line, header.elements.back());
}

CloudResult<PlyHeader> read_ply_header(fields::Lines& lines, std::string_view file) {
  PlyHeader header;
  std::string_view line;
  lines.next(line);  // "ply"
  while (lines.next(line)) {
    if (line == "end_header") {
      header.lines = lines.number();
      if (header.format == Format::unknown)
        return CloudError{std::string(file), header.lines, "the header names no format"};
      return header;
    }
    if (auto problem = read_header_line(line, header); !problem.empty())
      return CloudError{std::string(file), lines.number(), std::move(problem)};
  }
  return CloudError{std::string(file), lines.number(),
                    "the header does not end: end_header is "
                    "missing; the file is cut short or no PLY"};
}

CloudResult<std::array<std::size_t, 3>> xyz_of(const Element& vertex, std::string_view file) {
  std::array<std::size_t, 3> xyz{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = std::find_if(
        vertex.properties.begin(), vertex.properties.end(), [&](const Property& property) {
          return property.name == std::string(1, "xyz"[axis]) && !property.counted_by;
        });
    if (at == vertex.properties.end())
      return CloudError{std::string(file), 0,
                        fmt::format("element vertex has no property {}: export the points with "
                                    "x, y and z",
                                    "xyz"[axis])};
    xyz[axis] = static_cast<std::size_t>(at - vertex.properties.begin());
  }
  return xyz;
}

CloudError ply_cut_short(std::string_view file, std::uint64_t have, std::uint64_t want) {
  return {std::string(file), 0,
          fmt::format("cut short: {} of {} points are there; copy the file again", have, want)};
}

// One row of an element in binary; false when the bytes end within it.
template <class Value>
bool read_row(std::string_view& bytes, const Element& element, bool swap, const Value& value) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const Property& property = element.properties[i];
    std::uint64_t count = 1;
    if (property.counted_by) {
      const std::size_t size = property.counted_by->bytes;
      if (bytes.size() < size) return false;
      const double said = fields::decode(bytes.data(), *property.counted_by, swap);
      bytes.remove_prefix(size);
      if (said < 0) return false;
      count = static_cast<std::uint64_t>(said);
    }
    if (bytes.size() / property.type.bytes < count) return false;
    if (!property.counted_by) value(i, fields::decode(bytes.data(), property.type, swap));
    bytes.remove_prefix(count * property.type.bytes);
  }
  return true;
}

CloudResult<Points> read_binary(std::string_view bytes, const PlyHeader& header,
                                std::string_view file) {
  const bool swap = header.format == Format::big;
  for (const Element& element : header.elements) {
    const bool vertices = element.name == "vertex";
    if (element.properties.empty()) continue;  // Rows of no bytes, however many.
    std::array<std::size_t, 3> xyz{};
    if (vertices) {
      const auto found = xyz_of(element, file);
      if (!found) return found.error();
      xyz = *found;
    }
    Points points;
    if (vertices) points.reserve(std::min<std::uint64_t>(element.count, bytes.size()));
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Eigen::Vector3f point{0, 0, 0};
      const bool whole = read_row(bytes, element, swap, [&](std::size_t at, double value) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (at == xyz[axis]) point[static_cast<Eigen::Index>(axis)] = static_cast<float>(value);
      });
      if (!whole) return ply_cut_short(file, i, element.count);
      if (vertices) points.push_back(point);
    }
    if (vertices) return points;
  }
  return CloudError{std::string(file), 0, "no element vertex: this PLY holds no points"};
}

CloudResult<Points> read_ascii(fields::Lines lines, const PlyHeader& header,
                               std::string_view file) {
  for (const Element& element : header.elements) {
    std::string_view line;
    if (element.name != "vertex") {
      for (std::uint64_t i = 0; i < element.count; ++i)
        if (!lines.next(line)) break;
      continue;
    }
    const auto xyz = xyz_of(element, file);
    if (!xyz) return xyz.error();
    Points points;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!lines.next(line)) return ply_cut_short(file, i, element.count);
      const auto row = fields::words(line);
      Eigen::Vector3f point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = (*xyz)[axis];
        const auto value = at < row.size() ? fields::number<double>(row[at]) : std::nullopt;
        if (!value)
          return CloudError{std::string(file), lines.number(),
                            fmt::format("property {}: {} is not a number; repair or export again",
                                        "xyz"[axis], at < row.size() ? shown(row[at]) : "nothing")};
        point[static_cast<Eigen::Index>(axis)] = static_cast<float>(*value);
      }
      points.push_back(point);
    }
    return points;
  }
  return CloudError{std::string(file), 0, "no element vertex: this PLY holds no points"};
}

}  // namespace

CloudResult<Points> parse_ply_cloud(std::string_view bytes, std::string_view file) {
  fields::Lines lines(bytes);
  const auto header = read_ply_header(lines, file);
  if (!header) return header.error();
  auto points = header->format == Format::ascii ? read_ascii(lines, *header, file)
                                                : read_binary(lines.rest(), *header, file);
  if (points && points->empty()) return CloudError{std::string(file), 0, "no points in it"};
  return points;
}

}  // namespace nav
