// The dialogue that brings an LMS from power-up to streaming scans, as a list of settings with the
// answers that are expected.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/cola_codec.hpp"

namespace drivers {

struct LmsSettings {
  bool lms5xx{};
  bool remission{};  // RSSI beside the distances.
  std::int32_t frequency_centihz = 5000;
  std::int32_t resolution_1e4deg = 5000;
  std::int32_t start_1e4deg = -450000;  // Device angles: 90 degrees is straight ahead.
  std::int32_t stop_1e4deg = 2250000;
  std::uint16_t every_nth_scan = 1;
  std::uint32_t password = 0xF4724744;  // Of the authorised client; 0x6FD62C05 on safety TiMs.
};

// Empty, or why no such scanner has these settings, with what it has.
std::string lms_settings_problem(const LmsSettings& settings);

struct LmsStep {
  std::string_view purpose;
  Bytes request;
  std::string_view command, name;  // Of the answer.
  Bytes body;                      // Of the answer; empty: any.
  double timeout_s = 2;
  bool may_fail{};  // Informative: go on without an answer.
};

std::vector<LmsStep> lms_startup(ColaDialect dialect, const LmsSettings& settings);
std::vector<LmsStep> lms_stop(ColaDialect dialect);
// Asked of anything that may be a scanner of this dialect.
LmsStep lms_hello(ColaDialect dialect);
// The model's name; old firmware refuses to say.
LmsStep lms_model(ColaDialect dialect);
// What the settings are now. Firmware that cannot tell some of them refuses.
std::vector<LmsStep> lms_read_back(ColaDialect dialect);
// Empty, or which setting differs, of an answer to lms_read_back().
std::string lms_read_back_problem(const LmsSettings& settings, const ColaMessage& message);
// The text of an answer that is one, as FirmwareVersion's and LocationName's; of DeviceIdent the
// first.
std::string lms_text(const ColaMessage& message);

enum class LmsAnswer { accepted, refused, unrelated };
// Answers are matched by name: events and late answers may come between.
LmsAnswer lms_judge(const LmsStep& step, const ColaMessage& message);
// What a refusal says, for people: the fault's name and remedy.
std::string lms_refusal(const LmsStep& step, const ColaMessage& message);

}  // namespace drivers
