// One byte stream of a satellite receiver: NMEA sentences, UBX messages and RTCM3 frames mixed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/bytes.hpp"
#include "drivers/offline.hpp"
#include "drivers/resync.hpp"

namespace drivers {

inline constexpr std::size_t kGnssFrameMax = 8 + 8192;  // The longest UBX message that is believed.

enum class GnssKind { nmea, ubx, rtcm3 };

// For Resync.
Look look_gnss(ByteView front);
// Of a frame that look_gnss() found.
GnssKind gnss_kind(ByteView frame);

// CRC-24Q over bytes: polynomial 0x1864CFB, from 0.
std::uint32_t crc24q(ByteView bytes);
// The message number of a whole RTCM3 frame (1005, 1077, ...), nothing where it holds none.
std::optional<std::uint16_t> rtcm3_type(ByteView frame);
Bytes encode_rtcm3(ByteView payload);

// Every sentence, message and frame; those that are not read further with their bytes.
std::unique_ptr<OfflineDecoder> gnss_offline();

}  // namespace drivers
