// Streams decoded into reused values allocate nothing once they have seen their largest message.
#include <gtest/gtest.h>

#include "drivers/ouster_codec.hpp"
#include "drivers/sick_lms_codec.hpp"
#include "drivers/velodyne_codec.hpp"
#include "tests/drivers/allocations.hpp"

namespace drivers {
namespace {

// Allocations of a hundred calls after the first few.
template <class Call>
std::uint64_t allocations_of(Call&& call) {
  for (int i = 0; i < 3; ++i) call();
  const std::uint64_t before = drivers_test::allocations();
  for (int i = 0; i < 100; ++i) call();
  return drivers_test::allocations() - before;
}

TEST(StreamAllocation, IsCounted) {
  EXPECT_EQ(allocations_of([] { ::operator delete(::operator new(8)); }), 100U);
}

TEST(StreamAllocation, ScansOfBothDialectsAllocateNothing) {
  LmsScan made;
  made.encoders.resize(1);
  made.channels16 = {
      {{'D', 'I', 'S', 'T', '1'}, 1, 0, 0, 5000, std::vector<std::uint16_t>(541, 9)}};
  made.channels8 = {{{'R', 'S', 'S', 'I', '1'}, 1, 0, 0, 5000, std::vector<std::uint16_t>(541, 9)}};
  made.name = "a name that does not fit into a short string";
  made.time.emplace();
  for (const auto dialect : {ColaDialect::ascii, ColaDialect::binary}) {
    const Bytes frame = encode_lms_scan(dialect, "sSN", made);
    Resync stream(kColaFrameMax);
    LmsScan scan;
    EXPECT_EQ(allocations_of([&] {
                stream.feed(frame);
                const auto next = stream.next(look_cola);
                ASSERT_TRUE(next && decode_lms_scan(*parse_cola(*next), scan).empty());
              }),
              0U);
  }
}

TEST(StreamAllocation, PacketsAllocateNothing) {
  OusterMetadata metadata;
  metadata.rows = 32;
  metadata.columns_per_frame = 1024;
  const Bytes packet(metadata.packet_size());
  OusterPacket ouster;
  EXPECT_EQ(allocations_of([&] { ASSERT_EQ(decode_ouster(packet, metadata, ouster), ""); }), 0U);
  Bytes data(1206);
  for (std::size_t block = 0; block < 12; ++block)
    put_little<std::uint16_t>(data, 100 * block, 0xEEFF);
  data[1204] = 0x37;
  data[1205] = 0x22;
  VelodynePacket velodyne;
  EXPECT_EQ(allocations_of([&] { ASSERT_EQ(decode_velodyne(data, velodyne), ""); }), 0U);
}

}  // namespace
}  // namespace drivers
