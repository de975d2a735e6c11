// Against a decoder that we did not write: @foxglove/velodyne-cloud on node, which tools/setup
// fetches.
#include <gtest/gtest.h>

#include <boost/json/parse.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "drivers/velodyne_codec.hpp"
#include "sim/velodyne_unit.hpp"
#include "tests/drivers/loop_rig.hpp"
#include "tests/drivers/recordings.hpp"
#include "tests/support/temp_folder.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

const fs::path kPeer =
    fs::path(VANTAGE_SOURCE_DIR) / "build/npm/node_modules/@foxglove/velodyne-cloud";

class VelodyneInterop : public drivers_test::LoopRig {
 protected:
  void SetUp() override {
    if (!fs::exists(kPeer) || std::system("node --version > /dev/null 2>&1") != 0)
      GTEST_SKIP()
          << "no node with @foxglove/velodyne-cloud: run tools/setup --peers where npm is there";
  }

  // What the peer says of each packet.
  std::vector<boost::json::value> ask(const std::vector<Bytes>& packets) {
    const fs::path in = folder_.path() / "packets";
    const fs::path out = folder_.path() / "points";
    std::ofstream file(in, std::ios::binary);
    for (const Bytes& packet : packets)
      file.write(reinterpret_cast<const char*>(packet.data()),
                 static_cast<std::streamsize>(packet.size()));
    file.close();
    const std::string script =
        std::string(VANTAGE_SOURCE_DIR) + "/tests/interop/velodyne_cloud.cjs";
    const std::string command = "node '" + script + "' '" + in.string() + "' '" + kPeer.string() +
                                "' " + std::to_string(packets.front().size()) + " > '" +
                                out.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::vector<boost::json::value> answers;
    std::ifstream lines(out);
    for (std::string line; std::getline(lines, line);) answers.push_back(boost::json::parse(line));
    return answers;
  }

  // What a unit sends in so long.
  std::vector<Bytes> packets_of_the_unit(hal::Duration span) {
    sim::DatagramWire wire(clock);
    sim::UnitFaults faults(clock);
    sim::VelodyneUnit unit({}, world, clock, wire.sender(), faults);
    std::vector<Bytes> packets;
    spawn(unit.run());
    spawn(keep(wire, packets));
    run_for(span);
    halt_all();
    return packets;
  }

  // Other tests ask the same peer at the same time: each its own files.
  const test::TempFolder folder_;

  static hal::Task<void> keep(sim::DatagramWire& wire, std::vector<Bytes>& packets) {
    Bytes buffer(2000);
    for (;;) {
      const auto got = co_await wire.receiver().receive(buffer);
      if (got)
        packets.emplace_back(buffer.begin(),
                             buffer.begin() + static_cast<std::ptrdiff_t>(got->size));
    }
  }
};

// The peer knows neither the height of each laser's optics nor that the head turns on within a
// block: without those two, its points are ours.
TEST_F(VelodyneInterop, EveryPointOfOurUnitIsWhereThePeerSeesIt) {
  const auto packets = packets_of_the_unit(300ms);
  ASSERT_GT(packets.size(), 200U);
  const auto answers = ask(packets);
  ASSERT_EQ(answers.size(), packets.size());
  std::size_t compared = 0;
  for (std::size_t p = 0; p < packets.size(); ++p) {
    VelodynePacket ours;
    ASSERT_EQ(decode_velodyne(packets[p], ours), "");
    const auto& theirs = answers[p].as_array();
    std::size_t next = 0;
    for (std::size_t i = 0; i < ours.points.size(); ++i) {
      VelodynePoint point = ours.points[i];
      if (point.distance_2mm == 0) continue;
      ASSERT_LT(next, theirs.size());
      const auto& their = theirs[next++].as_array();
      ASSERT_EQ(their[4].to_number<int>(), point.laser);
      ASSERT_NEAR(their[3].to_number<double>(), point.distance_2mm * 0.002, 1e-5);
      point.azimuth_deg = static_cast<float>(ours.block_azimuth_centideg[i / 32] / 100.0);
      const auto at = velodyne_point_m(point);
      ASSERT_NEAR(their[0].to_number<double>(), at.x(), 1e-4);
      ASSERT_NEAR(their[1].to_number<double>(), at.y(), 1e-4);
      ASSERT_NEAR(their[2].to_number<double>(), at.z() - velodyne_offset_m(point.laser), 1e-4);
      ++compared;
    }
    ASSERT_EQ(next, theirs.size());
  }
  EXPECT_GT(compared, 50000U);
}

TEST_F(VelodyneInterop, BothRefuseTheRecordedPacketOfOddLength) {
  RECORDING_OR_SKIP(pcap, "velodyne/VLI-16-one-packet.pcap");
  const auto payloads = drivers_test::udp_payloads(pcap);
  ASSERT_FALSE(payloads.empty());
  VelodynePacket ours;
  EXPECT_NE(decode_velodyne(payloads[0], ours), "");
  const auto answers = ask({payloads[0]});
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0], boost::json::value("refused"));
}

}  // namespace
}  // namespace drivers
