// u-blox UBX: the messages that a rover needs, in the receiver's own integers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/gnss_values.hpp"

namespace drivers {

struct UbxMessage {
  std::uint8_t cls{}, id{};
  ByteView payload;
};
// A frame that look_gnss() found.
UbxMessage parse_ubx(ByteView frame);

enum class UbxCarrier : std::uint8_t { none, floating, fixed };

struct UbxNavPvt {
  std::uint32_t itow_ms{};
  std::uint16_t year{};
  std::uint8_t month{}, day{}, hour{}, minute{}, second{};
  bool date_valid{}, time_valid{}, fully_resolved{}, magnetic_valid{};
  std::uint32_t time_accuracy_ns{};
  std::int32_t nano{};      // May be negative: before the second.
  std::uint8_t fix_type{};  // 0 none, 1 dead reckoning, 2 plane, 3 with height, 4 both, 5 time.
  bool fix_ok{}, differential{}, heading_valid{};
  UbxCarrier carrier{};
  std::uint8_t flags2{}, satellites{};
  std::int32_t longitude_1e7deg{}, latitude_1e7deg{};
  std::int32_t height_mm{}, height_msl_mm{};
  std::uint32_t horizontal_accuracy_mm{}, vertical_accuracy_mm{};
  std::int32_t north_mmps{}, east_mmps{}, down_mmps{}, ground_speed_mmps{};
  std::int32_t motion_heading_1e5deg{};
  std::uint32_t speed_accuracy_mmps{}, heading_accuracy_1e5deg{};
  std::uint16_t pdop_centi{};
  bool position_invalid{};
  std::uint8_t correction_age_code{};
  std::int32_t vehicle_heading_1e5deg{};  // 92-byte form only, as are the next two.
  std::int16_t declination_centideg{};
  std::uint16_t declination_accuracy_centideg{};
};
struct UbxNavHpposllh {
  std::uint32_t itow_ms{};
  bool invalid{};
  std::int64_t longitude_1e9deg{}, latitude_1e9deg{};
  std::int64_t height_01mm{}, height_msl_01mm{};  // 0.1 mm
  std::uint32_t horizontal_accuracy_01mm{}, vertical_accuracy_01mm{};
};
struct UbxNavRelposned {
  std::uint32_t itow_ms{};
  std::uint16_t station{};
  std::int64_t north_01mm{}, east_01mm{}, down_01mm{}, length_01mm{};
  std::int32_t heading_1e5deg{};
  std::uint32_t north_accuracy_01mm{}, east_accuracy_01mm{}, down_accuracy_01mm{};
  std::uint32_t length_accuracy_01mm{}, heading_accuracy_1e5deg{};
  bool fix_ok{}, differential{}, position_valid{}, heading_valid{};
  UbxCarrier carrier{};
};
struct UbxNavStatus {
  std::uint32_t itow_ms{};
  std::uint8_t fix_type{}, flags{}, fix_status{}, flags2{};
  std::uint32_t first_fix_ms{}, uptime_ms{};
};
struct UbxNavDop {
  std::uint32_t itow_ms{};
  // In hundredths.
  std::uint16_t geometric{}, position{}, time{}, vertical{}, horizontal{}, northing{}, easting{};
};
struct UbxNavCov {
  std::uint32_t itow_ms{};
  bool position_valid{}, velocity_valid{};
  std::array<float, 6> position_m2{}, velocity_m2ps2{};  // NN NE ND EE ED DD
};
struct UbxNavEoe {
  std::uint32_t itow_ms{};
};
struct UbxMonVer {
  std::string software, hardware;
  std::vector<std::string> extensions;
};
struct UbxMonRf {
  struct Block {
    std::uint8_t id{}, jamming{}, antenna{}, power{};
    std::uint32_t post_status{};
    std::uint16_t noise{}, gain{};
    std::uint8_t jamming_indicator{};
  };
  std::vector<Block> blocks;
};
struct UbxRxmRtcm {
  bool crc_failed{};
  std::uint8_t used{};  // 0 unknown, 1 not used, 2 used.
  std::uint16_t sub_type{}, station{}, type{};
};
struct UbxAck {
  bool accepted{};
  std::uint8_t cls{}, id{};  // Of what was sent.
};

// Nothing where it is another message or its length is not one that is known.
std::optional<UbxNavPvt> ubx_nav_pvt(const UbxMessage& message);
std::optional<UbxNavHpposllh> ubx_nav_hpposllh(const UbxMessage& message);
std::optional<UbxNavRelposned> ubx_nav_relposned(const UbxMessage& message);
std::optional<UbxNavStatus> ubx_nav_status(const UbxMessage& message);
std::optional<UbxNavDop> ubx_nav_dop(const UbxMessage& message);
std::optional<UbxNavCov> ubx_nav_cov(const UbxMessage& message);
std::optional<UbxNavEoe> ubx_nav_eoe(const UbxMessage& message);
std::optional<UbxMonVer> ubx_mon_ver(const UbxMessage& message);
std::optional<UbxMonRf> ubx_mon_rf(const UbxMessage& message);
std::optional<UbxRxmRtcm> ubx_rxm_rtcm(const UbxMessage& message);
std::optional<UbxAck> ubx_ack(const UbxMessage& message);

std::vector<const Fault*> ubx_faults(const UbxNavPvt& pvt);
std::vector<const Fault*> ubx_faults(const UbxNavStatus& status);
std::vector<const Fault*> ubx_faults(const UbxMonRf::Block& block);
std::vector<const Fault*> ubx_faults(const UbxRxmRtcm& rtcm);

Bytes encode_ubx(std::uint8_t cls, std::uint8_t id, ByteView payload = {});

// Configuration of the ninth generation and later, by key.
struct UbxSetting {
  std::uint32_t key{};
  std::uint64_t value{};  // As wide as the key says.
};
namespace ubx_key {
inline constexpr std::uint32_t kRateMeas_ms = 0x30210001, kRateNav = 0x30210002;
inline constexpr std::uint32_t kNavPvtUart1 = 0x20910007, kNavPvtUsb = 0x20910009;
inline constexpr std::uint32_t kNavHpposllhUart1 = 0x20910034, kUart1Baud = 0x40520001;
inline constexpr std::uint32_t kUart1OutNmea = 0x10740002, kUart1InRtcm3 = 0x10730004;
inline constexpr std::uint32_t kNavCovUart1 = 0x20910084, kNavEoeUart1 = 0x20910160;
inline constexpr std::uint32_t kMonRfUart1 = 0x2091035A, kRxmRtcmUart1 = 0x20910269;
inline constexpr std::uint32_t kUsbOutNmea = 0x10780002, kUsbInRtcm3 = 0x10770004;
inline constexpr std::uint32_t kDynamicModel = 0x20110021;
}  // namespace ubx_key
enum class UbxLayer : std::uint8_t { ram = 1, battery = 2, flash = 4 };

// At most 64 settings. Nothing where a key has no width that is known.
std::optional<Bytes> ubx_valset(std::uint8_t layers, std::span<const UbxSetting> settings);
// Configuration of the eighth generation.
Bytes ubx_cfg_rate(std::uint16_t measurement_ms, std::uint16_t navigation, std::uint16_t reference);
Bytes ubx_cfg_msg(std::uint8_t cls, std::uint8_t id, std::uint8_t rate);
Bytes ubx_cfg_nav5_model(std::uint8_t dynamic_model);

// Messages of one instant put together: NAV-PVT, refined by NAV-HPPOSLLH, NAV-COV and NAV-DOP.
// Ends with NAV-EOE where the receiver sends it.
class UbxEpochs {
 public:
  std::vector<GnssEpoch> add(const UbxMessage& message);
  std::optional<GnssEpoch> flush();

 private:
  EpochEnd end_;
  bool eoe_{}, has_pvt_{};
  GnssEpoch epoch_;
};

GnssEpoch epoch_of(const UbxNavPvt& pvt);

}  // namespace drivers
