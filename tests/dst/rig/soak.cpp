#include "tests/dst/rig/soak.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/random_site.hpp"

namespace dst {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration kSoakFrom = 12s;

double resident_mib() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024 * 1024);
}

int descriptors() {
  int count = 0;
  for ([[maybe_unused]] const auto& each : std::filesystem::directory_iterator("/proc/self/fd"))
    ++count;
  return count;
}

// About one a minute, of any device, over before the e-stop is.
std::vector<DeviceFault> flickers(std::uint64_t seed, hal::Duration during) {
  support::Dice dice(seed);
  std::vector<DeviceFault> faults;
  for (hal::Duration at = kSoakFrom + 10s; at < kSoakFrom + during - 2min;) {
    const auto role = kRoles[static_cast<std::size_t>(dice.below(std::size(kRoles)))];
    const auto fault = static_cast<sim::UnitFault>(1 + dice.below(8));
    const hal::Duration lasts = hal::from_seconds(dice.uniform(0.1, 50));
    const double amount = fault == sim::UnitFault::wrong  ? 0.5
                          : fault == sim::UnitFault::slow ? 3
                                                          : 1;
    faults.push_back({std::string(role), {fault, amount}, at, lasts});
    at += lasts + hal::from_seconds(dice.uniform(1, 60));
  }
  return faults;
}

}  // namespace

std::string SoakResult::text() const {
  return fmt::format(
      "{:.1f} h of virtual time with {} faults in {:.0f} s: {:.0f} times real time; resident "
      "memory "
      "{:.1f} MiB at most in the first tenth, {:.1f} MiB after it; {} and {} descriptors; end: "
      "{}\n",
      hal::seconds(outcome.virtual_time) / 3600, faults, outcome.cpu_s,
      hal::seconds(outcome.virtual_time) / outcome.cpu_s, resident_early_mib, resident_late_mib,
      descriptors_early, descriptors_late, outcome.end);
}

SoakResult soak(std::uint64_t seed, hal::Duration during) {
  Scenario scenario;
  scenario.seed = seed;
  scenario.releases_after = 5s;
  scenario.faults = flickers(seed, during);
  scenario.presses = {{Press::base_estop, kSoakFrom, during}};
  SoakResult result;
  result.faults = static_cast<int>(scenario.faults.size());
  Options options;
  options.ends_within = during + 3h;
  hal::Duration minutes{};
  options.each_minute = [&] {
    minutes += 1min;
    const bool early = minutes <= during / 10;
    double& resident = early ? result.resident_early_mib : result.resident_late_mib;
    int& open = early ? result.descriptors_early : result.descriptors_late;
    if (minutes > during) return;  // The mission goes on, and its map grows.
    resident = std::max(resident, resident_mib());
    open = std::max(open, descriptors());
  };
  result.outcome = run_mission(make_quiet_yard(), scenario, options);
  return result;
}

}  // namespace dst
