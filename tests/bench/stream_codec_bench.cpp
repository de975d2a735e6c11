// Codecs of streams and datagrams against memcpy of the same bytes. The bytes are made here.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "drivers/gnss_demux.hpp"
#include "drivers/nmea_codec.hpp"
#include "drivers/ouster_codec.hpp"
#include "drivers/scip_codec.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/ubx_codec.hpp"
#include "drivers/velodyne_codec.hpp"
#include "drivers/vn100_codec.hpp"

namespace {

using drivers::Bytes;
using drivers::ByteView;

void must(bool holds) {
  if (!holds) std::abort();
}

// 541 beams like an LMS111 of 0.5 degrees, or 1141 with remission like an LMS511.
drivers::LmsScan made_scan(std::size_t beams, bool remission) {
  drivers::LmsScan scan;
  scan.scan_frequency_centihz = 5000;
  scan.measurement_frequency_100hz = 360;
  drivers::LmsChannel channel{{'D', 'I', 'S', 'T', '1'}, 1, 0, -450000, 5000, {}};
  for (std::size_t i = 0; i < beams; ++i)
    channel.raw.push_back(static_cast<std::uint16_t>(500 + i * 37 % 9000));
  scan.channels16.push_back(channel);
  channel.name = {'R', 'S', 'S', 'I', '1'};
  if (remission) scan.channels16.push_back(channel);
  return scan;
}

void report(benchmark::State& state, std::size_t bytes) {
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
}

void BM_Memcpy(benchmark::State& state) {
  const Bytes from(static_cast<std::size_t>(state.range(0)), 7);
  Bytes to(from.size());
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  report(state, from.size());
}
BENCHMARK(BM_Memcpy)->Arg(1191)->Arg(4660)->Arg(12608)->Arg(65536);

void scan_stream(benchmark::State& state, drivers::ColaDialect dialect, std::size_t beams,
                 bool remission) {
  const Bytes frame = encode_lms_scan(dialect, "sSN", made_scan(beams, remission));
  drivers::Resync stream(drivers::kColaFrameMax);
  drivers::LmsScan scan;
  for (auto _ : state) {
    stream.feed(frame);
    const auto next = stream.next(drivers::look_cola);
    must(next && decode_lms_scan(*drivers::parse_cola(*next), scan).empty());
    benchmark::DoNotOptimize(scan.channels16[0].raw.data());
  }
  report(state, frame.size());
}
void BM_ColaB_Lms111(benchmark::State& state) {
  scan_stream(state, drivers::ColaDialect::binary, 541, false);
}
void BM_ColaB_Lms511(benchmark::State& state) {
  scan_stream(state, drivers::ColaDialect::binary, 1141, true);
}
void BM_ColaA_Lms111(benchmark::State& state) {
  scan_stream(state, drivers::ColaDialect::ascii, 541, false);
}
BENCHMARK(BM_ColaB_Lms111);
BENCHMARK(BM_ColaB_Lms511);
BENCHMARK(BM_ColaA_Lms111);

void BM_Ouster(benchmark::State& state) {
  drivers::OusterMetadata metadata;
  metadata.profile = static_cast<drivers::OusterProfile>(state.range(0));
  metadata.rows = 64;
  metadata.columns_per_frame = 1024;
  Bytes packet(metadata.packet_size());
  for (std::size_t i = 0; i < packet.size(); ++i) packet[i] = static_cast<std::uint8_t>(i * 13);
  packet[0] = 1;
  packet[1] = 0;
  const bool legacy = metadata.profile == drivers::OusterProfile::legacy;
  const std::size_t header = legacy ? 0 : 32, footer = legacy ? 0 : 32;
  const std::size_t step = (packet.size() - header - footer) / metadata.columns_per_packet;
  for (std::size_t i = 0; i < metadata.columns_per_packet; ++i)
    drivers::put_little<std::uint16_t>(packet, header + i * step + 8,
                                       static_cast<std::uint16_t>(i));
  drivers::OusterPacket decoded;
  for (auto _ : state) {
    must(decode_ouster(packet, metadata, decoded).empty());
    benchmark::DoNotOptimize(decoded.returns[0].range_mm.data());
  }
  report(state, packet.size());
}
BENCHMARK(BM_Ouster)->DenseRange(0, 3)->ArgName("profile");

void BM_Velodyne(benchmark::State& state) {
  Bytes packet(1206, 9);
  for (std::size_t block = 0; block < 12; ++block) {
    drivers::put_little<std::uint16_t>(packet, block * 100, 0xEEFF);
    drivers::put_little<std::uint16_t>(packet, block * 100 + 2,
                                       static_cast<std::uint16_t>(block * 40));
  }
  drivers::put_little<std::uint32_t>(packet, 1200, 1000);
  packet[1204] = 0x37;
  packet[1205] = 0x22;
  drivers::VelodynePacket decoded;
  for (auto _ : state) {
    must(decode_velodyne(packet, decoded).empty());
    benchmark::DoNotOptimize(decoded.points.data());
  }
  report(state, packet.size());
}
BENCHMARK(BM_Velodyne);

// A rover's second: position, its refinement, and sentences.
void BM_Gnss(benchmark::State& state) {
  Bytes second;
  const auto add = [&](ByteView bytes) { second.insert(second.end(), bytes.begin(), bytes.end()); };
  add(drivers::encode_ubx(1, 7, Bytes(92)));
  add(drivers::encode_ubx(1, 0x14, Bytes(36)));
  for (const char* text :
       {"GNGGA,132819.60,4134.49795459,N,09345.03431408,W,4,10,0.9,278.161,M,-31.442,M,6.6,0133",
        "GNRMC,132819.60,A,4134.49795459,N,09345.03431408,W,0.148,124.888,180320,11.5985,E,D",
        "GNGST,132819.60,46,,,,4.7,1.9,5.3"}) {
    const std::string sentence = drivers::encode_nmea(text);
    second.insert(second.end(), sentence.begin(), sentence.end());
  }
  add(drivers::encode_rtcm3(Bytes(500, 0x3E)));
  drivers::Resync stream(drivers::kGnssFrameMax);
  for (auto _ : state) {
    stream.feed(second);
    int frames = 0;
    while (const auto frame = stream.next(drivers::look_gnss)) {
      ++frames;
      switch (drivers::gnss_kind(*frame)) {
        case drivers::GnssKind::ubx:
          benchmark::DoNotOptimize(ubx_nav_pvt(drivers::parse_ubx(*frame)));
          break;
        case drivers::GnssKind::nmea:
          benchmark::DoNotOptimize(drivers::parse_nmea(*frame));
          break;
        case drivers::GnssKind::rtcm3:
          benchmark::DoNotOptimize(drivers::rtcm3_type(*frame));
          break;
      }
    }
    must(frames == 6);
  }
  report(state, second.size());
}
BENCHMARK(BM_Gnss);

void BM_Vn100(benchmark::State& state) {
  Bytes packet{0xFA, 0x01, 0x29, 0x01};  // Time, attitude, rate, acceleration.
  packet.resize(packet.size() + 8 + 12 + 12 + 12, 3);
  drivers::append_big<std::uint16_t>(packet, drivers::crc16_ccitt(ByteView(packet).subspan(1)));
  drivers::Resync stream(drivers::kVn100FrameMax);
  for (auto _ : state) {
    stream.feed(packet);
    const auto frame = stream.next(drivers::look_vn100);
    must(frame.has_value());
    benchmark::DoNotOptimize(drivers::decode_vn100_binary(*frame));
  }
  report(state, packet.size());
}
BENCHMARK(BM_Vn100);

void BM_Scip(benchmark::State& state) {
  const auto line = [](const std::string& text) {
    return text + drivers::scip_checksum(text) + "\n";
  };
  std::string text = "MD0000108001000\n" + line("99") + line("0000");
  for (int left = 1081 * 3; left > 0; left -= 64)
    text += line(std::string(static_cast<std::size_t>(std::min(left, 64)), '1'));
  const Bytes reply_bytes = [&] {
    text += "\n";
    return Bytes(text.begin(), text.end());
  }();
  drivers::Resync stream(drivers::kScipFrameMax);
  drivers::ScipReply reply;
  drivers::ScipScan scan;
  for (auto _ : state) {
    stream.feed(reply_bytes);
    const auto frame = stream.next(drivers::look_scip);
    must(frame && parse_scip(*frame, reply).empty() && decode_scip_scan(reply, scan).empty());
    benchmark::DoNotOptimize(scan.distances_mm.data());
  }
  report(state, reply_bytes.size());
}
BENCHMARK(BM_Scip);

}  // namespace
