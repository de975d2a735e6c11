// Velodyne VLP-16 over UDP: a 3-D scanner that needs no pan unit.
#pragma once

#include "drivers/clock_fit.hpp"
#include "drivers/udp_scanner.hpp"
#include "drivers/velodyne_codec.hpp"

namespace drivers {

struct VelodyneConfig {
  UdpScanConfig scan;
  std::uint32_t columns = 1800;  // Of the pattern: as fine as its firing at 10 turns a second.
};

// Of two returns of a beam, the first in the packet counts.
class Velodyne final : public UdpScanner {
 public:
  // The clock and the datagrams (of port 2368) must outlive it.
  Velodyne(VelodyneConfig config, hal::Clock& clock, hal::Datagrams& datagrams);

  std::string_view model() const override { return "vlp16"; }

 private:
  std::string_view read(ByteView packet, hal::Time arrival) override;
  hal::ScanPattern pattern() const override;
  double turn_s() const override { return 0.2; }  // At its slowest, 5 turns a second.
  void begin() override;
  void fill(TurnMerge& into) override;
  int turns_done() const override { return static_cast<int>(swept_deg_ / 360); }
  std::vector<BeamCone> cones() const override;
  std::uint32_t look_columns() const override { return config_.columns; }
  PacketStart starts() const override;
  void look(TurnAssembly& into) const override;

  const VelodyneConfig config_;
  VelodynePacket packet_;
  ClockFit fit_;
  std::int64_t hours_us_{};  // Of the full hours that the time stamps leave out.
  std::optional<std::int64_t> last_us_;
  std::optional<double> last_azimuth_deg_;
  hal::Time arrived_{};
  double swept_deg_{};
};

}  // namespace drivers
