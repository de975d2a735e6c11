// A 3-D scanner made of a profile scanner on a pan unit.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "drivers/sweep_assembly.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"

namespace drivers {

struct SweepScannerConfig {
  SweepMount mount;
  SweepField field;
  SweepLimits limits;
  bool stop_and_go{};                // Stands for every profile: slow, and without any skew.
  double acceleration_radps2 = 0.5;  // Of the pan unit: it must be up to speed before it counts.
  double warm_up_s = 3;              // Of the profiles' clock before they count.
  double pan_late_s{};    // How much later than the profiles' the pan readings' times are.
  double settle_s = 0.1;  // After a stop.
  // By the profiles' driver: how unevenly they arrive. Empty: not known.
  std::function<double()> clock_jitter_s;
  // How much of a scan is done, 0 to 1. Empty: nobody wants to know.
  std::function<void(double)> progress;
};

// Turns through no more of the circle than the field needs, from its beginning each time. A lost
// profile is a column whose ranges are NaN: nothing is known there, not even that it is empty.
class SweepScanner final : public hal::Scanner {
 public:
  // All must outlive it.
  SweepScanner(SweepScannerConfig config, hal::Clock& clock, hal::ProfileScanner& profiles,
               hal::PanUnit& pan);

  // Fails with errc::invalid_argument for a field that cannot be had with this mount, and with
  // errc::io_error for a scan that is not good enough; problem() then says why. What the devices
  // fail with is passed on.
  hal::Task<hal::Result<hal::ScanCloud>> scan() override;

  const std::string& problem() const { return problem_; }   // Of the last scan; empty: none.
  const SweepQuality& quality() const { return quality_; }  // Of the last scan.

 private:
  hal::Task<hal::Result<hal::ScanCloud>> measure();
  hal::Result<hal::ScanCloud> judged(const SweepPlan& plan, hal::Result<SweepCloud> result);
  hal::Task<hal::Result<MirrorField>> learn_mirror();
  hal::Task<hal::Result<SweepCloud>> sweep(const SweepPlan& plan);
  hal::Task<hal::Result<SweepCloud>> stops(const SweepPlan& plan);
  hal::Task<hal::Result<void>> follow_pan(const SweepPlan& plan, std::vector<PanSample>& samples);
  hal::Task<void> collect(std::vector<hal::Profile>& profiles);
  hal::Task<void> drain();
  hal::Task<StoppedProfile> stopped_profile(hal::Time settled);
  void tell(double share) const;

  const SweepScannerConfig config_;
  const Eigen::Isometry3d T_P_L_;
  hal::Clock& clock_;
  hal::ProfileScanner& profiles_;
  hal::PanUnit& pan_;
  std::string problem_;
  SweepQuality quality_;
};

}  // namespace drivers
