#include "mission/suggest.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace mission {
namespace {

constexpr std::array kUnits{"m",       "mm",     "cm",     "km",      "ft",      "deg",   "rad",
                            "s",       "ms",     "mps",    "kmh",     "degps",   "radps", "pct",
                            "percent", "meters", "metres", "degrees", "seconds", "voxels"};

bool is_upper(char c) {
  return std::isupper(static_cast<unsigned char>(c)) != 0;
}

char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// rangeMax-M -> range_max_m
std::string snake_case(std::string_view name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (is_upper(c) && i > 0 && !is_upper(name[i - 1]) && text.back() != '_') text += '_';
    text += (c == '-' || c == ' ' || c == '.') ? '_' : lower(c);
  }
  return text;
}

std::string_view without_unit(std::string_view name) {
  const auto cut = name.rfind('_');
  if (cut == std::string_view::npos || cut == 0) return name;
  const auto unit = name.substr(cut + 1);
  const bool known = std::find(kUnits.begin(), kUnits.end(), unit) != kUnits.end();
  return known ? name.substr(0, cut) : name;
}

std::vector<std::string_view> sorted_words(std::string_view name) {
  std::vector<std::string_view> words;
  while (!name.empty()) {
    const auto cut = std::min(name.find('_'), name.size());
    words.push_back(name.substr(0, cut));
    name.remove_prefix(std::min(cut + 1, name.size()));
  }
  std::sort(words.begin(), words.end());
  return words;
}

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  // Rows of the usual table; the swap of neighbours looks back two rows.
  std::vector<int> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int changed = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, changed});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

double unlikeness(std::string_view typed, std::string_view known) {
  if (typed.size() > 4 * known.size() + 8) return kUnlike;  // Not worth a long comparison.
  const std::string a = snake_case(typed), b = snake_case(known);
  double unlike = edit_distance(a, b);
  const auto a_stem = without_unit(a), b_stem = without_unit(b);
  // Both stems the same length as the names: nothing was cut, nothing to add.
  if (a_stem.size() != a.size() || b_stem.size() != b.size())
    unlike = std::min(unlike, edit_distance(a_stem, b_stem) + 0.5);
  const auto a_words = sorted_words(a_stem), b_words = sorted_words(b_stem);
  if (unlike > 0.7 && a_words == b_words) unlike = 0.7;
  const bool part = std::includes(b_words.begin(), b_words.end(), a_words.begin(), a_words.end());
  if (part && a_stem.size() >= 4) unlike = std::min(unlike, 1.0);
  const double limit = std::clamp(static_cast<double>(b_stem.size()) / 3, 1.0, 3.0);
  return unlike <= limit ? unlike : kUnlike;
}

std::vector<std::string> closest(std::string_view typed, const std::vector<std::string>& known) {
  double best = kUnlike;
  for (const auto& name : known) best = std::min(best, unlikeness(typed, name));
  std::vector<std::string> names;
  if (best >= kUnlike) return names;
  for (const auto& name : known)
    if (names.size() < 2 && unlikeness(typed, name) == best) names.push_back(name);
  return names;
}

std::string did_you_mean(const std::vector<std::string>& names) {
  if (names.empty()) return "";
  std::string text = "; did you mean '" + names[0] + "'";
  for (std::size_t i = 1; i < names.size(); ++i) text += " or '" + names[i] + "'";
  return text + "?";
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace mission
