// What an Ouster tells over HTTP; metadata and, after the first NUL, a packet of the sensor that
// they describe.
#include <cmath>
#include <string_view>

#include "drivers/ouster_api.hpp"
#include "drivers/ouster_codec.hpp"
#include "drivers/text.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const std::string_view text = as_text(ByteView(data, size));
  const auto cut = std::min(text.find('\0'), text.size());
  OusterSettings settings;
  if (parse_ouster_settings(text, settings).empty()) {
    const std::string again = ouster_settings_json(settings);
    drivers_fuzz::require(parse_ouster_settings(again, settings).empty());
  }
  std::vector<OusterAlert> alerts;
  if (parse_ouster_alerts(text, alerts).empty()) drivers_fuzz::require(alerts.size() <= 64);
  ouster_version(text);
  OusterMetadata metadata;
  if (!parse_ouster_metadata(text.substr(0, cut), metadata).empty()) return 0;
  drivers_fuzz::require(metadata.beam_altitude_deg.size() == metadata.rows);
  Bytes packet(data + cut, data + size);
  packet.resize(metadata.packet_size());
  if (metadata.profile != OusterProfile::legacy) packet[0] = 1, packet[1] = 0;
  OusterPacket decoded;
  if (decode_ouster(packet, metadata, decoded).empty()) {
    const std::size_t pixels = metadata.rows * metadata.columns_per_packet;
    drivers_fuzz::require(decoded.returns[0].range_mm.size() == pixels);
    for (const OusterColumn& column : decoded.columns)
      ouster_point_m(metadata, 0, column.measurement_id, decoded.returns[0].range_mm[0]);
  }
  drivers_fuzz::check_offline(*ouster_offline(metadata), packet);
  return 0;
}
