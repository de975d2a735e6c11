// What a robot file says of its scanner, in the terms of the drivers. Like main.cpp it may know
// everything.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/ouster_codec.hpp"
#include "drivers/scip_codec.hpp"
#include "drivers/sick_lms_startup.hpp"
#include "drivers/sweep_assembly.hpp"
#include "mission/config.hpp"

namespace mission {

inline constexpr double kPanAcceleration_radps2 = 0.5;

// Whether it measures in one plane and a pan unit turns it; else it turns by itself and sends
// packets.
bool needs_pan(const ScannerConfig& scanner);

// On the way, beams of what turns by itself that go higher than this are not looked at.
double look_max_rad();

// Of a profile scanner: how it hangs on the pan axis, and what a scan of both covers.
drivers::SweepMount mount_of(const ScannerConfig& scanner);
drivers::SweepField field_of(const ScannerConfig& scanner);

// What a SICK is set to. Of the frequencies that it has at this resolution, the fastest.
drivers::LmsSettings lms_settings(const ScannerConfig& scanner);

// What Hokuyos of this model say of themselves; of one that is not known, what most of them say.
drivers::ScipParameters hokuyo_parameters(const std::string& model);

// What the metadata file of an Ouster holds, or what is wrong with it.
struct OusterFile {
  drivers::OusterMetadata metadata;
  std::string text;     // As it stands there.
  std::string problem;  // Empty: nothing.
};
OusterFile ouster_file(const ScannerConfig& scanner);

// Where a scanner's packets are expected: of a link udp:PORT; 0: of another one.
std::uint16_t packets_port(const ScannerConfig& scanner);
// Whether there is an Ouster that is to be asked for its settings.
bool asks_ouster(const ScannerConfig& scanner);

}  // namespace mission
