// The dialogue that brings a VN-100 from power-up to streaming, as a list of settings with what is
// read back.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/vn100_codec.hpp"

namespace drivers {

struct Vn100Settings {
  int rate_hz =
      50;  // Packets: a divisor of 800, at most 400. Lines: 1 2 4 5 10 20 25 40 50 100 200.
  bool ascii = false;  // Lines (VNYMR) instead of packets: they carry no time of the device.
  int baud = 115200;   // The rate of the port; 9600 .. 921600.
};

inline constexpr int kVn100Bauds[] = {115200, 921600, 57600, 460800, 230400, 38400, 19200, 9600};

// Empty, or why no such device has these settings, with what would do.
std::string vn100_settings_problem(const Vn100Settings& settings);

// Time, attitude, rates, acceleration and the filter's state.
Vn100Output vn100_output(const Vn100Settings& settings);

struct Vn100Step {
  std::string_view purpose;
  std::string request;              // Without '$' and checksum.
  std::string type;                 // Of the answer: "VNRRG".
  std::vector<std::string> fields;  // The answer's first; numbers equal whatever their zeros.
  int identity_register{};          // 1, 3 or 4: the answer says who it is.
};
std::vector<Vn100Step> vn100_steps(const Vn100Settings& settings);

enum class Vn100Answer { accepted, refused, other_value, unrelated };
// Measurements come between; VNERR refuses what was asked last.
Vn100Answer vn100_judge(const Vn100Step& step, const Vn100Line& line);
// What a refusal says, for people.
std::string vn100_refusal(const Vn100Step& step, const Vn100Line& line);

}  // namespace drivers
