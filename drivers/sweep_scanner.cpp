#include "drivers/sweep_scanner.hpp"

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <numbers>

namespace drivers {
namespace {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
namespace errc = boost::system::errc;
using errc::make_error_code;

constexpr int kLearnFrom = 9;               // Profiles.
constexpr int kReadings = 200;              // Of the pan angle in a sweep,
constexpr double kReadEveryMin_s = 0.02;    // as a slow line allows.
constexpr double kMargin_s = 0.25;          // Of pan angles before and after what counts.
constexpr int kLostInARow = 5;              // Stops without a profile: then there is no scanner.
constexpr hal::Duration kUnderWay = 300ms;  // The last profile comes so late at most.
constexpr hal::Duration kProfilePatience = 2s;

MirrorField field_of(const hal::Profile& profile, double interval_s) {
  return {profile.angle_first_rad, profile.angle_step_rad,
          static_cast<std::uint32_t>(profile.ranges_m.size()), profile.beam_period_s, interval_s};
}

std::string tenths(double angle_rad) {
  const double tenths = std::round(angle_rad * 1800 / std::numbers::pi) / 10;
  const std::string text = std::to_string(tenths);
  return text.substr(0, text.find('.') + 2);
}

// Why a pan unit did not set off, as far as its error tells.
std::string refusal(boost::system::error_code error, double angle_rad, double rate_radps) {
  if (error != errc::argument_out_of_domain) return "";
  return "the pan unit cannot turn to " + tenths(angle_rad) + " deg at " + tenths(rate_radps) +
         " deg/s: narrow the field of view, or turn more slowly by a smaller azimuth step";
}

// Of the turning mirror: its jitter is smoothed away, and so are profiles that were lost.
double interval_of(const std::vector<hal::Profile>& profiles) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < profiles.size(); ++i)
    steps_s.push_back(hal::seconds(profiles[i].stamp - profiles[i - 1].stamp) /
                      static_cast<double>(1 + profiles[i].lost_before));
  std::nth_element(steps_s.begin(),
                   steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 2),
                   steps_s.end());
  const hal::Profile& any = profiles.front();
  const double turn_s = any.beam_period_s * 2 * std::numbers::pi / std::abs(any.angle_step_rad);
  return turn_s * std::max(1.0, std::round(steps_s[steps_s.size() / 2] / turn_s));
}

}  // namespace

SweepScanner::SweepScanner(SweepScannerConfig config, hal::Clock& clock,
                           hal::ProfileScanner& profiles, hal::PanUnit& pan)
    : config_(std::move(config)),
      T_P_L_(config_.mount.T_P_L()),
      clock_(clock),
      profiles_(profiles),
      pan_(pan) {}

void SweepScanner::tell(double share) const {
  if (config_.progress) config_.progress(share);
}

hal::Task<hal::Result<hal::ScanCloud>> SweepScanner::scan() {
  problem_.clear();
  quality_ = {};
  tell(0);
  const auto started = co_await profiles_.start();
  if (!started) co_return started.error();
  auto cloud = co_await measure();
  (void)co_await profiles_.stop();  // A scanner that is gone has stopped.
  if (cloud) tell(1);
  co_return cloud;
}

hal::Task<hal::Result<hal::ScanCloud>> SweepScanner::measure() {
  const hal::Time warm = clock_.now() + hal::from_seconds(config_.warm_up_s);
  const auto mirror = co_await learn_mirror();
  if (!mirror) co_return mirror.error();
  SweepPlan plan = plan_sweep(config_.field, *mirror, T_P_L_);
  if (!plan.problem.empty()) {
    problem_ = plan.problem;
    co_return make_error_code(errc::invalid_argument);
  }
  if (config_.stop_and_go) plan.rate_radps = 0;
  const double ramp_rad = run_up_rad(plan, config_.acceleration_radps2);
  const auto there = co_await (pan_.move_to(plan.pan_first_rad - ramp_rad) || drain());
  if (const auto* moved = std::get_if<0>(&there); moved != nullptr && !*moved)
    co_return moved->error();
  co_await (clock_.sleep_until(warm) || drain());
  hal::Result<SweepCloud> result = make_error_code(errc::io_error);
  if (config_.stop_and_go)
    result = co_await stops(plan);
  else
    result = co_await sweep(plan);
  co_return judged(plan, std::move(result));
}

hal::Result<hal::ScanCloud> SweepScanner::judged(const SweepPlan& plan,
                                                 hal::Result<SweepCloud> result) {
  if (!result) return result.error();
  quality_ = result->quality;
  if (config_.clock_jitter_s) quality_.clock_jitter_s = config_.clock_jitter_s();
  problem_ = sweep_problem(quality_, plan, config_.limits);
  if (!problem_.empty()) return make_error_code(errc::io_error);
  return std::move(result->cloud);
}

hal::Task<hal::Result<MirrorField>> SweepScanner::learn_mirror() {
  std::vector<hal::Profile> some;
  while (some.size() < kLearnFrom) {
    auto profile = co_await profiles_.next_profile();
    if (!profile) co_return profile.error();
    some.push_back(std::move(*profile));
  }
  co_return field_of(some.back(), interval_of(some));
}

// Ends only by cancellation.
hal::Task<void> SweepScanner::drain() {
  for (;;) {
    const auto profile = co_await profiles_.next_profile();
    if (!profile) co_await clock_.sleep_for(100ms);
  }
}

// The same, but keeps them. What does not come is lost, and counted by the assembly.
hal::Task<void> SweepScanner::collect(std::vector<hal::Profile>& profiles) {
  for (;;) {
    auto profile = co_await profiles_.next_profile();
    if (profile)
      profiles.push_back(std::move(*profile));
    else
      co_await clock_.sleep_for(100ms);
  }
}

hal::Task<hal::Result<SweepCloud>> SweepScanner::sweep(const SweepPlan& plan) {
  const double ramp_rad = run_up_rad(plan, config_.acceleration_radps2);
  const auto turned = co_await pan_.turn_to(plan.pan_last_rad + ramp_rad, plan.rate_radps);
  if (!turned) {
    problem_ = refusal(turned.error(), plan.pan_last_rad + ramp_rad, plan.rate_radps);
    co_return turned.error();
  }
  std::vector<PanSample> samples;
  std::vector<hal::Profile> profiles;
  const auto followed = co_await (follow_pan(plan, samples) || collect(profiles));
  if (const auto* ended = std::get_if<0>(&followed); ended != nullptr && !*ended) {
    (void)co_await pan_.halt();
    co_return ended->error();
  }
  const auto fit = fit_pan(samples, 4 * config_.limits.pan_residual_rms_max_rad);
  if (!fit) {
    problem_ = "only " + std::to_string(samples.size()) + " pan angles";
    co_return make_error_code(errc::io_error);
  }
  co_return assemble_sweep(plan, T_P_L_, profiles, *fit, config_.pan_late_s);
}

// Until the last profile must have come. Keeps what was read where the speed is constant.
hal::Task<hal::Result<void>> SweepScanner::follow_pan(const SweepPlan& plan,
                                                      std::vector<PanSample>& samples) {
  const double width_rad = plan.pan_last_rad - plan.pan_first_rad + plan.pan_step_rad;
  const double sweep_s = width_rad / plan.rate_radps;
  const hal::Duration every = hal::from_seconds(std::max(kReadEveryMin_s, sweep_s / kReadings));
  const double slack_rad = plan.rate_radps * kMargin_s;
  const double ramps_s = 2 * plan.rate_radps / config_.acceleration_radps2;
  const hal::Time deadline = clock_.now() + hal::from_seconds(1.2 * sweep_s + ramps_s + 5);
  for (;;) {
    const auto reading = co_await pan_.read();
    if (!reading) co_return reading.error();
    const double angle = reading->angle_rad;
    if (angle >= plan.pan_first_rad - slack_rad && angle <= plan.pan_last_rad + slack_rad)
      samples.push_back({reading->asked, reading->answered, angle});
    tell(std::clamp((angle - plan.pan_first_rad) / width_rad, 0.0, 1.0));
    if (angle > plan.pan_last_rad + plan.pan_step_rad) break;
    if (clock_.now() > deadline) co_return make_error_code(errc::timed_out);
    co_await clock_.sleep_for(every);
  }
  co_await clock_.sleep_for(kUnderWay);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<SweepCloud>> SweepScanner::stops(const SweepPlan& plan) {
  const auto columns = static_cast<std::uint32_t>(std::lround(
                           (plan.pan_last_rad - plan.pan_first_rad) / plan.pan_step_rad)) +
                       1;
  std::vector<StoppedProfile> taken;
  int lost_in_a_row = 0;
  for (std::uint32_t i = 0; i < columns; ++i) {
    const auto there =
        co_await (pan_.move_to(plan.pan_first_rad + i * plan.pan_step_rad) || drain());
    if (const auto* moved = std::get_if<0>(&there); moved != nullptr && !*moved)
      co_return moved->error();
    const hal::Time settled = clock_.now() + hal::from_seconds(config_.settle_s);
    StoppedProfile stopped = co_await stopped_profile(settled);
    lost_in_a_row = stopped.lost ? lost_in_a_row + 1 : 0;
    if (lost_in_a_row > kLostInARow) co_return make_error_code(errc::timed_out);
    const auto reading = co_await pan_.read();
    if (!reading) co_return reading.error();
    stopped.pan_rad = reading->angle_rad;
    taken.push_back(std::move(stopped));
    tell(static_cast<double>(i + 1) / columns);
  }
  co_return assemble_stops(plan, T_P_L_, taken);
}

// The first that began after the axis had settled.
hal::Task<StoppedProfile> SweepScanner::stopped_profile(hal::Time settled) {
  const hal::Time deadline = settled + kProfilePatience;
  StoppedProfile stopped;
  stopped.lost = true;
  while (clock_.now() < deadline) {
    auto profile = co_await profiles_.next_profile();
    if (!profile || profile->stamp < settled) continue;
    stopped.profile = std::move(*profile);
    stopped.lost = false;
    break;
  }
  co_return stopped;
}

}  // namespace drivers
