// SICK LMS1xx and LMS5xx (also TiM, LRS, MRS1000): scans and the start-up dialogue over CoLa.
//
// Angles are the device's own, in 1e-4 degrees counter-clockwise seen from above with 90 degrees
// straight ahead; beam_angle_rad() turns them into REP-103 (0 is ahead, left positive).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/cola_codec.hpp"
#include "drivers/offline.hpp"

namespace drivers {

struct LmsEncoder {
  std::uint32_t position{};
  std::uint16_t speed{};
};

struct LmsChannel {
  std::array<char, 5> name{};  // "DIST1".."DIST5", "RSSI1".., "ANGL1", "VANG1"
  float scale{1}, offset{};    // Value = scale * raw + offset; millimetres for DIST.
  std::int32_t start_1e4deg{};
  std::uint16_t step_1e4deg{};
  std::vector<std::uint16_t> raw;

  std::string_view label() const { return {name.data(), name.size()}; }
};

struct LmsPosition {
  std::array<float, 3> xyz{}, rotation{};
  std::uint8_t type{};
};

struct LmsTime {
  std::uint16_t year{};
  std::uint8_t month{}, day{}, hour{}, minute{}, second{};
  std::uint32_t microsecond{};
};

struct LmsEvent {
  std::array<char, 4> type{};
  std::uint32_t encoder_position{}, time_us{};
  std::int32_t angle_1e4deg{};
};

// A whole LMDscandata telegram.
struct LmsScan {
  std::uint16_t version{};
  std::uint16_t device_number{};
  std::uint32_t serial_number{};
  std::array<std::uint8_t, 2> status{};
  std::uint16_t telegram_counter{};
  std::uint16_t scan_counter{};
  std::uint32_t scan_start_us{};  // Device clock at the first beam; wraps after 71 min 35 s.
  std::uint32_t transmit_us{};
  std::array<std::uint8_t, 2> inputs{}, outputs{};
  std::int16_t layer_angle{};  // Devices with layers only; 1/200 degree on the MRS1104.
  std::uint32_t scan_frequency_centihz{};
  std::uint32_t measurement_frequency_100hz{};
  std::vector<LmsEncoder> encoders;
  std::vector<LmsChannel> channels16, channels8;
  std::optional<LmsPosition> position;
  std::string name, comment;
  std::optional<LmsTime> time;
  std::optional<LmsEvent> event;

  // The first echo's distances, or null.
  const LmsChannel* distances() const;
};

// The body of an LMDscandata telegram (sSN or sRA) into a scan whose memory is reused. Empty when
// all of it was read with nothing left over; else what is wrong, and the scan holds nonsense.
std::string_view decode_lms_scan(const ColaMessage& message, LmsScan& into);
// The other way round, for simulated scanners and tests.
Bytes encode_lms_scan(ColaDialect dialect, std::string_view command, const LmsScan& scan);

double beam_angle_rad(const LmsChannel& channel, std::size_t beam);
// After the scan's start.
double beam_delay_s(const LmsScan& scan, const LmsChannel& channel, std::size_t beam);

enum class LmsRaw { range, nothing, dazzled, implausible, filtered };
// What a raw distance says, with LMS5xx's special values; LMS1xx knows `nothing` only.
LmsRaw lms_raw_meaning(std::uint16_t raw, bool lms5xx);
double lms_range_m(const LmsChannel& channel, std::uint16_t raw);
// Of a whole channel as hal::Profile has them: 0 for nothing, NaN for what says nothing.
std::vector<float> lms_ranges_m(const LmsChannel& channel, bool lms5xx);

// Of a scan's status bytes.
std::vector<const Fault*> lms_faults(const LmsScan& scan);
// By code: STlms, SCdevicestate (informative: some say busy while they work), and the answers of
// mLMPsetscancfg and LMCstartmeas.
std::span<const Fault> lms_states();
std::span<const Fault> lms_device_states();
std::span<const Fault> lms_scan_config_errors();
std::span<const Fault> lms_start_errors();

// Tells repeated telegrams (some firmware sends one twice) and lost scans by the counters.
class LmsSequence {
 public:
  enum class Seen { next, repeated, gap, restarted };
  Seen see(const LmsScan& scan);
  std::uint64_t lost() const { return lost_; }
  std::uint64_t repeated() const { return repeated_; }

 private:
  bool any_{};
  std::uint16_t scan_{}, telegram_{};
  std::uint32_t start_us_{};
  std::uint64_t lost_{}, repeated_{};
};

std::unique_ptr<OfflineDecoder> sick_lms_offline();

}  // namespace drivers
