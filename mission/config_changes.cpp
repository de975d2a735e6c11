#include "mission/config_changes.hpp"

#include <fmt/format.h>

#include <map>

#include "mission/config_schema.hpp"

namespace mission {

std::vector<std::string> config_changes(const MissionConfig& now, const MissionConfig& next) {
  std::map<std::string, std::string> before;
  for (const EffectiveValue& value : effective_values(now)) before[value.path] = value.value;
  std::vector<std::string> changes;
  for (const EffectiveValue& value : effective_values(next)) {
    const auto old = before.extract(value.path);
    if (old.empty())
      changes.push_back(fmt::format("{}: {}, new", value.path, value.value));
    else if (old.mapped() != value.value)
      changes.push_back(fmt::format("{}: {} instead of {}", value.path, value.value, old.mapped()));
  }
  for (const auto& [path, value] : before)
    changes.push_back(fmt::format("{}: no longer {}", path, value));
  return changes;
}

}  // namespace mission
