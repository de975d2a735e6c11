#include "drivers/sick_lms_codec.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace drivers {
namespace {

// The second status byte is a code, the first a flag.
constexpr Fault kFaults[] = {
    {0x0001, "device error", "the scanner reports a fault of its own",
     "restart it, then replace it"},
    {0x0002, "pollution warning", "the window is getting dirty", "clean the window soon"},
    {0x0004, "pollution error", "the window is dirty: ranges are wrong", "clean the window"},
    {0x0005, "pollution error", "the window is dirty: ranges are wrong", "clean the window"},
    {0x0100, "just started", "the first scans after a start", "wait some scans"},
};

constexpr Fault kStates[] = {
    {0, "undefined", "just powered", "wait"},
    {1, "initialising", "starting up", "wait"},
    {2, "configuration", "a client is logged in", "send Run"},
    {3, "idle", "not measuring", "send LMCstartmeas"},
    {4, "rotating", "the mirror is spinning up", "wait"},
    {5, "in preparation", "starting to measure", "wait"},
    {6, "ready", "ready, not yet measuring", "wait"},
    {7, "measuring", "none: this is how it works", "none"},
};

constexpr Fault kDeviceStates[] = {
    {0, "busy", "starting up, or at work on some firmware", "ask STlms"},
    {1, "ready", "none: this is how it works", "none"},
    {2, "error", "the scanner reports a fault of its own", "restart it, then replace it"},
    {3, "standby", "not measuring", "send LMCstartmeas"},
};

constexpr Fault kStartErrors[] = {
    {1, "not allowed", "not logged in, or already starting", "log in, stop, then start again"},
};

constexpr Fault kScanConfigErrors[] = {
    {1, "frequency", "this model does not scan at this frequency", "choose a listed frequency"},
    {2, "resolution", "this model has no such resolution", "choose a listed resolution"},
    {3, "frequency and resolution", "this pair is not possible", "choose a listed pair"},
    {4, "scan area", "the sector is outside the model's", "choose a sector within its field"},
    {5, "other", "the device does not say", "compare with the telegram listing"},
};

constexpr std::size_t kChannelsMax = 16, kEncodersMax = 16;

void read_channel(ColaReader& in, LmsChannel& channel, bool wide) {
  const std::string_view name = in.characters(channel.name.size());
  if (!in.ok()) return;
  std::copy(name.begin(), name.end(), channel.name.begin());
  channel.scale = in.f32();
  channel.offset = in.f32();
  channel.start_1e4deg = in.i32();
  channel.step_1e4deg = in.u16();
  const std::size_t count = in.u16();
  const std::size_t least = in.ascii() || !wide ? count : 2 * count;  // Bytes that must be there.
  channel.raw.resize(in.left() < least ? 0 : count);
  if (channel.raw.size() < count)
    in.characters(in.left() + 1);  // Not all there.
  else
    wide ? in.u16s(channel.raw) : in.u8s(channel.raw);
}

std::string_view read_channels(ColaReader& in, std::vector<LmsChannel>& channels, bool wide) {
  const std::size_t count = in.u16();
  if (count > kChannelsMax) return "too many channels";
  channels.resize(count);
  for (LmsChannel& channel : channels) read_channel(in, channel, wide);
  return {};
}

std::string_view read_encoders(ColaReader& in, std::vector<LmsEncoder>& encoders) {
  const std::size_t count = in.u16();
  if (count > kEncodersMax) return "too many encoders";
  encoders.resize(count);
  for (LmsEncoder& encoder : encoders) {
    encoder.position = in.u32();
    encoder.speed = in.u16();
  }
  return {};
}

void read_header(ColaReader& in, LmsScan& scan) {
  scan.version = in.u16();
  scan.device_number = in.u16();
  scan.serial_number = in.u32();
  for (auto& byte : scan.status) byte = in.u8();
  scan.telegram_counter = in.u16();
  scan.scan_counter = in.u16();
  scan.scan_start_us = in.u32();
  scan.transmit_us = in.u32();
  for (auto& byte : scan.inputs) byte = in.u8();
  for (auto& byte : scan.outputs) byte = in.u8();
  scan.layer_angle = in.i16();
  scan.scan_frequency_centihz = in.u32();
  scan.measurement_frequency_100hz = in.u32();
  // Some firmware says it in Hz.
  if (scan.measurement_frequency_100hz > 10000) scan.measurement_frequency_100hz /= 100;
}

// CoLa A leaves out what is switched off at the end.
bool has_part(ColaReader& in) {
  return !(in.ascii() && in.ok() && in.at_end()) && in.u16() != 0;
}

void read_text(ColaReader& in, std::string& text) {
  text.clear();
  if (has_part(in)) text = in.characters(in.u8());
}

void read_position(ColaReader& in, std::optional<LmsPosition>& position) {
  position.reset();
  if (!has_part(in)) return;
  position.emplace();
  for (float& value : position->xyz) value = in.f32();
  for (float& value : position->rotation) value = in.f32();
  position->type = in.u8();
}

void read_time(ColaReader& in, std::optional<LmsTime>& time) {
  time.reset();
  if (!has_part(in)) return;
  time.emplace();
  time->year = in.u16();
  for (auto* part : {&time->month, &time->day, &time->hour, &time->minute, &time->second})
    *part = in.u8();
  time->microsecond = in.u32();
}

void read_event(ColaReader& in, std::optional<LmsEvent>& event) {
  event.reset();
  if (!has_part(in)) return;
  event.emplace();
  const std::string_view type = in.characters(event->type.size());
  std::copy(type.begin(), type.end(), event->type.begin());
  event->encoder_position = in.u32();
  event->time_us = in.u32();
  event->angle_1e4deg = in.i32();
}

}  // namespace

const LmsChannel* LmsScan::distances() const {
  for (const auto& channel : channels16)
    if (channel.label() == "DIST1") return &channel;
  return nullptr;
}

std::string_view decode_lms_scan(const ColaMessage& message, LmsScan& into) {
  if (message.name != "LMDscandata" || (message.command != "sSN" && message.command != "sRA"))
    return "not an LMDscandata telegram";
  ColaReader in(message);
  read_header(in, into);
  if (const auto why = read_encoders(in, into.encoders); !why.empty()) return why;
  if (const auto why = read_channels(in, into.channels16, true); !why.empty()) return why;
  if (const auto why = read_channels(in, into.channels8, false); !why.empty()) return why;
  read_position(in, into.position);
  read_text(in, into.name);
  read_text(in, into.comment);
  read_time(in, into.time);
  read_event(in, into.event);
  if (!in.ok()) return "cut or unreadable";
  return in.at_end() ? std::string_view{} : "bytes left over";
}

double beam_angle_rad(const LmsChannel& channel, std::size_t beam) {
  const std::int64_t angle =
      channel.start_1e4deg + static_cast<std::int64_t>(beam) * channel.step_1e4deg - 900000;
  return static_cast<double>(angle) * (std::numbers::pi / 1800000);
}

double beam_delay_s(const LmsScan& scan, const LmsChannel& channel, std::size_t beam) {
  if (scan.scan_frequency_centihz == 0) return 0;
  return static_cast<double>(beam) * channel.step_1e4deg / 3600000.0 /
         (scan.scan_frequency_centihz / 100.0);
}

LmsRaw lms_raw_meaning(std::uint16_t raw, bool lms5xx) {
  constexpr LmsRaw kSpecial[] = {LmsRaw::nothing, LmsRaw::dazzled, LmsRaw::implausible,
                                 LmsRaw::filtered};
  if (raw == 0) return LmsRaw::nothing;
  return lms5xx && raw < 4 ? kSpecial[raw] : LmsRaw::range;
}

double lms_range_m(const LmsChannel& channel, std::uint16_t raw) {
  return (static_cast<double>(channel.scale) * raw + static_cast<double>(channel.offset)) / 1000.0;
}

std::vector<float> lms_ranges_m(const LmsChannel& channel, bool lms5xx) {
  std::vector<float> ranges_m(channel.raw.size());
  for (std::size_t i = 0; i < ranges_m.size(); ++i) {
    const LmsRaw meaning = lms_raw_meaning(channel.raw[i], lms5xx);
    if (meaning == LmsRaw::range)
      ranges_m[i] = static_cast<float>(lms_range_m(channel, channel.raw[i]));
    else if (meaning != LmsRaw::nothing)
      ranges_m[i] = std::numeric_limits<float>::quiet_NaN();
  }
  return ranges_m;
}

std::vector<const Fault*> lms_faults(const LmsScan& scan) {
  std::vector<const Fault*> found;
  if (const Fault* fault = fault_of(kFaults, scan.status[1])) found.push_back(fault);
  if (scan.status[0] == 1) found.push_back(fault_of(kFaults, 0x0100));
  return found;
}

std::span<const Fault> lms_states() {
  return kStates;
}
std::span<const Fault> lms_device_states() {
  return kDeviceStates;
}
std::span<const Fault> lms_start_errors() {
  return kStartErrors;
}
std::span<const Fault> lms_scan_config_errors() {
  return kScanConfigErrors;
}

LmsSequence::Seen LmsSequence::see(const LmsScan& scan) {
  const auto step = static_cast<std::uint16_t>(scan.scan_counter - scan_);
  const auto later_us = static_cast<std::uint32_t>(scan.scan_start_us - start_us_);
  const bool first = !any_;
  const bool same = step == 0 && later_us == 0 && scan.telegram_counter == telegram_;
  any_ = true;
  scan_ = scan.scan_counter;
  telegram_ = scan.telegram_counter;
  start_us_ = scan.scan_start_us;
  if (first || step == 1) return Seen::next;
  if (same) return ++repeated_, Seen::repeated;
  if (step == 0 || step >= 0x8000 || later_us >= 0x80000000U) return Seen::restarted;
  lost_ += step - 1U;
  return Seen::gap;
}

}  // namespace drivers
