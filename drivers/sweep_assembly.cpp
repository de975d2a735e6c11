#include "drivers/sweep_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "hal/pan_fan.hpp"

namespace drivers {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDeg = kPi / 180;
constexpr float kNoClaim = std::numeric_limits<float>::quiet_NaN();
constexpr double kUprightMax_rad = 10 * kDeg;  // Of the mirror's axis from the horizon.
constexpr double kReach_rad = 0.5 * kDeg;      // By so much a field may be missed.
constexpr double kEven_s = 0.5;                // Of even speed before and after what counts.

// The plane that the mirror sweeps, as elevations on one side of the pan axis.
struct Plane {
  double azimuth_rad{};  // Of the near side.
  double sign = 1;       // Of elevation per mirror angle.
  double at_zero_rad{};  // The elevation of mirror angle 0.

  double elevation(double mirror_rad) const { return at_zero_rad + sign * mirror_rad; }
};

// The side that the middle of the arc looks to is the near one.
Plane plane_of(const Eigen::Isometry3d& T_P_L, double middle_rad) {
  const Eigen::Vector3d axis = T_P_L.linear().col(2);
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ().cross(axis).normalized();
  const Eigen::Vector3d up = axis.cross(ahead);
  const auto elevation = [&](const Eigen::Vector3d& d) {
    return std::atan2(d.dot(up), d.dot(ahead));
  };
  Plane plane;
  plane.at_zero_rad = elevation(T_P_L.linear().col(0));
  const double middle = std::remainder(plane.at_zero_rad + middle_rad, 2 * kPi);
  if (std::cos(middle) < -1e-9) {  // It looks to the other side.
    ahead = -ahead;
    plane.sign = -1;
    plane.at_zero_rad = kPi - plane.at_zero_rad;
  }
  const double now = plane.elevation(middle_rad);
  plane.at_zero_rad += std::remainder(now, 2 * kPi) - now;
  plane.azimuth_rad = std::atan2(ahead.y(), ahead.x());
  return plane;
}

std::string degrees(double angle_rad) {
  const double tenths = std::round(angle_rad / kDeg * 10) / 10;
  std::string text = std::to_string(tenths);
  return text.substr(0, text.find('.') + 2) + " deg";
}

// The beams from elevation `low` to `high`, in rising order.
void choose_rows(SweepPlan& plan, const MirrorField& mirror, const Plane& plane, double low_rad,
                 double high_rad) {
  const auto elevation = [&](std::uint32_t beam) {
    return plane.elevation(mirror.angle_first_rad + beam * mirror.angle_step_rad);
  };
  const double step = plane.sign * mirror.angle_step_rad;
  const double slack = 1e-9;
  std::uint32_t first = mirror.beams, last = 0;
  for (std::uint32_t beam = 0; beam < mirror.beams; ++beam) {
    if (elevation(beam) < low_rad - slack || elevation(beam) > high_rad + slack) continue;
    first = std::min(first, beam);
    last = beam;
  }
  if (first == mirror.beams) return;
  plan.rows = last - first + 1;
  plan.beam_step = step > 0 ? 1 : -1;
  plan.beam_first = step > 0 ? first : last;
  plan.elevation_first_rad = elevation(plan.beam_first);
  plan.elevation_step_rad = std::abs(step);
}

void choose_pan(SweepPlan& plan, const SweepField& field, const MirrorField& mirror) {
  const double width = plan.both_sides ? std::min(field.fov_rad, kPi) : field.fov_rad;
  const double columns = std::max(1.0, std::round(width / field.azimuth_step_rad));
  const double step = width / columns;
  plan.pan_first_rad = (step - width) / 2 - plan.azimuth_offset_rad;
  plan.pan_last_rad = (width - step) / 2 - plan.azimuth_offset_rad;
  plan.pan_step_rad = step;
  plan.interval_s = mirror.interval_s;
  plan.rate_radps = step / mirror.interval_s;
}

// The directions of a plan's rows in P, by single precision's error only from the true ones.
std::vector<Eigen::Vector3d> row_directions(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L,
                                            const hal::Profile& profile) {
  std::vector<Eigen::Vector3d> directions;
  directions.reserve(plan.rows);
  for (std::uint32_t row = 0; row < plan.rows; ++row) {
    const double beam = plan.beam_first + static_cast<double>(row) * plan.beam_step;
    const double angle = profile.angle_first_rad + beam * profile.angle_step_rad;
    directions.emplace_back(T_P_L.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
  }
  return directions;
}

// Column by column, each while it is in the cache.
class CloudBuilder {
 public:
  CloudBuilder(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L, const hal::Profile& like,
               double per_row_rad, const hal::ScanPattern& pattern)
      : plan_(plan),
        fan_{T_P_L.translation(), row_directions(plan, T_P_L, like), per_row_rad, {}},
        aim_(fan_) {
    cloud_.pattern = pattern;
    fan_.pan_rad.reserve(pattern.columns);
    cloud_.ranges_m.reserve(pattern.beams());
    cloud_.beams.reserve(pattern.beams());
  }
  CloudBuilder(const CloudBuilder&) = delete;
  CloudBuilder& operator=(const CloudBuilder&) = delete;

  // Row 0's pan angle; without a profile that fits nothing is known.
  void add(double pan_rad, const hal::Profile* profile) {
    const std::size_t at = cloud_.beams.size();
    fan_.pan_rad.push_back(pan_rad);
    cloud_.beams.resize(at + plan_.rows);
    cloud_.ranges_m.resize(at + plan_.rows, kNoClaim);
    aim_.column(pan_rad, std::span(cloud_.beams).last(plan_.rows));
    if (profile != nullptr && fits(*profile)) fill(*profile, &cloud_.ranges_m[at]);
  }
  bool fits(const hal::Profile& profile) const {
    const std::int64_t last = plan_.beam_first + std::int64_t{plan_.rows - 1} * plan_.beam_step;
    const auto size = static_cast<std::int64_t>(profile.ranges_m.size());
    return last >= 0 && last < size && plan_.beam_first < size;
  }
  hal::ScanCloud built() {
    cloud_.fan = std::move(fan_);
    return std::move(cloud_);
  }

 private:
  void fill(const hal::Profile& profile, float* ranges_m) const {
    std::int64_t beam = plan_.beam_first;
    for (std::uint32_t row = 0; row < plan_.rows; ++row, beam += plan_.beam_step)
      ranges_m[row] = profile.ranges_m[static_cast<std::size_t>(beam)];
  }

  const SweepPlan& plan_;
  hal::PanFan fan_;
  hal::FanAim aim_;
  hal::ScanCloud cloud_;
};

hal::ScanPattern pattern_of(const SweepPlan& plan, double azimuth_first_rad,
                            double azimuth_step_rad, std::uint32_t columns) {
  return {azimuth_first_rad + plan.azimuth_offset_rad,
          azimuth_step_rad,
          plan.elevation_first_rad,
          plan.elevation_step_rad,
          columns,
          plan.rows};
}

hal::Time last_beam(const hal::Profile& profile) {
  const auto beams = static_cast<double>(profile.ranges_m.size());
  return profile.stamp + hal::from_seconds(profile.beam_period_s * beams);
}

// A profile, the pan angle of its middle and its column.
struct Placed {
  double pan_rad{};
  const hal::Profile* profile{};
  std::uint32_t column{};
};

hal::Time middle_of(const hal::Profile& profile) {
  return profile.stamp + (last_beam(profile) - profile.stamp) / 2;
}

// Those within the plan, counted on from the first: a gap is as many columns as fit into it.
std::vector<Placed> place(const SweepPlan& plan, std::span<const hal::Profile> profiles,
                          const PanFit& pan, hal::Duration pan_late) {
  std::vector<Placed> placed;
  const double half = plan.pan_step_rad / 2;
  for (const hal::Profile& profile : profiles) {
    const double angle = pan.angle_at(middle_of(profile) + pan_late);
    if (angle >= plan.pan_first_rad - half && angle < plan.pan_last_rad + half)
      placed.push_back({angle, &profile});
  }
  std::stable_sort(placed.begin(), placed.end(),
                   [](const Placed& a, const Placed& b) { return a.pan_rad < b.pan_rad; });
  const double step = std::abs(pan.rate_radps) * plan.interval_s;
  for (std::size_t i = 1; i < placed.size(); ++i) {
    const double steps = std::round((placed[i].pan_rad - placed[i - 1].pan_rad) / step);
    placed[i].column = placed[i - 1].column + static_cast<std::uint32_t>(std::max(steps, 0.0));
  }
  return placed;
}

SweepQuality judge(const SweepPlan& plan, const std::vector<Placed>& placed, const PanFit& pan) {
  SweepQuality quality;
  quality.pan_residual_rms_rad = pan.residual_rms_rad;
  quality.pan_residual_max_rad = pan.residual_max_rad;
  quality.pan_readings = pan.used;
  quality.rate_radps = pan.rate_radps;
  if (placed.empty()) return quality;
  const auto beyond = [&](double gap_rad) {  // Lost before the first or after the last.
    return static_cast<std::uint32_t>(std::max(0.0, std::floor(gap_rad / plan.pan_step_rad + 0.3)));
  };
  const std::uint32_t ends = beyond(placed.front().pan_rad - plan.pan_first_rad) +
                             beyond(plan.pan_last_rad - placed.back().pan_rad);
  std::uint32_t filled = 1;
  for (std::size_t i = 1; i < placed.size(); ++i)
    filled += placed[i].column != placed[i - 1].column;
  quality.columns = placed.back().column + 1 + ends;
  quality.columns_lost = quality.columns - filled;
  return quality;
}

}  // namespace

Eigen::Isometry3d SweepMount::T_P_L() const {
  Eigen::Matrix3d upright;  // x ahead, y up, z to the right.
  upright << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(-tilt_rad, Eigen::Vector3d::UnitY()))
                   .toRotationMatrix() *
               upright;
  T.translation() = P_offset_m;
  return T;
}

double run_up_rad(const SweepPlan& plan, double acceleration_radps2) {
  return plan.rate_radps * plan.rate_radps / (2 * acceleration_radps2) + plan.rate_radps * kEven_s;
}

SweepPlan plan_sweep(const SweepField& field, const MirrorField& mirror,
                     const Eigen::Isometry3d& T_P_L) {
  SweepPlan plan;
  if (!(field.fov_rad > 0) || !(field.fov_rad <= 2 * kPi + 1e-9) || !(field.azimuth_step_rad > 0) ||
      !(field.elevation_min_rad < field.elevation_max_rad))
    return plan.problem = "the field of view must be positive angles, at most a full circle", plan;
  if (mirror.beams < 2 || mirror.angle_step_rad == 0 || !(mirror.interval_s > 0))
    return plan.problem = "the profiles have no extent", plan;
  if (std::abs(T_P_L.linear().col(2).z()) > std::sin(kUprightMax_rad))
    return plan.problem = "the mirror's axis must lie level: profiles must be upright", plan;
  const double end_rad = mirror.angle_first_rad + (mirror.beams - 1) * mirror.angle_step_rad;
  const Plane plane = plane_of(T_P_L, (mirror.angle_first_rad + end_rad) / 2);
  const double one = plane.elevation(mirror.angle_first_rad), other = plane.elevation(end_rad);
  const double low = std::max(std::min(one, other), -kPi / 2);
  const double far_low = kPi - std::min(std::max(one, other), 3 * kPi / 2);
  const double high = std::min(std::max(one, other), kPi / 2);
  if (low > field.elevation_min_rad + kReach_rad || high < field.elevation_max_rad - kReach_rad) {
    plan.problem = "the mirror reaches from " + degrees(low) + " to " + degrees(high) +
                   ", not from " + degrees(field.elevation_min_rad) + " to " +
                   degrees(field.elevation_max_rad) + ": tilt the scanner or ask for less";
    return plan;
  }
  plan.azimuth_offset_rad = plane.azimuth_rad;
  const bool far_too = far_low <= field.elevation_min_rad + kReach_rad &&
                       field.elevation_max_rad > kPi / 2 - kReach_rad;
  plan.both_sides = far_too && field.fov_rad > kPi;
  choose_rows(plan, mirror, plane, field.elevation_min_rad,
              plan.both_sides ? kPi - field.elevation_min_rad : field.elevation_max_rad);
  choose_pan(plan, field, mirror);
  return plan;
}

std::string sweep_problem(const SweepQuality& quality, const SweepPlan& plan,
                          const SweepLimits& limits) {
  const auto micro = [](double value) { return std::to_string(std::lround(value * 1e6)) + "e-6"; };
  if (quality.columns == 0) return "no profile came from the sweep";
  if (quality.lost_share() > limits.lost_share_max)
    return std::to_string(quality.columns_lost) + " of " + std::to_string(quality.columns) +
           " profiles are lost";
  if (plan.rate_radps == 0) return "";  // Stops need no rate.
  if (quality.pan_readings < limits.pan_readings_min)
    return "only " + std::to_string(quality.pan_readings) + " pan angles";
  if (quality.pan_residual_rms_rad > limits.pan_residual_rms_max_rad)
    return "the pan unit turned unevenly: " + micro(quality.pan_residual_rms_rad) + " rad rms";
  if (std::abs(quality.rate_radps / plan.rate_radps - 1) > limits.rate_error_max)
    return "the pan unit turned at " + micro(quality.rate_radps) + " instead of " +
           micro(plan.rate_radps) + " rad/s";
  if (quality.clock_jitter_s > limits.clock_jitter_max_s)
    return "profiles arrive too unevenly: " + micro(quality.clock_jitter_s) + " s";
  return "";
}

SweepCloud assemble_sweep(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L,
                          std::span<const hal::Profile> profiles, const PanFit& pan,
                          double pan_late_s) {
  const hal::Duration late = hal::from_seconds(pan_late_s);
  const auto placed = place(plan, profiles, pan, late);
  SweepCloud sweep{{}, judge(plan, placed, pan)};
  if (placed.empty()) return sweep;
  const std::uint32_t columns = placed.back().column + 1;
  const double step = columns == 1 ? plan.pan_step_rad
                                   : (placed.back().pan_rad - placed.front().pan_rad) /
                                         static_cast<double>(columns - 1);
  const double per_beam = pan.rate_radps * placed.front().profile->beam_period_s;
  CloudBuilder cloud(plan, T_P_L, *placed.front().profile, per_beam * plan.beam_step,
                     pattern_of(plan, placed.front().pan_rad, step, columns));
  std::size_t next = 0;
  for (std::uint32_t c = 0; c < columns; ++c) {
    while (next < placed.size() && placed[next].column < c) ++next;
    const hal::Profile* const profile =
        next < placed.size() && placed[next].column == c ? placed[next].profile : nullptr;
    const double first_beam =
        profile ? pan.angle_at(profile->stamp + late)
                : placed.front().pan_rad + c * step -
                      per_beam * static_cast<double>(placed.front().profile->ranges_m.size()) / 2;
    cloud.add(first_beam + per_beam * plan.beam_first, profile);
  }
  sweep.cloud = cloud.built();
  sweep.cloud.stamp = last_beam(*placed.back().profile);
  return sweep;
}

SweepCloud assemble_stops(const SweepPlan& plan, const Eigen::Isometry3d& T_P_L,
                          std::span<const StoppedProfile> stops) {
  SweepCloud sweep;
  const auto some = std::find_if(stops.begin(), stops.end(), [](const auto& s) { return !s.lost; });
  if (some == stops.end()) return sweep;
  CloudBuilder cloud(plan, T_P_L, some->profile, 0,
                     pattern_of(plan, plan.pan_first_rad, plan.pan_step_rad,
                                static_cast<std::uint32_t>(stops.size())));
  hal::Time last{};
  sweep.quality.columns = static_cast<std::uint32_t>(stops.size());
  for (const StoppedProfile& stop : stops) {
    const bool lost = stop.lost || !cloud.fits(stop.profile);
    cloud.add(stop.pan_rad, lost ? nullptr : &stop.profile);
    sweep.quality.columns_lost += lost;
    if (!lost) last = std::max(last, last_beam(stop.profile));
  }
  sweep.cloud = cloud.built();
  sweep.cloud.stamp = last;
  return sweep;
}

}  // namespace drivers
