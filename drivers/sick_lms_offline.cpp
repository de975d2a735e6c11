#include <algorithm>

#include "drivers/offline_stream.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

void add_channel(Fields& fields, const LmsChannel& channel) {
  const std::string name(channel.label());
  fields.add(name + ".scale", channel.scale)
      .add(name + ".offset", channel.offset)
      .add(name + ".start_1e4deg", channel.start_1e4deg)
      .add(name + ".step_1e4deg", channel.step_1e4deg)
      .add(name + ".raw", channel.raw);
}

std::string two_digits(unsigned value) {
  return (value < 10 ? "0" : "") + std::to_string(value);
}

std::string iso_time(const LmsTime& t) {
  const std::string micros = std::to_string(1000000 + t.microsecond % 1000000).substr(1);
  return std::to_string(t.year) + "-" + two_digits(t.month) + "-" + two_digits(t.day) + "T" +
         two_digits(t.hour) + ":" + two_digits(t.minute) + ":" + two_digits(t.second) + "." +
         micros;
}

void add_scan(Fields& fields, const LmsScan& scan) {
  fields.add("version", scan.version)
      .add("device_number", scan.device_number)
      .add("serial_number", scan.serial_number)
      .add("status", scan.status)
      .add("telegram_counter", scan.telegram_counter)
      .add("scan_counter", scan.scan_counter)
      .add("scan_start_us", scan.scan_start_us)
      .add("transmit_us", scan.transmit_us)
      .add("inputs", scan.inputs)
      .add("outputs", scan.outputs)
      .add("layer_angle", scan.layer_angle)
      .add("scan_frequency_centihz", scan.scan_frequency_centihz)
      .add("measurement_frequency_100hz", scan.measurement_frequency_100hz);
  for (const LmsEncoder& encoder : scan.encoders)
    fields.add("encoder_position", encoder.position).add("encoder_speed", encoder.speed);
  for (const LmsChannel& channel : scan.channels16) add_channel(fields, channel);
  for (const LmsChannel& channel : scan.channels8) add_channel(fields, channel);
  if (scan.position)
    fields.add("position_xyz", scan.position->xyz)
        .add("position_rotation", scan.position->rotation);
  if (!scan.name.empty()) fields.add("name", scan.name);
  if (!scan.comment.empty()) fields.add("comment", scan.comment);
  if (scan.time) fields.add("time", iso_time(*scan.time));
  if (scan.event) fields.add("event_time_us", scan.event->time_us);
  fields.faults(lms_faults(scan));
}

class Offline : public OfflineStream {
 public:
  Offline() : OfflineStream(look_cola, kColaFrameMax) {}

 private:
  std::string_view say(ByteView frame, Message& message) override {
    const auto cola = parse_cola(frame);
    if (!cola) return "no command";
    message.name = cola->name;
    Fields fields(message);
    fields.add("command", cola->command);
    if (const auto code = cola_error(*cola)) {
      message.name = "sFA";
      fields.add("code", *code);
      if (const Fault* fault = fault_of(cola_errors(), *code)) fields.faults(std::array{fault});
    } else if (cola->name == "LMDscandata" && (cola->command == "sSN" || cola->command == "sRA")) {
      const auto why = decode_lms_scan(*cola, scan_);
      why.empty() ? add_scan(fields, scan_) : void(fields.add("refused", why));
    } else if (!cola->body.empty()) {
      const bool ascii = cola->dialect == ColaDialect::ascii;
      fields.add("body", ascii ? std::string(cola->text()) : hex_text(cola->body));
    }
    return {};
  }

  LmsScan scan_;
};

}  // namespace

std::unique_ptr<OfflineDecoder> sick_lms_offline() {
  return std::make_unique<Offline>();
}

}  // namespace drivers
