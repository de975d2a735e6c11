// The one table of every key a mission, robot or plan file may have. Reading, "did you mean", the
// summary of `vantage check` and the reference in configs/README.md all come from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "mission/config.hpp"

namespace mission {

enum class ConfigFile { mission, robot, plan };
std::string_view name(ConfigFile file);  // "mission", "robot" or "plan"

// Where a key's value lives in a MissionConfig. Its type says what the key accepts.
using Slot =
    std::variant<double*, int*, std::uint64_t*, bool*, std::string*, std::filesystem::path*>;

struct KeySpec {
  std::string key;
  std::function<Slot(MissionConfig&)> slot;
  double min{};  // Numbers only; both ends allowed.
  double max{};
  std::vector<std::string> choices;  // Text only; empty: any text but "".
  std::string unit;                  // "m", "deg/s", "share"; "" without
  std::string help;
};

struct SectionSpec {
  ConfigFile file{};
  std::string name;  // "" for the keys above the first [table]
  std::string help;
  std::vector<KeySpec> keys;
  // [regions] only: keys are free, values are among these.
  std::vector<std::string> entry_choices;
  // [[name]] only: adds one more entry, written there, which the slots mean from then on.
  std::function<void(MissionConfig&, const ConfigPlace&)> add_entry = nullptr;
};

const std::vector<SectionSpec>& config_schema();

// The key's name in MissionConfig::written.
std::string member_path(const SectionSpec& section, std::string_view key);

// Every key with its type, unit, range, default and meaning, as Markdown.
std::string config_reference();

// One value as the mission will use it.
struct EffectiveValue {
  std::string path;  // As in MissionConfig::written.
  std::string value;
  std::string unit;
  std::string origin;  // "default" or "file:line"
};

// Every key of the schema in its order, then the regions that the mission names.
std::vector<EffectiveValue> effective_values(const MissionConfig& config);

}  // namespace mission
