// LMDscandata the other way round, for simulated scanners.
#include <bit>

#include "drivers/sick_lms_codec.hpp"

namespace drivers {
namespace {

// The fields of a body in either dialect.
class BodyWriter {
 public:
  BodyWriter(ColaDialect dialect, Bytes& payload) : dialect_(dialect), payload_(payload) {}

  void u8(std::uint8_t value) { number(value); }
  void u16(std::uint16_t value) { number(value); }
  void u32(std::uint32_t value) { number(value); }
  void i32(std::int32_t value) { number(std::bit_cast<std::uint32_t>(value)); }
  void f32(float value) { number(std::bit_cast<std::uint32_t>(value)); }
  template <class T>
  void numbers(std::span<const std::uint16_t> values) {
    if (dialect_ == ColaDialect::ascii) {
      for (const auto value : values) number(static_cast<T>(value));
      return;
    }
    const std::size_t at = payload_.size();
    payload_.resize(at + sizeof(T) * values.size());
    const auto into = std::span(payload_).subspan(at);
    for (std::size_t i = 0; i < values.size(); ++i)
      put_big<T>(into, sizeof(T) * i, static_cast<T>(values[i]));
  }
  void characters(std::string_view text) {
    if (dialect_ == ColaDialect::ascii) payload_.push_back(' ');
    payload_.insert(payload_.end(), text.begin(), text.end());
  }

 private:
  template <class T>
  void number(T value) {
    if (dialect_ == ColaDialect::binary) return append_big<T>(payload_, value);
    char text[9] = {' '};
    std::size_t size = 1;
    int shift = 8 * sizeof(T) - 4;
    while (shift > 0 && (value >> shift & 0xF) == 0) shift -= 4;
    for (; shift >= 0; shift -= 4) text[size++] = "0123456789ABCDEF"[value >> shift & 0xF];
    payload_.insert(payload_.end(), text, text + size);
  }

  ColaDialect dialect_;
  Bytes& payload_;
};

void write_header(BodyWriter& out, const LmsScan& scan) {
  out.u16(scan.version);
  out.u16(scan.device_number);
  out.u32(scan.serial_number);
  for (const auto byte : scan.status) out.u8(byte);
  out.u16(scan.telegram_counter);
  out.u16(scan.scan_counter);
  out.u32(scan.scan_start_us);
  out.u32(scan.transmit_us);
  for (const auto byte : scan.inputs) out.u8(byte);
  for (const auto byte : scan.outputs) out.u8(byte);
  out.u16(std::bit_cast<std::uint16_t>(scan.layer_angle));
  out.u32(scan.scan_frequency_centihz);
  out.u32(scan.measurement_frequency_100hz);
  out.u16(static_cast<std::uint16_t>(scan.encoders.size()));
  for (const LmsEncoder& encoder : scan.encoders) {
    out.u32(encoder.position);
    out.u16(encoder.speed);
  }
}

void write_channels(BodyWriter& out, const std::vector<LmsChannel>& channels, bool wide) {
  out.u16(static_cast<std::uint16_t>(channels.size()));
  for (const LmsChannel& channel : channels) {
    out.characters(channel.label());
    out.f32(channel.scale);
    out.f32(channel.offset);
    out.i32(channel.start_1e4deg);
    out.u16(channel.step_1e4deg);
    out.u16(static_cast<std::uint16_t>(channel.raw.size()));
    wide ? out.numbers<std::uint16_t>(channel.raw) : out.numbers<std::uint8_t>(channel.raw);
  }
}

void write_text(BodyWriter& out, std::string_view text) {
  out.u16(!text.empty());
  if (text.empty()) return;
  out.u8(static_cast<std::uint8_t>(text.size()));
  out.characters(text.substr(0, 255));
}

void write_position(BodyWriter& out, const std::optional<LmsPosition>& position) {
  out.u16(position.has_value());
  if (!position) return;
  for (const float value : position->xyz) out.f32(value);
  for (const float value : position->rotation) out.f32(value);
  out.u8(position->type);
}

void write_time(BodyWriter& out, const std::optional<LmsTime>& time) {
  out.u16(time.has_value());
  if (!time) return;
  out.u16(time->year);
  for (const auto part : {time->month, time->day, time->hour, time->minute, time->second})
    out.u8(part);
  out.u32(time->microsecond);
}

void write_event(BodyWriter& out, const std::optional<LmsEvent>& event) {
  out.u16(event.has_value());
  if (!event) return;
  out.characters({event->type.data(), event->type.size()});
  out.u32(event->encoder_position);
  out.u32(event->time_us);
  out.i32(event->angle_1e4deg);
}

}  // namespace

Bytes encode_lms_scan(ColaDialect dialect, std::string_view command, const LmsScan& scan) {
  Bytes payload(command.begin(), command.end());
  constexpr std::string_view kName = " LMDscandata";
  payload.insert(payload.end(), kName.begin(), kName.end());
  if (dialect == ColaDialect::binary) payload.push_back(' ');
  BodyWriter out(dialect, payload);
  write_header(out, scan);
  write_channels(out, scan.channels16, true);
  write_channels(out, scan.channels8, false);
  write_position(out, scan.position);
  write_text(out, scan.name);
  write_text(out, scan.comment);
  write_time(out, scan.time);
  write_event(out, scan.event);
  return frame_cola(dialect, payload);
}

}  // namespace drivers
