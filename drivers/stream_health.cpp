#include "drivers/stream_health.hpp"

#include <algorithm>
#include <cstdio>

namespace drivers {
namespace {

constexpr hal::Duration kWindow = std::chrono::seconds(1);
constexpr double kDamagedShare = 0.01;
constexpr double kSlowShare = 0.8;

std::string text(const char* format, double a, double b) {
  char line[96];
  const int size = std::snprintf(line, sizeof line, format, a, b);
  return {line, static_cast<std::size_t>(std::clamp(size, 0, 95))};
}

}  // namespace

void StreamHealth::restart(hal::Time now, const FrameReader& reader) {
  since_ = now;
  now_ = {};
  now_.bytes = reader.bytes();
  now_.damaged = reader.damaged_bytes();
}

void StreamHealth::good(double late_s) {
  ++now_.good;
  now_.latest_s = std::max(now_.latest_s, late_s);
}

void StreamHealth::judge(hal::Time now, const FrameReader& reader, Troubles& troubles) {
  namespace fault = stream_fault;
  // A slow stream needs a few of its periods.
  const hal::Duration window = std::max(kWindow, hal::from_seconds(5 * limits_.period_s));
  if (now - since_ < window) return;
  const double span_s = hal::seconds(now - since_);
  const auto bytes = static_cast<double>(reader.bytes() - now_.bytes);
  const auto damaged = static_cast<double>(reader.damaged_bytes() - now_.damaged);
  const double expected = span_s / limits_.period_s, came = static_cast<double>(now_.good);
  const auto found = [&](bool present, const Fault& what, const char* format, double a, double b) {
    troubles.set_if(present, what, present ? text(format, a, b) : std::string());
  };
  found(damaged > kDamagedShare * bytes, fault::kDamaged, "%.0f of %.0f bytes", damaged, bytes);
  found(now_.repeated > 0, fault::kRepeated, "%.0f in %.1f s", static_cast<double>(now_.repeated),
        span_s);
  found(now_.implausible > 0, fault::kImplausible, "%.0f in %.1f s",
        static_cast<double>(now_.implausible), span_s);
  found(now_.latest_s > limits_.late_s, fault::kLate, "by %.0f ms, %.0f are allowed",
        now_.latest_s * 1e3, limits_.late_s * 1e3);
  const bool slow =
      came > 0 && came + static_cast<double>(now_.implausible) < kSlowShare * expected;
  found(slow, fault::kSlow, "%.2f Hz, not %.2f", came / span_s, expected / span_s);
  restart(now, reader);
}

}  // namespace drivers
