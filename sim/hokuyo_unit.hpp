// A Hokuyo that speaks SCIP 2.2 on a simulated pan axis. As it stands, a UST-20LX.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <string_view>

#include "drivers/scip_codec.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "hal/wake.hpp"
#include "sim/cast_ahead.hpp"
#include "sim/unit_faults.hpp"

namespace sim {

struct HokuyoUnitConfig {
  drivers::ScipParameters parameters{"UST-20LX", 20, 60000, 1440, 0, 1080, 540, 2400};
  std::string serial = "H1234567";
  std::string firmware = "3.3.1";
  double skew = -40e-6;              // Of its crystal: seconds of its own per ours, less 1.
  std::uint32_t clock_start_ms = 0;  // What its clock shows at the start and after a restart.
  double boot_s = 10;                // From power to the first answer, after `off` ends.
  Eigen::Isometry3d T_P_L = Eigen::Isometry3d::Identity();  // How it hangs on the pan axis.
  ScannerModel ranges;  // Of it the ranges, their noise and the losses count.
  std::uint64_t seed = 1;
  int threads = 2;
};

// Takes a scan, then sends it. `wrong` sends distances off by that factor, and a clock that runs so
// much faster; after `off` it starts anew.
class HokuyoUnit {
 public:
  HokuyoUnit(HokuyoUnitConfig config, World& world, hal::Clock& clock, hal::ByteStream& link,
             UnitFaults& faults, const PanTruth& pan);
  ~HokuyoUnit();

  hal::Task<void> run();

  bool streaming() const { return streaming_; }
  void break_laser(bool broken) { laser_broken_ = broken; }

 private:
  struct Stream {
    std::string command;  // "MD0000108000000"
    int first{}, last{}, group = 1, skip{}, left{};
    bool intensities{}, endless = true;
  };

  hal::Task<void> listen();
  hal::Task<void> measure();
  hal::Task<void> answer(std::string command);
  bool booting();
  void restart();

  std::string reply(const std::string& command);
  std::string set_clock(const std::string& command);
  std::string begin(const std::string& command);
  std::string versions() const;
  std::string parameters() const;
  std::string scan_text(std::uint64_t number);

  double period_s() const;
  hal::Time turn_start(std::uint64_t number) const;
  std::uint32_t device_ms(hal::Time time) const;

  const HokuyoUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyStream link_;
  CastAhead ahead_;
  hal::Wake changed_;

  bool streaming_{}, adjusting_{}, laser_broken_{}, was_off_{};
  Stream stream_;
  hal::Time powered_{}, ready_{};
  hal::Time turning_since_{};
  std::uint64_t turns_before_{}, paced_by_{};
};

}  // namespace sim
