// Mission and robot files are outside bytes: none may crash the reader, and a text that it accepts
// must be one that it can say again.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "mission/config.hpp"
#include "mission/config_schema.hpp"

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void check_places(const mission::LoadedMission& loaded) {
  for (const auto& error : loaded.errors) {
    require(!error.message.empty());
    require(error.line >= 1 && error.column >= 1);
  }
}

// What the schema promises of accepted numbers.
void check_ranges(mission::MissionConfig& config) {
  for (const auto& section : mission::config_schema()) {
    if (section.add_entry && config.plan.stations.empty()) continue;  // No entry to look at.
    for (const auto& spec : section.keys) {
      const auto slot = spec.slot(config);
      if (const auto* const* number = std::get_if<double*>(&slot))
        require(**number >= spec.min && **number <= spec.max);
      if (const auto* const* number = std::get_if<int*>(&slot))
        require(**number >= spec.min && **number <= spec.max);
    }
  }
}

}  // namespace

// The text up to the first NUL is the mission file, the rest is the robot file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto cut = text.find('\0');
  const auto robot = cut == std::string_view::npos ? std::string_view{} : text.substr(cut + 1);
  auto loaded = mission::parse_mission(text.substr(0, cut), "m.toml", robot, "r.toml");
  check_places(loaded);
  check_ranges(loaded.config);
  return 0;
}
