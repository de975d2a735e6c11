#include "mission/config_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mission/suggest.hpp"
#include "mission/toml_text.hpp"

namespace mission {
namespace {

using Where = toml::source_position;

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "the number";
    case toml::node_type::boolean:
      return "";
    default:
      return "a date or time";
  }
}

// What was found, short: "text 'abc'", "the number 3.5", "true", "a table".
std::string found(const toml::node& node) {
  std::string text = type_name(node);
  if (const auto* value = node.as_string()) return text + " '" + value->get().substr(0, 40) + "'";
  if (const auto* value = node.as_integer()) return fmt::format("{} {}", text, value->get());
  if (const auto* value = node.as_floating_point())
    return fmt::format("{} {:#}", text, value->get());
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  return text;
}

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + ('"' + names[i] + '"');
  return text;
}

// What one key accepts, in words: "a number from 0 to 100 m".
std::string wanted(const KeySpec& spec, const Slot& slot) {
  if (std::holds_alternative<bool*>(slot)) return "true or false";
  if (std::holds_alternative<std::filesystem::path*>(slot)) return "a path in quotes";
  if (std::holds_alternative<std::string*>(slot))
    return spec.choices.empty() ? "text in quotes" : quoted(spec.choices);
  if (spec.unit == "share") return fmt::format("a share from {} to {}", spec.min, spec.max);
  const std::string kind = std::holds_alternative<double*>(slot) ? "a number" : "a whole number";
  const std::string unit = spec.unit.empty() ? "" : " " + spec.unit;
  if (spec.max > 1e18) return fmt::format("{}, {} or more", kind, spec.min);
  return fmt::format("{} from {} to {}{}", kind, spec.min, spec.max, unit);
}

// Writes a node's value into its slot; returns what is wrong with it, or "".
class Setter {
 public:
  Setter(const KeySpec& spec, const toml::node& node) : spec_(spec), node_(node) {}

  std::string operator()(double* value) const {
    const auto number = node_.value<double>();
    if (!node_.is_number() || !number) return wrong_type(value);
    if (!std::isfinite(*number)) return wrong_range(value);
    return in_range(value, *number);
  }
  std::string operator()(int* value) const { return whole(value); }
  std::string operator()(std::uint64_t* value) const { return whole(value); }
  std::string operator()(bool* value) const {
    if (!node_.is_boolean()) return wrong_type(value);
    *value = node_.as_boolean()->get();
    return "";
  }
  std::string operator()(std::string* value) const {
    if (!node_.is_string()) return wrong_type(value);
    const auto& text = node_.as_string()->get();
    const auto& choices = spec_.choices;
    if (!choices.empty() && std::find(choices.begin(), choices.end(), text) == choices.end())
      return wrong_range(value) + did_you_mean(closest(text, choices));
    return text_value(value, text);
  }
  std::string operator()(std::filesystem::path* value) const {
    if (!node_.is_string()) return wrong_type(value);
    return text_value(value, node_.as_string()->get());
  }

 private:
  template <class T>
  std::string whole(T* value) const {
    if (!node_.is_integer()) return wrong_type(value);
    const auto number = node_.as_integer()->get();
    if (static_cast<double>(number) < spec_.min || static_cast<double>(number) > spec_.max)
      return wrong_range(value);
    *value = static_cast<T>(number);
    return "";
  }
  std::string in_range(double* value, double number) const {
    if (number < spec_.min || number > spec_.max) return wrong_range(value);
    *value = number;
    return "";
  }
  template <class T>
  std::string text_value(T* value, const std::string& text) const {
    if (text.empty())
      return fmt::format("'{}' is empty; leave the key out or fill it in", spec_.key);
    if (text.find('\0') != std::string::npos)
      return fmt::format("'{}' holds a NUL character; remove it", spec_.key);
    *value = T(text);
    return "";
  }
  template <class T>
  std::string wrong_type(T* value) const {
    std::string text =
        fmt::format("'{}' must be {}, found {}", spec_.key, wanted(spec_, value), found(node_));
    const bool wants_text =
        std::is_same_v<T, std::string> || std::is_same_v<T, std::filesystem::path>;
    if (node_.is_string() && !wants_text) text += "; write it without quotes";
    if (node_.is_array()) text += "; write one value without brackets";
    return text;
  }
  template <class T>
  std::string wrong_range(T* value) const {
    return fmt::format("'{}' must be {}, found {}", spec_.key, wanted(spec_, value), found(node_));
  }

  const KeySpec& spec_;
  const toml::node& node_;
};

// How a person would say where a key belongs, seen from a section of a file.
std::string place_name(const SectionSpec& section, ConfigFile from) {
  if (section.name.empty())
    return fmt::format("at the top of the {} file, above the first [table]", name(section.file));
  if (section.file == from) return fmt::format("in [{}]", section.name);
  return fmt::format("in [{}] of the {} file", section.name, name(section.file));
}

class Reader {
 public:
  Reader(ConfigFile which, const std::string& file, MissionConfig& config, ConfigReading& reading)
      : which_(which), file_(file), config_(config), reading_(reading) {}

  void read(const toml::table& top) {
    for (const auto& section : config_schema()) {
      if (section.file != which_) continue;
      if (section.name.empty())
        read_section(section, top);
      else if (const auto* node = top.get(section.name))
        read_named(section, *node);
    }
  }

 private:
  void read_named(const SectionSpec& section, const toml::node& node) {
    if (section.add_entry) return read_entries(section, node);
    if (const auto* table = node.as_table()) return read_section(section, *table);
    fail(
        node.source().begin,
        fmt::format("'{0}' must be a table, found {1}; write [{0}] and its keys on the lines below",
                    section.name, found(node)));
  }

  void read_entries(const SectionSpec& section, const toml::node& node) {
    const auto* entries = node.as_array();
    if (!entries || !entries->is_array_of_tables())
      return fail(
          node.source().begin,
          fmt::format("'{0}' must be tables, found {1}; write [[{0}]] before each one's keys",
                      section.name, found(node)));
    for (const toml::node& entry : *entries) {
      section.add_entry(config_, place(entry.source().begin));
      read_section(section, *entry.as_table());
    }
  }

  void read_section(const SectionSpec& section, const toml::table& table) {
    for (const auto& [key, node] : table) {
      const std::string name{key.str()};
      if (section.name.empty() && find_section(name)) continue;
      if (!section.entry_choices.empty()) {
        read_region(section, name, key.source().begin, node);
        continue;
      }
      const auto spec = std::find_if(section.keys.begin(), section.keys.end(),
                                     [&](const KeySpec& known) { return known.key == name; });
      if (spec == section.keys.end())
        fail(key.source().begin, unknown(section, name, node));
      else
        read_key(section, *spec, key.source().begin, node);
    }
  }

  void read_key(const SectionSpec& section, const KeySpec& spec, Where key,
                const toml::node& node) {
    const auto path = member_path(section, spec.key);
    const auto wrong = std::visit(Setter{spec, node}, spec.slot(config_));
    if (wrong.empty()) {
      config_.written[path] = place(key);
      return;
    }
    reading_.bad.insert(path);
    fail(node.source().begin, wrong);
  }

  void read_region(const SectionSpec& section, const std::string& region, Where key,
                   const toml::node& node) {
    KeySpec spec;
    spec.key = region;
    spec.choices = section.entry_choices;
    std::string mode;
    const auto wrong =
        region.empty() ? std::string("a region needs a name") : Setter{spec, node}(&mode);
    if (!wrong.empty()) return fail(node.source().begin, wrong);
    config_.regions[region] = mode;
    config_.written[member_path(section, region)] = place(key);
  }

  const SectionSpec* find_section(const std::string& name) const {
    for (const auto& section : config_schema())
      if (section.file == which_ && section.name == name && !name.empty()) return &section;
    return nullptr;
  }

  // Says what an unknown key may have meant: a key here, a key elsewhere, a table.
  std::string unknown(const SectionSpec& here, const std::string& key,
                      const toml::node& node) const {
    const bool table = node.is_table() || node.is_array_of_tables();
    std::string text = fmt::format("unknown {} '{}'", table ? "table" : "key", shown(key));
    const auto guess = table ? guess_section(here, key) : guess_key(here, key);
    if (!guess.empty()) return text + guess;
    std::vector<std::string> known;
    for (const auto& section : config_schema())
      if (table && section.file == which_ && !section.name.empty()) known.push_back(section.name);
    if (!table)
      for (const auto& spec : here.keys) known.push_back(spec.key);
    return text + "; known here: " + listed(known);
  }

  // Few people write plan files: nobody means their keys elsewhere.
  bool foreign(const SectionSpec& section) const {
    return section.file == ConfigFile::plan && which_ != ConfigFile::plan;
  }

  // Keys of this section first; then of the file's others, then of the other file.
  std::string guess_key(const SectionSpec& here, const std::string& key) const {
    double best = kUnlike;
    std::vector<std::pair<const SectionSpec*, const KeySpec*>> nearest;
    for (const auto& section : config_schema())
      for (const auto& spec : section.keys) {
        if (foreign(section)) continue;
        const double away = &section == &here ? 0 : section.file == which_ ? 0.6 : 0.9;
        const double unlike = unlikeness(key, spec.key) + away;
        if (unlike > best || unlike >= kUnlike) continue;
        if (unlike < best) nearest.clear();
        best = unlike;
        nearest.emplace_back(&section, &spec);
      }
    const auto section_guess = guess_section(here, key);
    if (nearest.empty() || (best > 1 && !section_guess.empty())) return section_guess;
    if (nearest[0].second->key == key) return "; it belongs " + places(nearest);
    return "; did you mean " + names(here, nearest) + "?";
  }

  using Found = std::vector<std::pair<const SectionSpec*, const KeySpec*>>;

  std::string places(const Found& keys) const {
    std::string text;
    for (const auto& [section, spec] : keys)
      text += (text.empty() ? "" : " or ") + place_name(*section, which_);
    return text;
  }

  std::string names(const SectionSpec& here, const Found& keys) const {
    std::string text;
    for (std::size_t i = 0; i < std::min<std::size_t>(keys.size(), 2); ++i) {
      const auto& [section, spec] = keys[i];
      text += fmt::format("{}'{}'", i == 0 ? "" : " or ", spec->key);
      if (!spec->unit.empty() && spec->unit != "voxels" && spec->unit != "share")
        text += " (in " + spec->unit + ")";
      if (section != &here) text += " " + place_name(*section, which_);
    }
    return text;
  }

  std::string guess_section(const SectionSpec& here, const std::string& key) const {
    double best = kUnlike;
    const SectionSpec* nearest = nullptr;
    for (const auto& section : config_schema()) {
      if (section.name.empty() || foreign(section)) continue;
      const double unlike = unlikeness(key, section.name) + (section.file == which_ ? 0 : 0.5);
      if (unlike >= best) continue;
      best = unlike;
      nearest = &section;
    }
    if (!nearest) return "";
    const std::string of =
        nearest->file == which_ ? "" : fmt::format(" of the {} file", name(nearest->file));
    if (nearest->name != key) return fmt::format("; did you mean [{}]{}?", nearest->name, of);
    if (!of.empty()) return fmt::format("; [{}] belongs in the {} file", key, name(nearest->file));
    return fmt::format("; [{}] stands by itself, not inside [{}]", key, here.name);
  }

  static std::string shown(const std::string& key) {
    return key.size() <= 60 ? key : key.substr(0, 57) + "...";
  }

  ConfigPlace place(Where where) const {
    return {file_, static_cast<int>(where.line), static_cast<int>(where.column)};
  }

  void fail(Where where, std::string message) {
    const auto at = place(where);
    reading_.errors.push_back({at.file, at.line, at.column, std::move(message)});
  }

  ConfigFile which_;
  const std::string& file_;
  MissionConfig& config_;
  ConfigReading& reading_;
};

}  // namespace

ConfigReading read_config(ConfigFile which, std::string_view text, const std::string& file,
                          MissionConfig& config) {
  ConfigReading reading;
  const auto parsed = parse_toml(text);
  for (const auto& error : parsed.errors)
    reading.errors.push_back({file, error.line, error.column, error.message});
  reading.syntax_broken = !parsed.errors.empty();
  if (parsed.table) Reader{which, file, config, reading}.read(*parsed.table);
  return reading;
}

}  // namespace mission
