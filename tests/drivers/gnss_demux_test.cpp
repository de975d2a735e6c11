#include "drivers/gnss_demux.hpp"

#include "drivers/nmea_codec.hpp"
#include "drivers/ubx_codec.hpp"
#include "tests/drivers/recordings.hpp"

namespace drivers {
namespace {

using drivers_test::bytes_of;
using drivers_test::frames_in;
using drivers_test::from_hex;

const Bytes kRtcm1005 = from_hex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98");

TEST(Rtcm3, TheStandardsExampleIsAFrame) {
  EXPECT_EQ(frames_in(kRtcm1005, look_gnss, kGnssFrameMax), std::vector<Bytes>{kRtcm1005});
  EXPECT_EQ(rtcm3_type(kRtcm1005), 1005);
  EXPECT_EQ(encode_rtcm3(ByteView(kRtcm1005).subspan(3, 19)), kRtcm1005);
}

TEST(Gnss, WholeFramesSurviveDamage) {
  const std::vector<Bytes> frames{
      encode_ubx(1, 7, Bytes(92, 1)),
      kRtcm1005,
      bytes_of(encode_nmea("GPHDT,274.07,T")),
      encode_ubx(0x0A, 4),
      bytes_of(encode_nmea("GNGLL,3203.94995,N,03446.42914,E,084158.00,A,D")),
      encode_rtcm3(from_hex("3ed0")),
      encode_ubx(5, 1, from_hex("068a"))};
  drivers_test::expect_whole_frames_survive(frames, look_gnss, kGnssFrameMax,
                                            from_hex("24 b5 d3 b562 0107 d303 62 2a 30"));
  const std::vector<Bytes> binary{frames[0], frames[1], frames[3], frames[5], frames[6]};
  drivers_test::expect_flips_cost_one_frame(binary, look_gnss, kGnssFrameMax);
}

}  // namespace
}  // namespace drivers
