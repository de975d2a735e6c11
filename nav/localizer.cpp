#include "nav/localizer.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace nav {
namespace {

constexpr double kAhead_s = 0.5;

// Of two events of one stamp, the kind that goes first; of one kind, what came first.
bool before(hal::Time stamp, const LocalizerEvent& event, hal::Time other,
            const LocalizerEvent& other_event) {
  return stamp != other ? stamp < other : event.index() < other_event.index();
}

hal::Pose2 between(const LocalizerFilter& from, const LocalizerFilter& to, hal::Time stamp) {
  hal::Pose2 pose = from.pose();
  if (!from.moved_until()) return pose;
  const double span_s = hal::seconds(*to.moved_until() - *from.moved_until());
  const double share =
      std::clamp(hal::seconds(stamp - *from.moved_until()) / std::max(1e-9, span_s), 0.0, 1.0);
  const hal::Pose2 next = to.pose();
  pose.position_m += share * (next.position_m - pose.position_m);
  pose.heading_rad +=
      share * std::remainder(next.heading_rad - pose.heading_rad, 2 * std::numbers::pi);
  return pose;
}

hal::Pose2 ahead(const LocalizerFilter& from, hal::Time stamp) {
  hal::Pose2 pose = from.pose();
  if (!from.moved_until()) return pose;
  const double span_s = std::clamp(hal::seconds(stamp - *from.moved_until()), 0.0, kAhead_s);
  const double turn_rad = span_s * from.turn_radps();
  const double along = pose.heading_rad + turn_rad / 2;
  pose.position_m += span_s * from.speed_mps() * Eigen::Vector2d(std::cos(along), std::sin(along));
  pose.heading_rad = std::remainder(pose.heading_rad + turn_rad, 2 * std::numbers::pi);
  return pose;
}

std::string_view remedy(Source source) {
  switch (source) {
    case Source::gnss_position:
      return "expect multipath near high walls; if it lasts in the open, check the antenna's mount "
             "and the site's anchor";
    case Source::gnss_velocity:
      return "check the wheels for slip and the antenna's mount";
    case Source::pose_fix:
      return "check the map against the site, or the scanner's mount";
    case Source::landmark:
      return "check the marks' positions and names";
    case Source::beacon:
      break;
  }
  return "check the beacons' positions, and for walls in between";
}

}  // namespace

std::string_view name(Source source) {
  switch (source) {
    case Source::gnss_position:
      return "satellite positions";
    case Source::gnss_velocity:
      return "satellite velocities";
    case Source::pose_fix:
      return "poses from scans";
    case Source::landmark:
      return "landmarks";
    case Source::beacon:
      break;
  }
  return "beacon ranges";
}

Localizer::Localizer(const LocalizerConfig& config, const hal::Pose2& start,
                     const Eigen::Matrix3d& covariance)
    : config_(config),
      final_{Entry{{}, InertialSample{}, LocalizerFilter(config, start, covariance)}},
      filter_(final_.front().after) {}

void Localizer::predict(const hal::ImuSample& sample) {
  add(InertialSample{sample.stamp, {0, 0, sample.yaw_rate_radps}, {}});
}

Gate Localizer::correct(const hal::GnssFix& fix) {
  if (!(fix.sigma_m >= 0)) return Gate::rejected;
  return add(GnssPosition{fix.stamp, fix.position_m,
                          fix.sigma_m * fix.sigma_m * Eigen::Matrix2d::Identity()})
      .gate;
}

Correction Localizer::add(const LocalizerEvent& event) {
  const hal::Time stamp = stamp_of(event);
  if (final_until_ && stamp < *final_until_) return {Gate::rejected, true, 0, 0};
  const auto after = [&](const Entry& entry) {
    return before(stamp, event, entry.stamp, entry.event);
  };
  // Most come in order: look from the end.
  auto at = history_.end();
  while (at != history_.begin() && after(*std::prev(at))) --at;
  const bool latest = at == history_.end();  // The filter is that of the last entry already.
  if (!latest) filter_ = at == history_.begin() ? final_.front().after : std::prev(at)->after;
  Correction correction;
  const bool gated = nav::gated(event);
  correction.gate = filter_.apply(config_, event);
  if (gated) {
    correction.nis = filter_.last_nis();
    correction.dimension = filter_.last_dimension();
  }
  for (at = std::next(keep(at, stamp, event)); at != history_.end(); ++at) {
    filter_.apply(config_, at->event);
    at->after = filter_;
  }
  forget(history_.back().stamp);
  return correction;
}

// With the filter as it is now.
std::list<Localizer::Entry>::iterator Localizer::keep(std::list<Entry>::const_iterator before,
                                                      hal::Time stamp,
                                                      const LocalizerEvent& event) {
  if (spare_.empty()) return history_.insert(before, Entry{stamp, event, filter_});
  const auto kept = spare_.begin();
  history_.splice(before, spare_, kept);
  kept->stamp = stamp;
  kept->event = event;
  kept->after = filter_;
  return kept;
}

void Localizer::forget(hal::Time now) {
  const hal::Time oldest = now - hal::from_seconds(config_.history_s);
  while (history_.size() > 1 &&
         (history_.front().stamp < oldest || history_.size() > config_.history_max)) {
    final_until_ = history_.front().stamp;
    spare_.splice(spare_.begin(), final_);
    final_.splice(final_.begin(), history_, history_.begin());
  }
}

// Poses stand where travel reports end: between two of them the way is cut in proportion.
hal::Pose2 Localizer::pose_at(hal::Time stamp) const {
  const LocalizerFilter* from = &final_.front().after;
  for (const Entry& entry : history_) {
    if (!std::holds_alternative<hal::WheelTravel>(entry.event)) {
      if (entry.stamp <= stamp) from = &entry.after;  // Corrected since.
      continue;
    }
    if (entry.stamp > stamp) return between(*from, entry.after, stamp);
    from = &entry.after;
  }
  return ahead(*from, stamp);
}

std::vector<LocalizerFault> Localizer::faults() const {
  std::vector<LocalizerFault> faults;
  for (std::size_t i = 0; i < kSources; ++i) {
    const auto source = static_cast<Source>(i);
    const RefusalStreak& streak = filter_.refusals(source);
    if (streak.count < config_.streak_fault ||
        hal::seconds(streak.last - streak.first) < config_.streak_fault_s)
      continue;
    faults.push_back({source, streak.count, hal::seconds(streak.first),
                      fmt::format("{} {} in a row disagree with the localizer and were refused: {}",
                                  streak.count, name(source), remedy(source))});
  }
  return faults;
}

Eigen::Isometry3d mounted_pose(const Eigen::Isometry3d& T_W_B, const Eigen::Isometry3d& T_B_P,
                               double pan_rad, const Eigen::Isometry3d& T_P_S) {
  return T_W_B * T_B_P * Eigen::AngleAxisd(pan_rad, Eigen::Vector3d::UnitZ()) * T_P_S;
}

}  // namespace nav
