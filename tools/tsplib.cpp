#include "tools/tsplib.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "mission/files.hpp"

namespace tools {
namespace {

using Place = std::pair<double, double>;
using Costs = std::vector<std::vector<double>>;

constexpr std::string_view kBlanks = " \t\r\f\v";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return text.substr(text.size());
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// Takes the next word off the line; empty at its end.
std::string_view next_word(std::string_view& line) {
  line = trimmed(line);
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

// Long words shortened, so that an error stays a line.
std::string shown(std::string_view word) {
  constexpr std::size_t kLengthMax = 40;
  return fmt::format("'{}{}'", word.substr(0, kLengthMax), word.size() > kLengthMax ? "..." : "");
}

struct Failure {
  int line;
  std::string message;
  int column = 1;
};

// The distances that TSPLIB95 defines (section 2), literally.
double euclidean(Place a, Place b) {
  return std::hypot(a.first - b.first, a.second - b.second);
}
double euc_2d(Place a, Place b) {
  return std::floor(euclidean(a, b) + 0.5);
}
double ceil_2d(Place a, Place b) {
  return std::ceil(euclidean(a, b));
}
double man_2d(Place a, Place b) {
  return std::floor(std::abs(a.first - b.first) + std::abs(a.second - b.second) + 0.5);
}
double max_2d(Place a, Place b) {
  return std::max(std::floor(std::abs(a.first - b.first) + 0.5),
                  std::floor(std::abs(a.second - b.second) + 0.5));
}
double att(Place a, Place b) {
  const double dx = a.first - b.first, dy = a.second - b.second;
  return std::ceil(std::sqrt((dx * dx + dy * dy) / 10.0));
}
double geo_radians(double degrees_minutes) {
  constexpr double kPi = 3.141592;
  const double degrees = std::trunc(degrees_minutes);
  return kPi * (degrees + 5.0 * (degrees_minutes - degrees) / 3.0) / 180.0;
}
double geo(Place a, Place b) {
  constexpr double kEarthRadiusKm = 6378.388;
  const double q1 = std::cos(geo_radians(a.second) - geo_radians(b.second));
  const double q2 = std::cos(geo_radians(a.first) - geo_radians(b.first));
  const double q3 = std::cos(geo_radians(a.first) + geo_radians(b.first));
  const double cosine = 0.5 * ((1 + q1) * q2 - (1 - q1) * q3);
  return std::floor(kEarthRadiusKm * std::acos(std::clamp(cosine, -1.0, 1.0)) + 1);
}

struct Metric {
  std::string_view name;
  double (*distance)(Place, Place);  // Null: the file lists the weights.
};
constexpr std::array kMetrics{Metric{"EUC_2D", euc_2d},   Metric{"MAN_2D", man_2d},
                              Metric{"MAX_2D", max_2d},   Metric{"CEIL_2D", ceil_2d},
                              Metric{"ATT", att},         Metric{"GEO", geo},
                              Metric{"EXPLICIT", nullptr}};

// Which weights a file lists: in the i-th group the nodes from .. to - 1. Columns of the upper
// triangle are rows of the lower one.
struct Format {
  std::string_view name;
  bool full, upper, diagonal;

  std::size_t from(std::size_t i) const { return full || !upper ? 0 : diagonal ? i : i + 1; }
  std::size_t to(std::size_t i, std::size_t n) const {
    return full || upper ? n : diagonal ? i + 1 : i;
  }
};
constexpr std::array kFormats{
    Format{"FULL_MATRIX", true, false, true},     Format{"UPPER_ROW", false, true, false},
    Format{"LOWER_ROW", false, false, false},     Format{"UPPER_DIAG_ROW", false, true, true},
    Format{"LOWER_DIAG_ROW", false, false, true}, Format{"UPPER_COL", false, false, false},
    Format{"LOWER_COL", false, true, false},      Format{"UPPER_DIAG_COL", false, false, true},
    Format{"LOWER_DIAG_COL", false, true, true}};

// The entry of that name, or what to write instead.
template <class Entries>
const auto& entry_named(const Entries& entries, std::string_view key, std::string_view name,
                        int line) {
  std::string known;
  for (const auto& entry : entries) {
    if (entry.name == name) return entry;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.name);
  }
  throw Failure{line,
                fmt::format("{}: {} is not supported; use one of {}", key, shown(name), known)};
}

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  TspInstance run() {
    while (next_line()) {
      if (line_.empty()) continue;
      if (line_ == "EOF") break;
      const auto colon = line_.find(':');
      const std::string_view key = trimmed(line_.substr(0, colon));
      if (colon == std::string_view::npos || key.ends_with("_SECTION"))
        read_section(std::string(key));
      else
        read_header(std::string(key), trimmed(line_.substr(colon + 1)));
    }
    return {value("NAME"), {.cost = costs(), .start = 0, .closed = true}};
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw Failure{number_, message}; }

  bool next_line() {
    if (rest_.empty()) return false;
    const auto end = rest_.find('\n');
    line_ = trimmed(rest_.substr(0, end));
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    return true;
  }

  void read_header(const std::string& key, std::string_view text) {
    constexpr std::array<std::string_view, 9> kKeys{"NAME",
                                                    "TYPE",
                                                    "COMMENT",
                                                    "DIMENSION",
                                                    "EDGE_WEIGHT_TYPE",
                                                    "EDGE_WEIGHT_FORMAT",
                                                    "EDGE_DATA_FORMAT",
                                                    "NODE_COORD_TYPE",
                                                    "DISPLAY_DATA_TYPE"};
    if (std::ranges::find(kKeys, key) == kKeys.end())
      fail(fmt::format("{}: not a key of a TSP file; remove the line", shown(key)));
    if (key != "COMMENT" && header_.contains(key))
      fail(fmt::format("{}: given twice, first in line {}; remove one", key, header_[key].line));
    header_[key] = {std::string(text), number_};
    const std::string& type = header_[key].text;
    if (key == "TYPE" && !type.starts_with("TSP") && !type.starts_with("ATSP"))
      fail(fmt::format("TYPE: {} is not supported; use TSP or ATSP", shown(type)));
  }

  void read_section(const std::string& section) {
    if (section == "NODE_COORD_SECTION") return read_places();
    if (section == "EDGE_WEIGHT_SECTION") return read_weights();
    if (section == "DISPLAY_DATA_SECTION") return skip_numbers();
    fail(
        fmt::format("{} is neither KEY : VALUE nor a section that is supported; use "
                    "NODE_COORD_SECTION or EDGE_WEIGHT_SECTION",
                    shown(section)));
  }

  bool at_number() const {
    const auto first = rest_.find_first_not_of(" \t\r\f\v\n");
    return first != std::string_view::npos &&
           (rest_[first] == '-' || rest_[first] == '+' || rest_[first] == '.' ||
            (rest_[first] >= '0' && rest_[first] <= '9'));
  }

  void skip_numbers() {
    while (at_number() && next_line()) {
    }
  }

  // Of a word of the present line, from 1.
  int column(std::string_view word) const {
    const auto place = static_cast<std::size_t>(word.data() - text_.data());
    const auto line_end = place == 0 ? std::string_view::npos : text_.rfind('\n', place - 1);
    return static_cast<int>(line_end == std::string_view::npos ? place + 1 : place - line_end);
  }

  double number(std::string_view word, std::string_view what) const {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() ||
        !(std::abs(value) <= kTspNumberMax))
      throw Failure{number_,
                    fmt::format("{}: {} is not a number from {} to {}; correct it", what,
                                shown(word), -kTspNumberMax, kTspNumberMax),
                    column(word)};
    return value;
  }

  // "NODE X Y", one a line, in any order.
  void read_places() {
    const std::size_t n = dimension();
    if (!places_.empty()) fail("NODE_COORD_SECTION: given twice; remove one");
    std::vector<std::optional<Place>> found(n);
    std::size_t count = 0;
    while (at_number() && next_line()) {
      if (line_.empty()) continue;
      std::string_view words = line_;
      const double node = number(next_word(words), "NODE_COORD_SECTION: node");
      if (!(node >= 1 && node <= static_cast<double>(n) && node == std::floor(node)))
        fail(fmt::format("NODE_COORD_SECTION: node {} is not one of 1 to {} (DIMENSION)", node, n));
      auto& place = found[static_cast<std::size_t>(node) - 1];
      if (place) fail(fmt::format("NODE_COORD_SECTION: node {} is given twice; remove one", node));
      const double x = number(next_word(words), "NODE_COORD_SECTION: first coordinate");
      const double y = number(next_word(words), "NODE_COORD_SECTION: second coordinate");
      if (!next_word(words).empty())
        fail(
            "NODE_COORD_SECTION: more than a node and two coordinates; three dimensions are not "
            "supported");
      place = Place{x, y};
      ++count;
    }
    if (count != n)
      fail(fmt::format("NODE_COORD_SECTION: has {} nodes, DIMENSION says {}; correct one", count,
                       n));
    for (const auto& place : found) places_.push_back(*place);
  }

  void read_weights() {
    if (!weights_.empty()) fail("EDGE_WEIGHT_SECTION: given twice; remove one");
    weights_line_ = number_;
    while (at_number() && next_line()) {
      std::string_view words = line_;
      for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
        weights_.push_back(number(word, "EDGE_WEIGHT_SECTION"));
        if (weights_.back() < 0)
          fail(fmt::format("EDGE_WEIGHT_SECTION: {} is negative; weights are 0 or more",
                           shown(word)));
      }
    }
  }

  const std::string& value(const std::string& key) { return header_[key].text; }

  const std::string& needed(const std::string& key) {
    if (!header_.contains(key))
      fail(fmt::format("{}: is missing; add a line \"{} : ...\" before the sections", key, key));
    return value(key);
  }

  std::size_t dimension() {
    const std::string& text = needed("DIMENSION");
    int n = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
    if (error != std::errc() || end != text.data() + text.size() || n < 1 || n > kTspNodesMax)
      throw Failure{header_["DIMENSION"].line,
                    fmt::format("DIMENSION: {} is not a whole number from 1 to {}; correct it",
                                shown(text), kTspNodesMax)};
    return static_cast<std::size_t>(n);
  }

  Costs costs() {
    const std::string& type = needed("EDGE_WEIGHT_TYPE");
    const Metric& metric =
        entry_named(kMetrics, "EDGE_WEIGHT_TYPE", type, header_["EDGE_WEIGHT_TYPE"].line);
    return metric.distance == nullptr ? listed_costs() : costs_between_places(metric);
  }

  Costs costs_between_places(const Metric& metric) {
    const std::size_t n = dimension();
    if (places_.empty())
      fail(
          fmt::format("NODE_COORD_SECTION: is missing; EDGE_WEIGHT_TYPE {} needs it", metric.name));
    Costs cost(n, std::vector<double>(n, 0));
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (i != j) cost[i][j] = metric.distance(places_[i], places_[j]);
    return cost;
  }

  Costs listed_costs() {
    const std::size_t n = dimension();
    const Format& format = entry_named(kFormats, "EDGE_WEIGHT_FORMAT", needed("EDGE_WEIGHT_FORMAT"),
                                       header_["EDGE_WEIGHT_FORMAT"].line);
    std::size_t expected = 0;
    for (std::size_t i = 0; i < n; ++i) expected += format.to(i, n) - std::min(format.from(i), n);
    if (weights_.size() != expected)
      throw Failure{weights_line_ > 0 ? weights_line_ : number_,
                    fmt::format("EDGE_WEIGHT_SECTION: has {} numbers; {} of {} nodes needs {}",
                                weights_.size(), format.name, n, expected)};
    Costs cost(n, std::vector<double>(n, 0));
    auto weight = weights_.begin();
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = format.from(i); j < format.to(i, n); ++j) {
        if (!format.full) cost[j][i] = *weight;
        cost[i][j] = *weight++;
      }
    return cost;
  }

  struct Value {
    std::string text;
    int line = 0;
  };

  std::string_view text_;
  std::string_view rest_ = text_;
  std::string_view line_;
  int number_ = 0;
  std::map<std::string, Value> header_;
  std::vector<Place> places_;
  std::vector<double> weights_;
  int weights_line_ = 0;
};

}  // namespace

LoadedTsp parse_tsp(std::string_view text, const std::string& file) {
  LoadedTsp loaded;
  try {
    loaded.tsp = Parser(text).run();
    if (loaded.tsp.name.empty()) loaded.tsp.name = std::filesystem::path(file).stem().string();
  } catch (const Failure& failure) {
    loaded.errors.push_back({file, failure.line, failure.column, failure.message});
  }
  return loaded;
}

LoadedTsp load_tsp(const std::filesystem::path& file) {
  const auto text = mission::read_file(file);
  if (!text)
    return {{},
            {{file.string(), 0, 0,
              fmt::format("cannot be read: {}; check the path", text.error().code.message())}}};
  return parse_tsp(*text, file.string());
}

}  // namespace tools
