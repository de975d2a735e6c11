// What scanners that send their turns as UDP packets have in common: packets are judged as they
// come, and a scan is a few whole turns while the robot stands, merged.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/device.hpp"
#include "drivers/profile_stream.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

// Cells of a pattern filled from several turns. What no beam reached stays NaN: nothing is known
// there. A return wins over none; of two returns, the one nearer to the middle of its cell.
class TurnMerge {
 public:
  explicit TurnMerge(const hal::ScanPattern& pattern);

  // off_rad: how far the beam went from the middle of its cell. range_m 0: nothing came back.
  void add(std::uint32_t column, std::uint32_t row, float range_m, const hal::Beam& beam,
           float off_rad);
  std::size_t unmeasured() const;
  hal::ScanCloud take(hal::Time stamp);

 private:
  hal::ScanCloud cloud_;
  std::vector<float> off_rad_;
};

struct UdpScanConfig {
  int turns = 10;                // That a scan merges.
  double lost_share_max = 0.02;  // Of a scan's packets.
};

class UdpScanner : public hal::Scanner, public Device {
 public:
  // Fails with errc::not_connected when no packets come for 10 s, errc::timed_out when the turns do
  // not get complete, errc::io_error when too many packets are lost: problem() says so.
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;
  const std::string& problem() const { return problem_; }  // Of the last scan; empty: none.

  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  std::uint64_t packets() const { return packets_; }
  std::uint64_t packets_lost() const { return lost_; }
  std::uint64_t packets_of_others() const { return others_; }

 protected:
  UdpScanner(UdpScanConfig config, hal::Clock& clock, hal::Datagrams& datagrams);

  // Empty, or why this is no packet of this device.
  virtual std::string_view read(ByteView packet, hal::Time arrival) = 0;
  virtual hal::ScanPattern pattern() const = 0;
  virtual double turn_s() const = 0;  // About.
  // A scan begins with what comes from now on: fill `into` until turns_done() says enough.
  virtual void begin() = 0;
  virtual void fill(TurnMerge& into) = 0;  // From the packet that read() read last.
  virtual int turns_done() const = 0;

  // For read(): whether a packet so much after the one before is new, with the expected step.
  bool is_new(double step_s, double period_s, double late_s);

  Identity identity_;
  Troubles troubles_;
  ScanWatch watch_{troubles_};

 private:
  hal::Task<void> receive();
  hal::Task<void> watch();
  void take(ByteView packet, hal::Time arrival);

  const UdpScanConfig config_;
  hal::Clock& clock_;
  hal::Datagrams& datagrams_;
  DeviceState state_ = DeviceState::off;
  std::string problem_;
  Signal changed_, done_;
  std::optional<TurnMerge> merge_;
  bool fresh_{};
  hal::Time last_packet_{};
  int others_in_a_row_{};
  std::uint64_t packets_{}, lost_{}, others_{};
};

}  // namespace drivers
