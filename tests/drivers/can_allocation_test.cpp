// Frames come a thousand times a second: their codecs allocate nothing. Counted, not believed.
#include <gtest/gtest.h>

#include <random>

#include "drivers/agilex_codec.hpp"
#include "drivers/canopen_codec.hpp"
#include "drivers/canopen_pdo.hpp"
#include "drivers/cia402.hpp"
#include "drivers/gs_usb_codec.hpp"
#include "tests/drivers/allocations.hpp"

namespace drivers {
namespace {

template <class Work>
std::uint64_t allocations_in(Work work) {
  const std::uint64_t before = drivers_test::allocations();
  work();
  return drivers_test::allocations() - before;
}

std::vector<hal::CanFrame> random_frames() {
  std::mt19937 random(10);
  std::vector<hal::CanFrame> frames(20000);
  for (auto& frame : frames) {
    frame.id = random() % 0x800;
    frame.size = static_cast<std::uint8_t>(random() % 9);
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random() % 4);
    if (random() % 4 == 0) frame.data[7] = agilex::v1_checksum(frame);
  }
  return frames;
}

TEST(CanAllocation, CanCodecsAllocateNothing) {
  const auto frames = random_frames();
  std::uint64_t read = 0;
  const auto decode_all = [&] {
    for (const auto& frame : frames) {
      for (const auto dialect : {agilex::Dialect::v1, agilex::Dialect::v2}) {
        const auto message = agilex::decode(frame, dialect);
        if (std::holds_alternative<Unread>(message)) continue;
        read += agilex::encode(message).size;
      }
      const auto message = canopen::decode(frame);
      if (!std::holds_alternative<Unread>(message)) read += canopen::encode(message).size;
      const auto usb = gs_usb::encode(frame, 0, 1);
      read += gs_usb::decode(usb, false).index();
    }
  };
  EXPECT_EQ(allocations_in(decode_all), 0U);
  EXPECT_GT(read, 0U);
}

TEST(CanAllocation, PackingPdosAllocatesNothing) {
  const auto pdos = cia402::velocity_pdos({});
  canopen::Pdo pdo;
  std::int64_t values[]{0x000F, -1432};
  EXPECT_EQ(allocations_in([&] {
              canopen::pack(pdos[0].mapping, values, pdo);
              canopen::unpack(pdos[0].mapping, pdo, values);
            }),
            0U);
  EXPECT_EQ(values[1], -1432);
}

}  // namespace
}  // namespace drivers
