// Reads one TOML text by the schema. Every error in one run, each with its place and remedy.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mission/config.hpp"
#include "mission/config_schema.hpp"

namespace mission {

struct ConfigReading {
  std::vector<ConfigError> errors;
  std::set<std::string> bad;  // Member paths of the keys whose value was refused.
  bool syntax_broken{};       // Some lines could not be read: a missing key proves nothing.
};

// Writes the values of the `which` part of the schema into config, and their places into
// config.written. `file` is the name for messages. Texts over 256 KiB are refused.
ConfigReading read_config(ConfigFile which, std::string_view text, const std::string& file,
                          MissionConfig& config);

}  // namespace mission
