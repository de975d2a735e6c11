// What every satellite receiver's loop does with an epoch: position in W, time by our clock, and
// whether to believe it.
#pragma once

#include <optional>

#include "drivers/clock_fit.hpp"
#include "drivers/gnss_values.hpp"
#include "drivers/outbox.hpp"
#include "drivers/site_frame.hpp"
#include "drivers/stream_health.hpp"

namespace drivers {

namespace gnss_fault {
inline constexpr Fault kNoFix{1, "no fix", "too few satellites",
                              "give the antenna a clear sky; a cold start takes a minute"};
inline constexpr Fault kFarAway{2, "fix far from the site",
                                "a wrong origin of the site, or false signals",
                                "correct the site's origin; do not trust satellites here"};
inline constexpr Fault kNoAccuracy{3, "accuracy unknown", "it sends neither accuracy nor dilution",
                                   "let it send GST, or GGA with HDOP"};
}  // namespace gnss_fault

struct GnssOutputConfig {
  GeoAnchor anchor;
  double rate_hz = 5;
  double distance_max_m = 20'000;  // From W's origin: farther is no fix of this site.
  // One sigma per axis at HDOP 1 where the receiver claims no accuracy of its own, by quality.
  double single_m = 3, differential_m = 0.8, rtk_float_m = 0.3, rtk_fixed_m = 0.02;
};

class GnssOutput {
 public:
  explicit GnssOutput(const GnssOutputConfig& config);

  hal::Task<hal::Result<hal::GnssFix>> take() { return fixes_.take(); }

  // Before a (re)start of the receiver.
  void restart(hal::Time now, const FrameReader& reader);
  // An epoch as it arrived. True when it is new, whatever its quality.
  bool add(const GnssEpoch& epoch, hal::Time arrival);
  void repeated() { health_.repeated(); }  // A message came again, or late.
  // Call at times: sets what is wrong with the stream. True when nothing new came for `patience`.
  bool stale(hal::Time now, const FrameReader& reader, hal::Duration patience);
  // To be told to whoever waits for a fix.
  void fail(boost::system::error_code error) { fixes_.fail(error); }

  Troubles& troubles() { return troubles_; }
  const Troubles& troubles() const { return troubles_; }
  const GnssEpoch& last() const { return last_; }  // Of any quality.
  const ClockFit& clock_fit() const { return fit_; }
  bool flows() const { return flows_; }  // New epochs come.
  double period_s() const { return 1 / config_.rate_hz; }

 private:
  std::optional<std::int64_t> device_ns(const GnssEpoch& epoch) const;
  std::optional<double> sigma_m(const GnssEpoch& epoch) const;
  void put_fix(const GnssEpoch& epoch, hal::Time stamp);

  GnssOutputConfig config_;
  SiteFrame frame_;
  StreamHealth health_;
  Outbox<hal::GnssFix> fixes_{16};
  Troubles troubles_;
  ClockFit fit_;
  std::optional<std::int64_t> device_ns_;  // Of the last epoch.
  GnssEpoch last_;
  hal::Time new_at_{};
  bool flows_ = false;
};

}  // namespace drivers
