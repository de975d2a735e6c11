#include "drivers/pan_fit.hpp"

#include <algorithm>
#include <cmath>

namespace drivers {
namespace {

hal::Time middle(const PanSample& sample) {
  return sample.asked + (sample.answered - sample.asked) / 2;
}

std::optional<PanFit> fit_line(const std::vector<PanSample>& samples) {
  if (samples.size() < 3) return std::nullopt;
  PanFit fit;
  fit.origin = middle(samples[samples.size() / 2]);
  fit.used = samples.size();
  const auto count = static_cast<double>(samples.size());
  double t_mean = 0, angle_mean = 0;
  for (const PanSample& sample : samples) {
    t_mean += hal::seconds(middle(sample) - fit.origin) / count;
    angle_mean += sample.angle_rad / count;
  }
  double tt = 0, ta = 0;
  for (const PanSample& sample : samples) {
    const double t = hal::seconds(middle(sample) - fit.origin) - t_mean;
    tt += t * t;
    ta += t * (sample.angle_rad - angle_mean);
  }
  if (!(tt > 0)) return std::nullopt;
  fit.rate_radps = ta / tt;
  fit.angle_rad = angle_mean - fit.rate_radps * t_mean;
  double squares = 0;
  for (const PanSample& sample : samples) {
    const double residual = sample.angle_rad - fit.angle_at(middle(sample));
    squares += residual * residual;
    fit.residual_max_rad = std::max(fit.residual_max_rad, std::abs(residual));
  }
  fit.residual_rms_rad = std::sqrt(squares / count);
  fit.rate_sigma_radps = std::sqrt(squares / (count - 2) / tt);
  return fit;
}

}  // namespace

std::optional<PanFit> fit_pan(const std::vector<PanSample>& samples, double outlier_rad) {
  std::vector<PanSample> kept = samples;
  auto fit = fit_line(kept);
  // The worst one first: it pulls the line with it.
  for (std::size_t left = samples.size() / 5; fit && left > 0; --left) {
    if (fit->residual_max_rad <= outlier_rad) break;
    const auto worst =
        std::max_element(kept.begin(), kept.end(), [&](const auto& a, const auto& b) {
          return std::abs(a.angle_rad - fit->angle_at(middle(a))) <
                 std::abs(b.angle_rad - fit->angle_at(middle(b)));
        });
    kept.erase(worst);
    fit = fit_line(kept);
  }
  return fit;
}

std::vector<PanSample> constant_part(const std::vector<PanSample>& samples, double still_rad,
                                     double ramp_s) {
  const auto moved = [&](const PanSample& a, const PanSample& b) {
    return std::abs(a.angle_rad - b.angle_rad) > still_rad;
  };
  if (samples.empty()) return {};
  const auto first = std::find_if(samples.begin(), samples.end(),
                                  [&](const auto& s) { return moved(s, samples.front()); });
  const auto last = std::find_if(samples.rbegin(), samples.rend(),
                                 [&](const auto& s) { return moved(s, samples.back()); });
  if (first == samples.end() || last == samples.rend()) return {};
  const hal::Time begin = middle(*first) + hal::from_seconds(ramp_s);
  const hal::Time end = middle(*last) - hal::from_seconds(ramp_s);
  std::vector<PanSample> part;
  for (const PanSample& sample : samples)
    if (middle(sample) >= begin && middle(sample) <= end) part.push_back(sample);
  return part;
}

}  // namespace drivers
