// What scanners that send their turns as UDP packets have in common: packets are judged as they
// come, a scan is a few whole turns while the robot stands, merged, and while it drives each turn
// is a profile with rows.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/bytes.hpp"
#include "drivers/device.hpp"
#include "drivers/profile_stream.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "drivers/turn_assembly.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"
#include "hal/turn_scanner.hpp"

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
  // On the way: rows up to this elevation are looked at; and a turn that lost more than this share
  // of its packets is none.
  double look_max_rad = 0;
  double look_lost_share_max = 0.1;
};

class UdpScanner : public hal::Scanner, public hal::TurnScanner, public Device {
 public:
  // Fails with errc::not_connected when no packets come for 10 s, errc::timed_out when the turns do
  // not get complete, errc::io_error when too many packets are lost: problem() says so.
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;
  const std::string& problem() const { return problem_; }  // Of the last scan; empty: none.

  // It sends always: between start and stop its turns are told too. start() fails with
  // errc::not_connected when no packets come; they are told once they do.
  hal::Task<hal::Result<void>> start() override;
  hal::Task<hal::Result<void>> stop() override;
  // Fails with errc::operation_not_permitted when not started, errc::timed_out after 1 s without a
  // whole turn.
  hal::Task<hal::Result<hal::Turn>> next_turn() override;
  hal::Task<hal::Result<hal::Profile>> next_profile() override;

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
  // The rows of its beams, from the lowest, and in how many columns its turns are told.
  virtual std::vector<BeamCone> cones() const = 0;
  virtual std::uint32_t look_columns() const = 0;
  // Where the packet that read() read last begins, and when by our clock; and its beams.
  struct PacketStart {
    double azimuth_rad{};
    hal::Time at{};
  };
  virtual PacketStart starts() const = 0;
  virtual void look(TurnAssembly& into) const = 0;

  // For read(): whether a packet so much after the one before is new, with the expected step.
  bool is_new(double step_s, double period_s, double late_s);

  Identity identity_;
  Troubles troubles_;
  ScanWatch watch_{troubles_};

 private:
  static constexpr std::size_t kLooksMax = 4;  // That wait: the newest are what counts.

  hal::Task<void> receive();
  hal::Task<void> watch();
  void take(ByteView packet, hal::Time arrival);
  void take_look();
  void put(hal::Turn turn);

  const UdpScanConfig config_;
  hal::Clock& clock_;
  hal::Datagrams& datagrams_;
  DeviceState state_ = DeviceState::off;
  std::string problem_;
  Signal changed_, done_;
  std::optional<TurnMerge> merge_;
  std::optional<TurnAssembly> turns_;  // While turns are told.
  std::deque<hal::Turn> looks_;
  Signal looked_;
  std::uint64_t turn_packets_{}, turn_lost_{};  // packets_ and lost_ when the turn began.
  std::uint64_t looks_lost_{};                  // Turns since the last that was told.
  bool fresh_{};
  hal::Time last_packet_{};
  int others_in_a_row_{};
  std::uint64_t packets_{}, lost_{}, others_{};
};

}  // namespace drivers
