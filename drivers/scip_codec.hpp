// Hokuyo SCIP 2.x: requests, replies, and scans of distances and intensities.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers {

inline constexpr std::size_t kScipFrameMax = 64 * 1024;

// For Resync: a reply from its echo to the empty line that ends it.
Look look_scip(ByteView front);

// The character after a line: six bits of the sum of its bytes.
char scip_checksum(std::string_view line);

struct ScipReply {
  std::string_view echo;                // "MD0384038400000"
  std::string_view status;              // "00", "99", "0E"
  std::vector<std::string_view> lines;  // After the status, without their checksums.
};
// Into a reply whose memory is reused; views into the frame. Empty, or what is wrong.
std::string_view parse_scip(ByteView frame, ScipReply& into);

// "KEY:value;" lines of VV, PP and II.
using ScipInfo = std::vector<std::pair<std::string, std::string>>;
std::optional<ScipInfo> scip_info(const ScipReply& reply);

// What PP says; all of it is needed to use scans.
struct ScipParameters {
  std::string model;
  int range_min_mm{}, range_max_mm{};
  int steps_per_turn{}, step_first{}, step_last{}, step_front{};
  int speed_rpm{};
};
// Empty, or the key that is missing or cannot be.
std::string scip_parameters(const ScipInfo& info, ScipParameters& into);

struct ScipScan {
  bool intensities{};       // ME, GE
  std::uint32_t time_ms{};  // 24 bits: wraps after 4 h 39 min 37 s.
  int step_first{}, step_last{}, group = 1;
  std::optional<int> remaining;  // Of streams: scans still to come; 0 where endless.
  std::vector<std::uint32_t> distances_mm, intensities_raw;
};
// MD, MS, ME, GD, GS and GE replies with data. Empty, or what is wrong.
std::string_view decode_scip_scan(const ScipReply& reply, ScipScan& into);

// The clock that TM1 answers with, of 24 bits like a scan's.
std::optional<std::uint32_t> scip_time_ms(const ScipReply& reply);

// REP-103: counter-clockwise, 0 is the front.
double scip_angle_rad(const ScipParameters& parameters, const ScipScan& scan, std::size_t beam);
// Only what lies within the device's limits is a range.
bool scip_is_range(const ScipParameters& parameters, std::uint32_t distance_mm);
// What the URG-04LX says with a distance below its least: by code, null where it is a range.
const Fault* scip_urg_distance(std::uint32_t distance_mm);

// Six bits a character, most significant first; nothing where one cannot be.
std::optional<std::uint32_t> scip_decode(std::string_view characters);
Bytes scip_request(std::string_view command);
// MD (3 characters a distance), or ME with intensities. `scans` 0: endless.
Bytes scip_stream_request(bool intensities, int step_first, int step_last, int group, int skip,
                          int scans);

// By status, which the whole reply decides: null where it is no fault.
const Fault* scip_fault(const ScipReply& reply);

std::unique_ptr<OfflineDecoder> scip_offline();

}  // namespace drivers
