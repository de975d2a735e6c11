// FLIR (Directed Perception) pan-tilt units, ASCII: requests and their answers in order.
//
// The unit counts positive clockwise seen from above on most mounts; commissioning decides
// (PtuAxis::counter_clockwise), and angles here are REP-103.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers {

inline constexpr std::size_t kPtuLineMax = 512;

// For Resync: an answer line, or the answer of a reset, which has no line end; limits that were hit
// ("!P", "!T") stand before either.
Look look_ptu(ByteView front);

struct PtuAnswer {
  bool ok{};
  int pan_limits{}, tilt_limits{};  // How often each was said to be hit, before this answer.
  std::string echo;                 // What stood before '*' or '!': the unit repeats requests.
  std::string text;                 // After it, trimmed: "-2500", "Current Pan position is -2500".
};
PtuAnswer parse_ptu(ByteView frame);

// The number of an answer, terse or verbose; several as in "13.2,99,97,104".
std::optional<std::int64_t> ptu_integer(const PtuAnswer& answer);
std::vector<double> ptu_numbers(const PtuAnswer& answer);

// "PP" or "PP-2500", ended by a blank.
Bytes ptu_query(std::string_view command);
Bytes ptu_command(std::string_view command, std::int64_t value);

// How positions of an axis relate to angles: PR or TR.
struct PtuAxis {
  double arcsec_per_step = 46.2857;
  bool counter_clockwise{};  // Whether positive positions turn that way.

  double angle_rad(std::int64_t steps) const;
  std::int64_t steps(double angle_rad) const;  // Rounded to the nearest.
};

// What O answers: volts, and Fahrenheit turned into Celsius.
struct PtuHealth {
  double supply_v{};
  double head_c{}, pan_c{}, tilt_c{};
};
std::optional<PtuHealth> ptu_health(const PtuAnswer& answer);

// Of the rates from 600 baud on that a serial line can be set to, the likeliest first.
inline constexpr int kPtuBauds[] = {9600, 19200, 38400, 57600, 115200, 4800, 2400, 1200, 600};

// Asks, at a rate that may not be the unit's, what changes nothing: how large its steps are. Ends
// half a command first.
Bytes ptu_hail();
// Whether it is a unit that answers that, and not another device's line.
bool ptu_hailed(const PtuAnswer& answer);
// The arc seconds that PR or TR answer; nothing for what no unit has.
std::optional<double> ptu_step_arcsec(const PtuAnswer& answer);

// Null for answers that are no refusal.
const Fault* ptu_fault(const PtuAnswer& answer);

struct PtuStep {
  std::string_view purpose;
  Bytes request;
  double timeout_s{};
};
// Echo off, terse, at once, position control; then the queries that every unit answers.
std::vector<PtuStep> ptu_startup();

std::unique_ptr<OfflineDecoder> ptu_offline();

}  // namespace drivers
