// UBX from the receiver's side, for simulated ones, and configuration by key as it is read.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "drivers/ubx_codec.hpp"

namespace drivers {

// Whole frames that read back as the same values. What the codec does not read is zero.
Bytes encode_ubx(const UbxNavPvt& pvt);
Bytes encode_ubx(const UbxNavHpposllh& position);
Bytes encode_ubx(const UbxNavCov& covariance);
Bytes encode_ubx(const UbxNavEoe& end);
Bytes encode_ubx(const UbxMonVer& version);
Bytes encode_ubx(const UbxMonRf& rf);
Bytes encode_ubx(const UbxRxmRtcm& rtcm);
Bytes encode_ubx(const UbxAck& ack);

// CFG-VALSET (06 8A), CFG-VALGET and its answer (06 8B) have settings after a head of 4 bytes. A
// question has keys without values.
std::optional<std::vector<UbxSetting>> ubx_settings(const UbxMessage& message);
std::optional<std::vector<std::uint32_t>> ubx_asked_keys(const UbxMessage& message);
// What is set now (layer RAM). At most 64 keys.
Bytes ubx_valget(std::span<const std::uint32_t> keys);
Bytes ubx_valget_answer(std::span<const UbxSetting> settings);

// Bytes that a key's value takes, 0 where the key tells none.
int ubx_width(std::uint32_t key);

}  // namespace drivers
