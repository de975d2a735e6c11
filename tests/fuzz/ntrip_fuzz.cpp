// What a caster answers, what a caster is asked, and the corrections that come.
#include "drivers/gnss_demux.hpp"
#include "drivers/ntrip_codec.hpp"
#include "drivers/rtcm3.hpp"
#include "drivers/text.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

namespace {

using namespace drivers;
using drivers_fuzz::require;

struct Result {
  NtripAnswer answer;
  Bytes body;
};

Result read(ByteView bytes, std::size_t piece) {
  Result result;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    result.answer.feed(bytes.subspan(at, std::min(piece, bytes.size() - at)));
    const ByteView body = result.answer.body();
    result.body.insert(result.body.end(), body.begin(), body.end());
  }
  return result;
}

}  // namespace

// However it arrives, an answer is the same; of what is too long, only the verdict.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView bytes(data, size);
  const Result whole = read(bytes, size + 1), pieces = read(bytes, 1 + size / 7);
  if (size < 1024) {
    require(whole.answer.verdict() == pieces.answer.verdict());
    require(whole.answer.status() == pieces.answer.status());
    require(whole.body == pieces.body);
    require(whole.answer.broken() == pieces.answer.broken());
  }
  require(whole.body.size() <= size);
  require(whole.answer.status().size() <= 120);
  for (const Bytes& frame : drivers_fuzz::check_stream(whole.body, look_gnss, kGnssFrameMax)) {
    if (gnss_kind(frame) != GnssKind::rtcm3) continue;
    rtcm3_epoch(frame);
    rtcm3_base_m(frame);
  }
  if (const auto asked = parse_ntrip_request(as_text(bytes))) require(asked->size <= size);
  ntrip_source(as_text(bytes));
  return 0;
}
