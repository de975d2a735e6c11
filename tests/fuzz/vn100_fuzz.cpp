// An IMU's packets and lines, and lines as answers to what a driver asked.
#include "drivers/vn100_startup.hpp"
#include "tests/fuzz/stream_fuzz.hpp"

namespace {

void check_line(const drivers::Vn100Line& line) {
  drivers::vn100_sample(line);
  static const auto steps = drivers::vn100_steps({});
  for (const drivers::Vn100Step& step : steps) {
    drivers::vn100_judge(step, line);
    drivers_fuzz::require(!drivers::vn100_refusal(step, line).empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace drivers;
  const ByteView bytes(data, size);
  for (const Bytes& frame : drivers_fuzz::check_stream(bytes, look_vn100, kVn100FrameMax)) {
    if (frame[0] != '$')
      decode_vn100_binary(frame);
    else if (const auto line = parse_vn100_line(frame))
      check_line(*line);
  }
  drivers_fuzz::check_offline(*vn100_offline(), bytes);
  return 0;
}
