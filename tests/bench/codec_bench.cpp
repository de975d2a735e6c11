// CAN codecs in frames per second, beside a copy of the same bytes.
#include <benchmark/benchmark.h>

#include <cstring>
#include <random>
#include <vector>

#include "drivers/agilex_codec.hpp"
#include "drivers/canopen_codec.hpp"

namespace {

using hal::CanFrame;

constexpr std::size_t kFrames = 4096;

std::vector<CanFrame> frames_of(const std::vector<std::uint32_t>& ids, std::uint8_t size_max) {
  std::mt19937 random(11);
  std::vector<CanFrame> frames(kFrames);
  for (auto& frame : frames) {
    frame.id = ids[random() % ids.size()];
    frame.size = size_max;
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random() % 2);
  }
  return frames;
}

// What a base sends in its cycle.
std::vector<CanFrame> agilex_frames() {
  return frames_of({0x211, 0x221, 0x241, 0x251, 0x252, 0x253, 0x254, 0x261, 0x311, 0x361}, 8);
}
// What drives send in theirs: PDOs, SDO replies, emergencies.
std::vector<CanFrame> canopen_frames() {
  return frames_of({0x181, 0x281, 0x182, 0x282, 0x581, 0x081}, 8);
}

template <class Decode>
void run(benchmark::State& state, const std::vector<CanFrame>& frames, Decode decode) {
  for (auto _ : state)
    for (const CanFrame& frame : frames) benchmark::DoNotOptimize(decode(frame));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(frames.size()));
}

void BM_AgilexDecode(benchmark::State& state) {
  run(state, agilex_frames(), [](const CanFrame& frame) {
    return drivers::agilex::decode(frame, drivers::agilex::Dialect::v2);
  });
}
BENCHMARK(BM_AgilexDecode);

void BM_CanopenDecode(benchmark::State& state) {
  run(state, canopen_frames(),
      [](const CanFrame& frame) { return drivers::canopen::decode(frame); });
}
BENCHMARK(BM_CanopenDecode);

void BM_CopyFrames(benchmark::State& state) {
  run(state, agilex_frames(), [](const CanFrame& frame) {
    CanFrame copy;
    std::memcpy(&copy, &frame, sizeof copy);
    return copy;
  });
}
BENCHMARK(BM_CopyFrames);

}  // namespace
