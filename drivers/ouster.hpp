// Ouster OS0, OS1, OS2 over UDP: a 3-D scanner that needs no pan unit. Its metadata, as it serves
// them at /api/v1/sensor/metadata, are part of its configuration: without them no packet can be
// read. Where it can be asked over HTTP, its own take their place at the start.
#pragma once

#include "drivers/clock_fit.hpp"
#include "drivers/ouster_asker.hpp"
#include "drivers/ouster_codec.hpp"
#include "drivers/udp_scanner.hpp"

namespace drivers {

struct OusterConfig {
  UdpScanConfig scan;
  OusterMetadata metadata;  // parse_ouster_metadata()
};

// Where its settings are served; without a link it is not asked.
struct OusterApi {
  OusterAskerConfig config;
  hal::ByteStream* link{};
  DropLink drop;
};

// S is the sensor's frame as the maker draws it. Columns are the measurements of a turn, rows the
// beams from the lowest. Of two returns the first counts.
class Ouster final : public UdpScanner {
 public:
  // The clock and the links (datagrams of port 7502) must outlive it.
  Ouster(OusterConfig config, hal::Clock& clock, hal::Datagrams& datagrams, OusterApi api = {});

  std::string_view model() const override { return "ouster"; }
  hal::Task<void> run() override;

 private:
  std::string_view read(ByteView packet, hal::Time arrival) override;
  std::string_view check_sender() const;
  double packet_period_s() const;
  void tell_faults();
  hal::ScanPattern pattern() const override { return pattern_; }
  double turn_s() const override { return 0.2; }  // At its slowest, 5 turns a second.
  void begin() override;
  void fill(TurnMerge& into) override;
  int turns_done() const override { return turns_; }
  std::vector<BeamCone> cones() const override;
  std::uint32_t look_columns() const override { return pattern_.columns; }
  PacketStart starts() const override;
  void look(TurnAssembly& into) const override;
  void adopt(OusterMetadata metadata);

  OusterConfig config_;
  std::optional<OusterAsker> asker_;
  hal::ScanPattern pattern_;
  // Of every row and measurement: where its beam goes, its column and how far off its middle.
  struct Cell {
    hal::Beam beam;
    std::uint32_t column{};
    float off_rad{};
    double azimuth_rad{};
  };
  std::vector<Cell> cells_;
  std::vector<ConeOfBeam> row_cones_;  // As rows come in packets: from the highest.
  OusterPacket packet_;
  ClockFit fit_;
  std::vector<const Fault*> faults_;
  std::optional<std::int64_t> last_ns_;
  double period_s_{};  // From packet to packet, as the first one said.
  hal::Time arrived_{};
  std::optional<std::uint16_t> frame_;
  int turns_{};
};

}  // namespace drivers
