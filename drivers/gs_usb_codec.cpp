#include "drivers/gs_usb_codec.hpp"

#include <algorithm>
#include <initializer_list>
#include <limits>

namespace drivers::gs_usb {
namespace {

using hal::CanFrame;

// As in SocketCAN.
constexpr std::uint32_t kExtended = 1U << 31, kRemote = 1U << 30, kError = 1U << 29,
                        kIdMask = 0x1FFFFFFF;
constexpr std::uint8_t kOverflow = 1, kFlexible = 2;
constexpr std::size_t kIdAt = 4, kSizeAt = 8, kChannelAt = 9, kFlagsAt = 10, kDataAt = 12,
                      kTimeAt = 20;

Bytes words(std::initializer_list<std::uint32_t> values) {
  Bytes bytes;
  for (const auto value : values) append_little<std::uint32_t>(bytes, value);
  return bytes;
}

template <std::size_t kCount>
std::optional<std::array<std::uint32_t, kCount>> read_words(ByteView bytes) {
  if (bytes.size() < 4 * kCount) return std::nullopt;
  std::array<std::uint32_t, kCount> values{};
  for (std::size_t i = 0; i < kCount; ++i) values[i] = little<std::uint32_t>(bytes, 4 * i);
  return values;
}

CanFrame frame_in(ByteView transfer) {
  const auto id = little<std::uint32_t>(transfer, kIdAt);
  CanFrame frame;
  frame.extended = (id & kExtended) != 0;
  frame.remote = (id & kRemote) != 0;
  frame.id = id & (frame.extended ? kIdMask : 0x7FFU);
  frame.size = transfer[kSizeAt];
  if (!frame.remote) std::copy_n(transfer.begin() + kDataAt, frame.size, frame.data.begin());
  return frame;
}

BusError error_in(ByteView transfer) {
  const ByteView data = transfer.subspan(kDataAt, 8);
  return {transfer[kChannelAt],
          little<std::uint32_t>(transfer, kIdAt) & kIdMask,
          data[1],
          data[2],
          data[3],
          data[6],
          data[7]};
}

void put_frame(std::span<std::uint8_t> bytes, const CanFrame& frame, std::uint8_t channel,
               std::uint32_t echo_id) {
  put_little<std::uint32_t>(bytes, 0, echo_id);
  put_little<std::uint32_t>(
      bytes, kIdAt, frame.id | (frame.extended ? kExtended : 0U) | (frame.remote ? kRemote : 0U));
  bytes[kSizeAt] = frame.size;
  bytes[kChannelAt] = channel;
  if (!frame.remote) std::copy_n(frame.data.begin(), frame.size, bytes.begin() + kDataAt);
}

Bytes timed(const CanFrame& frame, std::uint8_t channel, std::uint32_t echo_id,
            std::optional<std::uint32_t> time_us) {
  Bytes bytes(time_us ? kTimedFrameSize : kFrameSize);
  put_frame(bytes, frame, channel, echo_id);
  if (time_us) put_little<std::uint32_t>(bytes, kTimeAt, *time_us);
  return bytes;
}

constexpr Fault kBus[] = {
    {0x001, "transmit time-out", "the adapter could not send in time", "check the bus"},
    {0x002, "arbitration lost", "another node sent first", "normal on a busy bus"},
    {0x004, "controller trouble", "error counters or buffers", "see the controller's faults"},
    {0x008, "protocol violation", "disturbed bus or a wrong bit rate",
     "check bit rate, cable and termination"},
    {0x010, "transceiver trouble", "wiring", "check the CAN cable"},
    {0x020, "nobody acknowledges", "the base is off or the cable is loose",
     "switch the base on; check the CAN plug"},
    {0x040, "bus off", "too many errors: the adapter left the bus",
     "check cable, termination and bit rate; it is restarted"},
    {0x080, "bus error", "disturbed bus", "check cable and termination"},
    {0x100, "restarted", "after bus off", "nothing to do"},
    {0x200, "error counters", "the message carries them", "nothing to do"},
};

constexpr Fault kController[] = {
    {0x01, "receive overflow", "frames came faster than they were fetched", "lower the load"},
    {0x02, "transmit overflow", "frames were given faster than sent", "lower the load"},
    {0x04, "receive warning", "many receive errors", "check cable and termination"},
    {0x08, "transmit warning", "many transmit errors", "check cable and termination"},
    {0x10, "receive passive", "very many receive errors", "check cable and termination"},
    {0x20, "transmit passive", "very many transmit errors, often nobody acknowledges",
     "switch the base on; check the CAN plug"},
    {0x40, "active again", "the errors stopped", "nothing to do"},
};

}  // namespace

Bytes host_format() {
  return words({0x0000BEEF});
}
Bytes encode(const BitTiming& t) {
  return words({t.propagation, t.phase1, t.phase2, t.jump_width, t.prescaler});
}
Bytes start_mode(std::uint32_t flags) {
  return words({1, flags});
}
Bytes reset_mode() {
  return words({0, 0});
}
Bytes identify(bool blink) {
  return words({blink ? 1U : 0U});
}

std::optional<BitTimingLimits> decode_limits(ByteView reply) {
  const auto w = read_words<10>(reply);
  if (!w) return std::nullopt;
  const auto& v = *w;
  return BitTimingLimits{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9]};
}

std::optional<DeviceConfig> decode_config(ByteView reply) {
  if (reply.size() < 12 || reply[3] == 0xFF) return std::nullopt;
  return DeviceConfig{static_cast<std::uint8_t>(reply[3] + 1), little<std::uint32_t>(reply, 4),
                      little<std::uint32_t>(reply, 8)};
}

std::optional<DeviceState> decode_state(ByteView reply) {
  const auto w = read_words<3>(reply);
  if (!w || (*w)[0] > static_cast<std::uint32_t>(BusState::sleeping)) return std::nullopt;
  return DeviceState{BusState{(*w)[0]}, (*w)[1], (*w)[2]};
}

std::optional<std::uint32_t> decode_timestamp_us(ByteView reply) {
  const auto w = read_words<1>(reply);
  return w ? std::optional((*w)[0]) : std::nullopt;
}

Bytes encode(const BitTimingLimits& l) {
  return words({l.features, l.clock_hz, l.segment1_min, l.segment1_max, l.segment2_min,
                l.segment2_max, l.jump_width_max, l.prescaler_min, l.prescaler_max,
                l.prescaler_step});
}
Bytes encode(const DeviceConfig& config) {
  return words({(config.channels - 1U) << 24, config.software_version, config.hardware_version});
}
Bytes encode(const DeviceState& state) {
  return words(
      {static_cast<std::uint32_t>(state.state), state.receive_errors, state.transmit_errors});
}

std::optional<BitTiming> decode_timing(ByteView data) {
  const auto w = read_words<5>(data);
  if (!w) return std::nullopt;
  return BitTiming{(*w)[0], (*w)[1], (*w)[2], (*w)[3], (*w)[4]};
}

std::optional<BitTiming> timing_for(const BitTimingLimits& limits, std::uint32_t bit_rate,
                                    std::uint32_t sample_permille) {
  std::optional<BitTiming> best;
  auto best_off = std::numeric_limits<std::uint64_t>::max();
  // From the fewest ticks per quantum, that is the most quanta per bit. A bit has 4 to 25 quanta.
  const std::uint64_t step = std::max<std::uint32_t>(limits.prescaler_step, 1);
  const std::uint64_t last = std::min<std::uint64_t>(limits.prescaler_max, 1U << 16);
  for (std::uint64_t prescaler = std::max<std::uint32_t>(limits.prescaler_min, 1);
       prescaler <= last; prescaler += step) {
    const std::uint64_t per_quanta = prescaler * bit_rate;
    if (per_quanta == 0 || limits.clock_hz % per_quanta != 0) continue;
    const std::uint64_t quanta = limits.clock_hz / per_quanta;
    if (quanta < 4 || quanta > 25) continue;
    for (std::uint64_t segment2 = std::max<std::uint32_t>(limits.segment2_min, 1);
         segment2 <= limits.segment2_max && segment2 + 3 <= quanta; ++segment2) {
      const std::uint64_t segment1 = quanta - 1 - segment2;
      if (segment1 < std::max<std::uint32_t>(limits.segment1_min, 2) ||
          segment1 > limits.segment1_max)
        continue;
      const std::uint64_t sample = (1 + segment1) * 1000, wanted = quanta * sample_permille;
      // Off by so many thousandths of a bit, times a million to compare without rounding.
      const std::uint64_t off =
          (sample > wanted ? sample - wanted : wanted - sample) * 1'000'000 / quanta;
      if (off >= best_off) continue;
      best_off = off;
      best =
          BitTiming{1, static_cast<std::uint32_t>(segment1 - 1),
                    static_cast<std::uint32_t>(segment2), 1, static_cast<std::uint32_t>(prescaler)};
    }
  }
  return best;
}

HostFrame decode(ByteView transfer, bool with_time) {
  const std::size_t wanted = with_time ? kTimedFrameSize : kFrameSize;
  if (transfer.size() < wanted) return Unread{"length"};
  if ((transfer[kFlagsAt] & kFlexible) != 0) return Unread{"CAN FD"};
  const auto id = little<std::uint32_t>(transfer, kIdAt);
  if ((id & kError) != 0) return error_in(transfer);
  if (transfer[kSizeAt] > 8) return Unread{"data length"};
  if ((id & kExtended) == 0 && (id & kIdMask) > 0x7FF) return Unread{"id"};
  const auto echo = little<std::uint32_t>(transfer, 0);
  const auto time =
      with_time ? std::optional(little<std::uint32_t>(transfer, kTimeAt)) : std::nullopt;
  if (echo != kReceived) return Echo{echo, transfer[kChannelAt], frame_in(transfer), time};
  return Received{frame_in(transfer), transfer[kChannelAt], (transfer[kFlagsAt] & kOverflow) != 0,
                  time};
}

std::array<std::uint8_t, kFrameSize> encode(const CanFrame& frame, std::uint8_t channel,
                                            std::uint32_t echo_id) {
  std::array<std::uint8_t, kFrameSize> bytes{};
  put_frame(bytes, frame, channel, echo_id);
  return bytes;
}

Bytes encode(const Received& received) {
  Bytes bytes = timed(received.frame, received.channel, kReceived, received.time_us);
  bytes[kFlagsAt] = received.overflow ? kOverflow : 0;
  return bytes;
}

Bytes encode(const Echo& echo) {
  return timed(echo.frame, echo.channel, echo.id, echo.time_us);
}

std::span<const Fault> bus_faults() {
  return kBus;
}
std::span<const Fault> controller_faults() {
  return kController;
}

}  // namespace drivers::gs_usb
