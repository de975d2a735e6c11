#include <fmt/format.h>

#include <cctype>

#include "nav/registration/cloud_fields.hpp"

namespace nav {
namespace {

using fields::shown;
using fields::Type;

struct Field {
  std::string name;
  Type type;
  std::size_t count = 1;
  std::size_t offset{};  // In a point, bytes.
  std::size_t column{};  // In a line of text.
};

struct Header {
  std::vector<Field> fields;
  std::uint64_t points{};
  std::size_t point_bytes{};
  std::string data;
};

std::string set_counts(const std::vector<std::string_view>& words, Header& header, const char* what,
                       std::size_t Field::*member) {
  if (words.size() != header.fields.size() + 1)
    return fmt::format("{} says {} values for {} fields", what, words.size() - 1,
                       header.fields.size());
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const auto value = fields::number<std::uint32_t>(words[i + 1]);
    if (!value || *value == 0 || *value > 65536)
      return fmt::format("{} of field {}: {} is not 1 to 65536", what, header.fields[i].name,
                         shown(words[i + 1]));
    header.fields[i].*member = *value;
  }
  return {};
}

std::string set_types(const std::vector<std::string_view>& words, Header& header) {
  if (words.size() != header.fields.size() + 1)
    return fmt::format("TYPE says {} values for {} fields", words.size() - 1, header.fields.size());
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    header.fields[i].type.kind = words[i + 1] == "I"   ? 'i'
                                 : words[i + 1] == "U" ? 'u'
                                 : words[i + 1] == "F" ? 'f'
                                                       : '?';
  return {};
}

// One line of the header; "" when fine.
std::string read_line(std::string_view line, Header& header) {
  const auto words = fields::words(line);
  if (words.empty() || line.starts_with('#')) return {};
  const std::string_view key = words[0];
  if (key == "FIELDS" || key == "COLUMNS") {
    header.fields.clear();
    for (std::size_t i = 1; i < words.size(); ++i)
      header.fields.push_back({std::string(words[i]), {}, 1, 0, 0});
    return {};
  }
  if (key == "SIZE") {
    std::vector<Field> before = header.fields;
    for (Field& field : header.fields) field.count = 1;
    if (auto problem = set_counts(words, header, "SIZE", &Field::count); !problem.empty())
      return problem;
    for (std::size_t i = 0; i < before.size(); ++i) {
      header.fields[i].type.bytes = header.fields[i].count;
      header.fields[i].count = before[i].count;
    }
    return {};
  }
  if (key == "TYPE") return set_types(words, header);
  if (key == "COUNT") return set_counts(words, header, "COUNT", &Field::count);
  if (key == "POINTS") {
    const auto points = words.size() > 1 ? fields::number<std::uint64_t>(words[1]) : std::nullopt;
    if (!points) return "POINTS says no number";
    header.points = *points;
    return {};
  }
  if (key == "DATA" && words.size() > 1) header.data = words[1];
  return {};
}

// Where each field lies; "" when fine.
std::string lay_out(Header& header) {
  std::size_t column = 0;
  for (Field& field : header.fields) {
    if (!fields::known(field.type))
      return fmt::format("field {}: no number has TYPE {} and SIZE {}", field.name,
                         static_cast<char>(std::toupper(field.type.kind)), field.type.bytes);
    field.offset = header.point_bytes;
    field.column = column;
    header.point_bytes += field.type.bytes * field.count;
    column += field.count;
  }
  return {};
}

CloudResult<Header> read_header(fields::Lines& lines, std::string_view file) {
  Header header;
  for (std::string_view line; header.data.empty() && lines.next(line);)
    if (auto problem = read_line(line, header); !problem.empty())
      return CloudError{std::string(file), lines.number(), std::move(problem)};
  if (header.data.empty())
    return CloudError{std::string(file), lines.number(),
                      "the header does not end: DATA is missing; the file is cut short or no PCD"};
  if (auto problem = lay_out(header); !problem.empty())
    return CloudError{std::string(file), lines.number(), std::move(problem)};
  return header;
}

CloudResult<std::array<Field, 3>> xyz_of(const Header& header, std::string_view file) {
  std::array<Field, 3> xyz;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string wanted(1, "xyz"[axis]);
    const auto at = std::find_if(header.fields.begin(), header.fields.end(),
                                 [&](const Field& field) { return field.name == wanted; });
    if (at == header.fields.end())
      return CloudError{std::string(file), 0,
                        fmt::format("FIELDS has no {}: export the points with x, y and z", wanted)};
    xyz[axis] = *at;
  }
  return xyz;
}

CloudError cut_short(std::string_view file, std::uint64_t have, std::uint64_t want) {
  return {std::string(file), 0,
          fmt::format("cut short: {} of {} points are there; copy the file again", have, want)};
}

CloudResult<Points> read_ascii(fields::Lines& lines, const Header& header,
                               const std::array<Field, 3>& xyz, std::string_view file) {
  Points points;
  for (std::string_view line; points.size() < header.points && lines.next(line);) {
    const auto row = fields::words(line);
    Eigen::Vector3f point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = xyz[axis].column;
      const auto value = at < row.size() ? fields::number<double>(row[at]) : std::nullopt;
      if (!value)
        return CloudError{
            std::string(file), lines.number(),
            fmt::format("field {}: {} is not a number; repair or export again", xyz[axis].name,
                        at < row.size() ? shown(row[at]) : "nothing")};
      point[static_cast<Eigen::Index>(axis)] = static_cast<float>(*value);
    }
    points.push_back(point);
  }
  if (points.size() < header.points) return cut_short(file, points.size(), header.points);
  return points;
}

// stride: from one point to the next; at: where its coordinates are.
Points decode_points(std::string_view bytes, std::uint64_t count, const std::array<Field, 3>& xyz,
                     const std::array<std::size_t, 3>& at,
                     const std::array<std::size_t, 3>& stride) {
  Points points(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[i][static_cast<Eigen::Index>(axis)] = static_cast<float>(
          fields::decode(bytes.data() + at[axis] + i * stride[axis], xyz[axis].type, false));
  return points;
}

CloudResult<Points> read_binary(std::string_view bytes, const Header& header,
                                const std::array<Field, 3>& xyz, std::string_view file) {
  if (bytes.size() / header.point_bytes < header.points)
    return cut_short(file, bytes.size() / header.point_bytes, header.points);
  const std::size_t step = header.point_bytes;
  return decode_points(bytes, header.points, xyz, {xyz[0].offset, xyz[1].offset, xyz[2].offset},
                       {step, step, step});
}

// LZF, as PCL packs: nothing where the bytes are not what was packed.
std::optional<std::string> unpack_lzf(std::string_view packed, std::size_t size) {
  std::string out;
  out.reserve(size);
  for (std::size_t at = 0; at < packed.size();) {
    const auto control = static_cast<unsigned char>(packed[at++]);
    if (control < 32) {  // That many bytes and one as they are.
      const std::size_t run = control + 1U;
      if (run > packed.size() - at || run > size - out.size()) return std::nullopt;
      out.append(packed.substr(at, run));
      at += run;
      continue;
    }
    std::size_t run = control >> 5U;
    if (run == 7) {
      if (at >= packed.size()) return std::nullopt;
      run += static_cast<unsigned char>(packed[at++]);
    }
    if (at >= packed.size()) return std::nullopt;
    const std::size_t back =
        ((control & 31U) << 8U) + static_cast<unsigned char>(packed[at++]) + 1U;
    run += 2;
    if (back > out.size() || run > size - out.size()) return std::nullopt;
    for (std::size_t i = 0; i < run; ++i) out += out[out.size() - back];
  }
  return out.size() == size ? std::optional(std::move(out)) : std::nullopt;
}

// Field by field: all x, then all y, ...
CloudResult<Points> read_compressed(std::string_view bytes, const Header& header,
                                    const std::array<Field, 3>& xyz, std::string_view file) {
  const CloudError damaged{std::string(file), 0,
                           "the compressed points are damaged or cut short; copy the file again"};
  if (bytes.size() < 8) return damaged;
  const auto packed_size =
      static_cast<std::size_t>(fields::as_double<std::uint32_t>(&bytes[0], false));
  const auto size = static_cast<std::size_t>(fields::as_double<std::uint32_t>(&bytes[4], false));
  bytes.remove_prefix(8);
  // LZF packs at most 264 bytes into 3: so bounded, the memory is as well.
  if (packed_size > bytes.size() || size / 100 > packed_size ||
      size / header.point_bytes != header.points || size % header.point_bytes != 0)
    return damaged;
  const auto raw = unpack_lzf(bytes.substr(0, packed_size), size);
  if (!raw) return damaged;
  std::array<std::size_t, 3> at{}, stride{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] = xyz[axis].offset * header.points;
    stride[axis] = xyz[axis].type.bytes * xyz[axis].count;
  }
  return decode_points(*raw, header.points, xyz, at, stride);
}

}  // namespace

CloudResult<Points> parse_pcd_cloud(std::string_view bytes, std::string_view file) {
  fields::Lines lines(bytes);
  const auto header = read_header(lines, file);
  if (!header) return header.error();
  const auto xyz = xyz_of(*header, file);
  if (!xyz) return xyz.error();
  CloudResult<Points> points = Points{};
  if (header->data == "ascii")
    points = read_ascii(lines, *header, *xyz, file);
  else if (header->data == "binary")
    points = read_binary(lines.rest(), *header, *xyz, file);
  else if (header->data == "binary_compressed")
    points = read_compressed(lines.rest(), *header, *xyz, file);
  else
    return CloudError{
        std::string(file), lines.number(),
        fmt::format("DATA {} is not one of ascii, binary, binary_compressed", shown(header->data))};
  if (points && points->empty()) return CloudError{std::string(file), 0, "no points in it"};
  return points;
}

}  // namespace nav
