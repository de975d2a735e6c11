#include "sim/mesh.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <sstream>

namespace sim {
namespace {

constexpr std::size_t kErrorsMax = 20;

// Everything of the format that says nothing about where surfaces are (or, as free-form surfaces,
// that models of sites do not use).
constexpr std::string_view kSkipped[] = {
    "vt",       "vn",         "vp",        "g",    "s",      "o",    "mg",    "usemtl",
    "mtllib",   "usemap",     "maplib",    "p",    "l",      "lod",  "bevel", "c_interp",
    "d_interp", "deg",        "bmat",      "step", "cstype", "curv", "curv2", "surf",
    "parm",     "trim",       "hole",      "scrv", "sp",     "end",  "con",   "ctech",
    "stech",    "shadow_obj", "trace_obj", "call", "csh"};

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

std::string quoted(std::string_view word) {
  std::string shown = "'";
  for (const char c : word.substr(0, 40)) shown += c >= ' ' && c <= '~' ? c : '?';
  return shown + (word.size() > 40 ? "...'" : "'");
}

// The next blank-separated word of a line, taken off its front; empty at the end.
std::string_view take_word(std::string_view& line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  const auto end = std::find_if(line.begin(), line.end(), is_blank);
  const std::string_view word = line.substr(0, static_cast<std::size_t>(end - line.begin()));
  line.remove_prefix(word.size());
  return word;
}

template <class T>
std::optional<T> number(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

class ObjReader {
 public:
  explicit ObjReader(const std::string& name) : name_(name) {}

  ParsedMesh read(std::string_view text) {
    if (text.size() > kObjBytesMax) fail("the file is larger than 1 GiB");
    while (!text.empty() && usable()) read_line(take_line(text));
    check_forward_references();
    line_ = lines_;
    if (out_.errors.empty() && out_.mesh.triangles.empty()) fail("no faces: nothing to scan");
    if (!out_.errors.empty()) out_.mesh = {};
    return std::move(out_);
  }

 private:
  bool usable() const { return out_.errors.size() < kErrorsMax && !full_; }

  void fail(const std::string& reason) {
    if (out_.errors.size() < kErrorsMax)
      out_.errors.push_back(name_ + ":" + std::to_string(std::max<std::size_t>(line_, 1)) + ": " +
                            reason);
    if (out_.errors.size() == kErrorsMax) out_.errors.back() += " (and perhaps more)";
  }

  // One line, or several that are joined by a backslash at their ends; without its comment.
  std::string_view take_line(std::string_view& text) {
    line_ = lines_ + 1;
    std::string_view line = take_physical(text);
    if (!ends_open(line)) return line.substr(0, line.find('#'));
    joined_.assign(line);
    while (!text.empty() && ends_open(joined_)) {
      joined_.back() = ' ';
      joined_ += take_physical(text);
    }
    return std::string_view(joined_).substr(0, joined_.find('#'));
  }

  std::string_view take_physical(std::string_view& text) {
    ++lines_;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
  }

  static bool ends_open(std::string_view line) {
    return !line.empty() && line.back() == '\\' && line.find('#') == std::string_view::npos;
  }

  void read_line(std::string_view line) {
    const std::string_view keyword = take_word(line);
    if (keyword.empty()) return;
    if (keyword == "v") return read_vertex(line);
    if (keyword == "f" || keyword == "fo") return read_face(line);
    if (std::find(std::begin(kSkipped), std::end(kSkipped), keyword) == std::end(kSkipped))
      fail("unknown keyword " + quoted(keyword) + "; is this a Wavefront OBJ file?");
  }

  void read_vertex(std::string_view line) {
    Eigen::Vector3d vertex = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = take_word(line);
      const auto value = number<double>(word);
      if (word.empty())
        fail("a vertex needs three coordinates, found " + std::to_string(axis));
      else if (!value)
        fail("coordinate " + quoted(word) + " is not a number");
      else if (!(std::abs(*value) <= kObjCoordinateMax_m))
        fail("coordinate " + quoted(word) + " is not within 1e8 m of the origin");
      else
        vertex[axis] = *value;
      if (word.empty()) break;
    }
    if (out_.mesh.W_vertices_m.size() >= kObjElementsMax) return overflow("vertices");
    out_.mesh.W_vertices_m.push_back(vertex);  // Also a wrong one, so that the count stays right.
  }

  void read_face(std::string_view line) {
    corners_.clear();
    for (auto word = take_word(line); !word.empty(); word = take_word(line)) {
      const auto corner = read_corner(word);
      if (!corner) return;
      corners_.push_back(*corner);
    }
    if (corners_.size() < 3)
      return fail("a face needs three corners, found " + std::to_string(corners_.size()));
    for (std::size_t i = 2; i < corners_.size(); ++i)
      add_triangle({corners_[0], corners_[i - 1], corners_[i]});
  }

  // The vertex of a face's corner: i, i/j, i//k or i/j/k.
  std::optional<std::uint32_t> read_corner(std::string_view word) {
    const std::string_view whole = word;
    std::optional<std::int64_t> vertex;
    for (int part = 0; part < 3; ++part) {
      const std::size_t slash = word.find('/');
      const auto value = number<std::int64_t>(word.substr(0, slash));
      const bool may_lack = part == 1 && slash != std::string_view::npos && slash == 0;
      if ((!value || *value == 0) && !may_lack) break;
      if (part == 0) vertex = value;
      if (slash == std::string_view::npos) return resolve(*vertex, whole);
      word.remove_prefix(slash + 1);
    }
    fail("corner " + quoted(whole) + " is not i, i/j, i//k or i/j/k with numbers other than 0");
    return std::nullopt;
  }

  std::optional<std::uint32_t> resolve(std::int64_t vertex, std::string_view word) {
    const auto count = static_cast<std::int64_t>(out_.mesh.W_vertices_m.size());
    const std::int64_t index = vertex > 0 ? vertex - 1 : count + vertex;
    if (index < 0 || index >= static_cast<std::int64_t>(kObjElementsMax)) {
      fail("corner " + quoted(word) + " names a vertex that does not exist (" +
           std::to_string(count) + " so far)");
      return std::nullopt;
    }
    // A vertex may follow the face that uses it; checked at the end.
    if (index >= count && index > furthest_) {
      furthest_ = index;
      furthest_line_ = line_;
    }
    return static_cast<std::uint32_t>(index);
  }

  void add_triangle(const std::array<std::uint32_t, 3>& t) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    if (out_.mesh.triangles.size() >= kObjElementsMax) return overflow("triangles");
    out_.mesh.triangles.push_back(t);
  }

  void overflow(const std::string& what) {
    if (!full_) fail("more than " + std::to_string(kObjElementsMax) + " " + what);
    full_ = true;
  }

  void check_forward_references() {
    const auto count = static_cast<std::int64_t>(out_.mesh.W_vertices_m.size());
    if (furthest_ < count || !usable()) return;
    line_ = furthest_line_;
    fail("a face names vertex " + std::to_string(furthest_ + 1) + "; the file has only " +
         std::to_string(count));
  }

  const std::string& name_;
  ParsedMesh out_;
  std::size_t lines_ = 0;  // Read so far.
  std::size_t line_ = 0;   // Where the current statement begins.
  std::string joined_;
  std::vector<std::uint32_t> corners_;
  std::int64_t furthest_ = -1;
  std::size_t furthest_line_ = 0;
  bool full_ = false;
};

}  // namespace

Eigen::AlignedBox3d Mesh::bounds_m() const {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : triangles)
    for (const std::uint32_t vertex : triangle) box.extend(W_vertices_m[vertex]);
  return box;
}

void Mesh::add_quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) {
  const auto first = static_cast<std::uint32_t>(W_vertices_m.size());
  W_vertices_m.insert(W_vertices_m.end(), {a, b, c, d});
  triangles.push_back({first, first + 1, first + 2});
  triangles.push_back({first, first + 2, first + 3});
}

ParsedMesh parse_obj(std::string_view text, const std::string& name) {
  return ObjReader(name).read(text);
}

ParsedMesh load_obj(const std::filesystem::path& file) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  if (error) return {{}, {file.string() + ": cannot be read: " + error.message()}};
  if (bytes > kObjBytesMax) return {{}, {file.string() + ":1: the file is larger than 1 GiB"}};
  std::ifstream stream(file, std::ios::binary);
  std::string text(bytes, '\0');
  if (!stream.read(text.data(), static_cast<std::streamsize>(bytes)))
    return {{}, {file.string() + ": cannot be read"}};
  return parse_obj(text, file.string());
}

}  // namespace sim
