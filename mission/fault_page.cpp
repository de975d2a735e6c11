// The manual's page about faults.
#include <fmt/format.h>

#include "mission/faults.hpp"

namespace mission {
namespace {

constexpr std::string_view kFaultsHead =
    R"(# Faults

Made by `vantage explain --all --markdown`; do not edit. What each fault makes the robot do, least
first:

| action | what the robot does |
|---|---|
| note | says it and goes on |
| rescan | takes the scan again, a bounded number of times |
| home | ends the mission and drives home |
| hold | stands until it is over |
| stop | stands until it is over *and* a person has released the robot |

Of several faults the gravest action is taken; among equals the one that stands first below leads.

| id | action | cause | effect | remedy |
|---|---|---|---|---|
)";

}  // namespace

std::string faults_page() {
  std::string page(kFaultsHead);
  for (const FaultEntry& fault : all_faults())
    page += fmt::format("| {} | {} | {} | {} | {} |\n", fault.id, name(fault.action), fault.cause,
                        fault.effect, fault.remedy);
  return page;
}

}  // namespace mission
