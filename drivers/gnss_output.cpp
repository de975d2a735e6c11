#include "drivers/gnss_output.hpp"

#include <algorithm>
#include <cmath>

namespace drivers {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr std::int64_t kDay_ns = 86'400 * kSecond_ns, kWeek_ns = 7 * kDay_ns;
constexpr std::int64_t kBack_ns = 2 * kSecond_ns;  // A leap second and a correction of the time.

// A receiver sets its clock when it finds the time: a step of leap seconds is a new clock.
constexpr ClockFitLimits kFitLimits{120, 1, 200e-6, 0.9, 0.9};

// `raw`, which begins again after `turn`, as the one nearest to `last`.
std::int64_t unwrapped(std::int64_t raw, std::int64_t turn, std::optional<std::int64_t> last) {
  if (!last) return raw;
  const std::int64_t behind = *last - raw + turn / 2;
  return raw + (behind >= 0 ? behind / turn : -((turn - 1 - behind) / turn)) * turn;
}

}  // namespace

GnssOutput::GnssOutput(const GnssOutputConfig& config)
    : config_(config),
      frame_(config.anchor),
      health_({1 / config.rate_hz, 0.25}),
      fit_(kFitLimits) {}

void GnssOutput::restart(hal::Time now, const FrameReader& reader) {
  health_.restart(now, reader);
  fit_ = ClockFit(kFitLimits);
  device_ns_.reset();
  new_at_ = now;
  flows_ = false;
}

std::optional<std::int64_t> GnssOutput::device_ns(const GnssEpoch& epoch) const {
  if (epoch.itow_ms) return unwrapped(*epoch.itow_ms * kMillisecond_ns, kWeek_ns, device_ns_);
  if (epoch.time_of_day_ns) return unwrapped(*epoch.time_of_day_ns, kDay_ns, device_ns_);
  return std::nullopt;
}

bool GnssOutput::add(const GnssEpoch& epoch, hal::Time arrival) {
  const auto time_ns = device_ns(epoch);
  const bool again = time_ns && device_ns_ && *time_ns <= *device_ns_;
  if (again && *time_ns > *device_ns_ - kBack_ns) {
    health_.repeated();
    return false;
  }
  device_ns_ = time_ns;
  new_at_ = arrival;
  last_ = epoch;
  if (!flows_) {
    flows_ = true;
    troubles_.clear(stream_fault::kSilent);
    troubles_.clear(stream_fault::kFrozen);
  }
  hal::Time stamp = arrival;
  if (time_ns) {
    fit_.add(*time_ns, arrival);
    stamp = *fit_.to_ours(*time_ns);
  }
  health_.good(time_ns ? fit_.last_excess_s() : 0);
  put_fix(epoch, stamp);
  return true;
}

void GnssOutput::put_fix(const GnssEpoch& epoch, hal::Time stamp) {
  troubles_.set_if(!epoch.usable(), gnss_fault::kNoFix,
                   std::to_string(epoch.satellites_used.value_or(0)) + " satellites used");
  if (!epoch.usable()) return;
  const GeoPoint at{epoch.latitude->deg(), epoch.longitude->deg(),
                    epoch.altitude_ellipsoid_m.value_or(config_.anchor.height_m)};
  const Eigen::Vector2d position_m = frame_.to_site(at).head<2>();
  const bool far = !(position_m.norm() <= config_.distance_max_m);
  troubles_.set_if(far, gnss_fault::kFarAway,
                   std::to_string(std::llround(position_m.norm() / 1000)) + " km away");
  const auto sigma = sigma_m(epoch);
  troubles_.set_if(!sigma, gnss_fault::kNoAccuracy);
  if (!far && sigma) fixes_.put({stamp, position_m, *sigma});
}

// As claimed, per axis; a radius of 68 % covers both axes.
std::optional<double> GnssOutput::sigma_m(const GnssEpoch& epoch) const {
  if (epoch.sigma_north_m && epoch.sigma_east_m)
    return std::hypot(*epoch.sigma_north_m, *epoch.sigma_east_m) / std::sqrt(2.0);
  if (epoch.horizontal_accuracy_m) return *epoch.horizontal_accuracy_m / std::sqrt(2.0);
  if (!epoch.hdop) return std::nullopt;
  switch (epoch.quality) {
    case GnssQuality::rtk_fixed:
      return config_.rtk_fixed_m * *epoch.hdop;
    case GnssQuality::rtk_float:
      return config_.rtk_float_m * *epoch.hdop;
    case GnssQuality::differential:
      return config_.differential_m * *epoch.hdop;
    default:
      return config_.single_m * *epoch.hdop;
  }
}

bool GnssOutput::stale(hal::Time now, const FrameReader& reader, hal::Duration patience) {
  using namespace std::chrono_literals;
  health_.judge(now, reader, troubles_);
  const hal::Duration quiet = now - new_at_;
  if (quiet < hal::from_seconds(3.5 * period_s())) return false;
  flows_ = false;
  const bool speaks = reader.arrival() > new_at_ && now - reader.arrival() < quiet / 2;
  const bool frozen = speaks && troubles_.has(stream_fault::kRepeated);
  troubles_.set(frozen ? stream_fault::kFrozen : stream_fault::kSilent,
                std::to_string(quiet / 1ms) + " ms without a new epoch");
  return quiet >= patience;
}

}  // namespace drivers
