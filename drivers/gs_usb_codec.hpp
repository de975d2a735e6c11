// gs_usb (candleLight, CANable and kin) on USB: control structures and bulk frames. Little-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/fault.hpp"
#include "drivers/unread.hpp"
#include "hal/frames.hpp"

namespace drivers::gs_usb {

// Vendor requests to the interface: bmRequestType 0x41 out, 0xC1 in.
enum class Request : std::uint8_t {
  host_format = 0,
  bit_timing = 1,
  mode = 2,
  bit_timing_limits = 4,
  device_config = 5,
  timestamp = 6,
  identify = 7,
  get_state = 14,
};

// What a channel can do, and the flags it is started with.
enum Feature : std::uint32_t {
  kListenOnly = 1U << 0,
  kLoopBack = 1U << 1,
  kTripleSample = 1U << 2,
  kOneShot = 1U << 3,
  kHardwareTime = 1U << 4,
  kIdentify = 1U << 5,
  kPadPackets = 1U << 7,
  kFlexibleRate = 1U << 8,
  kBusErrors = 1U << 12,
  kGetState = 1U << 13,
};

struct BitTiming {  // In time quanta; the first quantum of a bit is not counted here.
  std::uint32_t propagation{}, phase1{}, phase2{}, jump_width{}, prescaler{};
  bool operator==(const BitTiming&) const = default;
};
struct BitTimingLimits {
  std::uint32_t features{};  // See Feature.
  std::uint32_t clock_hz{};
  std::uint32_t segment1_min{}, segment1_max{};  // Propagation and phase 1 together.
  std::uint32_t segment2_min{}, segment2_max{};
  std::uint32_t jump_width_max{};
  std::uint32_t prescaler_min{}, prescaler_max{}, prescaler_step{};
  bool operator==(const BitTimingLimits&) const = default;
};
struct DeviceConfig {
  std::uint8_t channels{};
  std::uint32_t software_version{}, hardware_version{};
  bool operator==(const DeviceConfig&) const = default;
};
enum class BusState : std::uint32_t { active, warning, passive, bus_off, stopped, sleeping };
struct DeviceState {
  BusState state{};
  std::uint32_t receive_errors{}, transmit_errors{};
  bool operator==(const DeviceState&) const = default;
};

Bytes host_format();  // The device then speaks little-endian.
Bytes encode(const BitTiming& timing);
Bytes start_mode(std::uint32_t flags);
Bytes reset_mode();
Bytes identify(bool blink);
// Nothing for replies that are too short or have a value that the protocol does not.
std::optional<BitTimingLimits> decode_limits(ByteView reply);
std::optional<DeviceConfig> decode_config(ByteView reply);
std::optional<DeviceState> decode_state(ByteView reply);
std::optional<std::uint32_t> decode_timestamp_us(ByteView reply);
// The same from the device's side, for simulated adapters.
Bytes encode(const BitTimingLimits& limits);
Bytes encode(const DeviceConfig& config);
Bytes encode(const DeviceState& state);
std::optional<BitTiming> decode_timing(ByteView data);

// Exactly that rate, sampled at or next to `sample_permille` of the bit; nothing where the clock
// does not divide. Of equal ones the one with the most quanta.
std::optional<BitTiming> timing_for(const BitTimingLimits& limits, std::uint32_t bit_rate,
                                    std::uint32_t sample_permille = 875);

// --- Bulk frames.

constexpr std::size_t kFrameSize = 20, kTimedFrameSize = 24;
constexpr std::uint32_t kReceived = 0xFFFFFFFF;  // Echo id of frames from the bus.
constexpr std::uint32_t kInFlightMax = 10;       // Frames sent whose echo is still missing.

struct Received {  // From the bus.
  hal::CanFrame frame;
  std::uint8_t channel{};
  bool overflow{};                       // The adapter lost frames before this one.
  std::optional<std::uint32_t> time_us;  // The adapter's clock; wraps after 71.6 min.
  bool operator==(const Received&) const = default;
};
struct Echo {  // Our frame was acknowledged on the bus: its slot is free.
  std::uint32_t id{};
  std::uint8_t channel{};
  hal::CanFrame frame;
  std::optional<std::uint32_t> time_us;
  bool operator==(const Echo&) const = default;
};
struct BusError {
  std::uint8_t channel{};
  std::uint32_t classes{};              // See bus_faults().
  std::uint8_t controller{};            // Byte 1: see controller_faults().
  std::uint8_t protocol{}, location{};  // Bytes 2 and 3.
  std::uint8_t transmit_errors{}, receive_errors{};
  bool operator==(const BusError&) const = default;
};
using HostFrame = std::variant<Unread, Received, Echo, BusError>;

// with_time: the channel was started with kHardwareTime. Longer transfers are padding. Unread for
// short ones and for CAN FD. Allocates nothing.
HostFrame decode(ByteView transfer, bool with_time);

// What is sent to the device: 20 bytes. echo_id: 0 .. kInFlightMax - 1.
std::array<std::uint8_t, kFrameSize> encode(const hal::CanFrame& frame, std::uint8_t channel,
                                            std::uint32_t echo_id);
// What a device sends, for simulated adapters: 20 bytes, 24 with a time.
Bytes encode(const Received& received);
Bytes encode(const Echo& echo);

std::span<const Fault> bus_faults();         // Of BusError::classes.
std::span<const Fault> controller_faults();  // Of BusError::controller.

}  // namespace drivers::gs_usb
