// The dialogue that brings a u-blox receiver from power-up to epochs: who it is, and a list of
// settings with what is acknowledged and read back.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/ubx_codec.hpp"

namespace drivers {

enum class UbloxPort : std::uint8_t { usb, uart1 };  // Of the receiver: where our line ends.

struct UbloxSettings {
  int rate_hz = 5;  // Epochs; 1 .. 20.
  UbloxPort port = UbloxPort::uart1;
  std::uint8_t dynamic_model = 3;  // 0 portable, 2 stationary, 3 pedestrian, 4 automotive.
  bool corrections = false;        // RTCM comes in on the same port.
  int baud = 38400;                // Asked at first; what the receiver is set to.
};

// An eighth generation is told by CFG-MSG and its like, a ninth (ZED-F9P) by CFG-VALSET.
enum class UbloxDialect : std::uint8_t { m8, f9 };

struct UbloxModel {
  std::string model, firmware, hardware;
  double protocol{};
  UbloxDialect dialect{};
};
// Nothing where it says no protocol version.
std::optional<UbloxModel> ublox_model(const UbxMonVer& version);
// Older ones have no NAV-PVT.
inline constexpr double kUbloxProtocolLeast = 14;

inline constexpr int kUbloxBauds[] = {38400, 9600, 115200, 460800, 230400, 921600, 57600, 19200};

// Empty, or why no receiver has these settings.
std::string ublox_settings_problem(const UbloxSettings& settings);

struct UbloxStep {
  std::string_view purpose;
  Bytes request;
  std::uint8_t cls{}, id{};          // Of the request: what is acknowledged.
  Bytes reads_back;                  // Payload that the question's answer must begin with, or
  std::vector<UbxSetting> settings;  // the settings that it must hold. Neither: acknowledged only.
};
std::vector<UbloxStep> ublox_steps(UbloxDialect dialect, const UbloxSettings& settings);

enum class UbloxAnswer { accepted, refused, other_value, unrelated };
UbloxAnswer ublox_judge(const UbloxStep& step, const UbxMessage& message);

}  // namespace drivers
