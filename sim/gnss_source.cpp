#include "sim/gnss_source.hpp"

#include <chrono>
#include <cmath>

namespace sim {
namespace {

constexpr std::int64_t kDay_ns = 86'400'000'000'000, kWeek_ms = 604'800'000;
constexpr std::int64_t kLeap_ns = 18'000'000'000;  // GPS time is ahead of UTC.

drivers::GnssDate days_after(const drivers::GnssDate& date, std::int64_t count) {
  using namespace std::chrono;
  const year_month_day start{year(date.year), month(static_cast<unsigned>(date.month)),
                             day(static_cast<unsigned>(date.day))};
  const year_month_day then = sys_days(start) + days(count);
  return {int(then.year()), int(unsigned(then.month())), int(unsigned(then.day()))};
}

}  // namespace

GnssSource::GnssSource(const GnssSourceConfig& config, World& world, hal::Clock& clock,
                       UnitFaults& faults)
    : config_(config), frame_(config.anchor), world_(world), clock_(clock), faults_(faults) {}

hal::Task<void> GnssSource::next_due(double rate_hz) {
  const hal::Duration every = faults_.slowed(hal::from_seconds(1 / rate_hz));
  co_await clock_.sleep_until(hal::Time((clock_.now().time_since_epoch() / every + 1) * every));
}

GnssMoment GnssSource::sample() {
  world_.advance(clock_.now());
  const hal::GnssFix fix = world_.sample_gnss();
  const double height_m = world_.robot().ground_z_m + config_.antenna_height_m;
  GnssMoment moment;
  moment.at = frame_.to_earth({fix.position_m.x(), fix.position_m.y(), height_m});
  moment.at.latitude_deg *= faults_.wrong_factor();
  moment.at.longitude_deg *= faults_.wrong_factor();
  moment.sigma_m = fix.sigma_m;
  moment.hidden = world_.gnss_hidden();
  const double since_ns = static_cast<double>(clock_.now().time_since_epoch().count());
  const std::int64_t gps_ms =
      config_.itow_ms + std::llround(since_ns * (1 + config_.clock_skew) / 1e6);
  moment.itow_ms = static_cast<std::uint32_t>(gps_ms % kWeek_ms);
  const std::int64_t day_ns = config_.itow_ms % 86'400'000 * 1'000'000;
  const std::int64_t utc_ns =
      day_ns + std::llround(since_ns * (1 + config_.clock_skew) / 1e6) * 1'000'000 - kLeap_ns;
  const std::int64_t days = utc_ns >= 0 ? utc_ns / kDay_ns : -1;
  moment.utc_time_of_day_ns = utc_ns - days * kDay_ns;
  moment.date = days_after(config_.date, days + world_.date_shift_days());
  return moment;
}

}  // namespace sim
