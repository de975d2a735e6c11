// What a rover's computer looks at in the corrections that it passes on: when they were measured,
// and where their base stands. The rest is for the receiver.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "drivers/bytes.hpp"

namespace drivers {

// Of a whole frame with observations (MSM, types 1071 to 1137): when they were measured.
struct Rtcm3Epoch {
  std::uint16_t type{};
  std::uint32_t raw{};                  // As sent: of one type it differs from epoch to epoch.
  std::optional<std::uint32_t> tow_ms;  // Of the GPS week, where the system counts as GPS does.
};
std::optional<Rtcm3Epoch> rtcm3_epoch(ByteView frame);

// Of a whole frame 1005 or 1006: the base, earth-centred and earth-fixed.
std::optional<Eigen::Vector3d> rtcm3_base_m(ByteView frame);

// The other way round, for simulated bases. A frame of observations has room for `content_bytes`
// after its header, which are taken as they are.
Bytes encode_rtcm3_base(std::uint16_t station, const Eigen::Vector3d& ecef_m);
Bytes encode_rtcm3_msm(std::uint16_t type, std::uint16_t station, std::uint32_t epoch_raw,
                       ByteView content);

}  // namespace drivers
