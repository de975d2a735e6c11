#include "drivers/recognise.hpp"

#include <algorithm>

#include "drivers/gnss_demux.hpp"
#include "drivers/gpsd_codec.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/text.hpp"
#include "drivers/vn100_codec.hpp"

namespace drivers {
namespace {

std::string of_line(ByteView frame) {
  if (const auto line = parse_vn100_line(frame)) return "a VectorNav (" + line->type + ")";
  const auto sentence = parse_nmea(frame);
  if (!sentence) return {};
  return "a satellite receiver that sends NMEA (" + sentence->talker + sentence->type + ")";
}

std::string of_gnss(ByteView frame) {
  switch (gnss_kind(frame)) {
    case GnssKind::ubx:
      return "a u-blox receiver that sends UBX";
    case GnssKind::rtcm3:
      return "a source of RTCM corrections";
    case GnssKind::nmea:
      break;
  }
  return of_line(frame);
}

// Text protocols by how they begin.
std::string of_text(ByteView heard) {
  const std::string_view text = as_text(heard);
  if (text.starts_with("SSH-")) return "an SSH server";
  if (text.starts_with("HTTP/")) return "a web server";
  if (text.starts_with("{\"class\":\"VERSION\"")) return "gpsd";
  return {};
}

template <class LookAt, class Name>
std::string first_named(ByteView heard, std::size_t frame_max, LookAt look, Name name) {
  Resync resync(frame_max);
  resync.feed(heard);
  while (const auto frame = resync.next(look))
    if (std::string who = name(*frame); !who.empty()) return who;
  return {};
}

}  // namespace

std::string recognise(ByteView heard) {
  std::string who = of_text(heard);
  if (who.empty()) who = first_named(heard, kGnssFrameMax, look_gnss, of_gnss);
  if (who.empty())
    who = first_named(heard, kVn100FrameMax, look_vn100, [](ByteView frame) {
      return frame[0] == '$' ? of_line(frame) : std::string("a VectorNav that sends packets");
    });
  return who;
}

}  // namespace drivers
