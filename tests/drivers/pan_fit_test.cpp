#include "drivers/pan_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace drivers {
namespace {

constexpr double kStep_rad = 46.2857 / 3600 * std::numbers::pi / 180;

hal::Time at(double t_s) {
  return hal::Time(hal::from_seconds(t_s));
}

// Positions in whole steps, read somewhere between asking and answering.
std::vector<PanSample> sweep(double rate_radps, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> span(0.005, 0.02), part(0.3, 0.7);
  std::vector<PanSample> samples;
  double t = 100;
  for (int i = 0; i < count; ++i, t += 0.03) {
    const double takes = span(random), read = t + takes * part(random);
    const double angle = std::round((0.3 + rate_radps * (read - 100)) / kStep_rad) * kStep_rad;
    samples.push_back({at(t), at(t + takes), angle});
  }
  return samples;
}

TEST(PanFit, FindsAngleAndRateToAFractionOfAStep) {
  for (const double rate : {0.0728, -0.0728, 0.436}) {
    const auto fit = fit_pan(sweep(rate, 150, 5), 0.02);
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->used, 150U);
    EXPECT_NEAR(fit->rate_radps, rate, 2e-4);
    EXPECT_LT(std::abs(fit->rate_radps - rate), 5 * fit->rate_sigma_radps);
    for (const double t : {100.0, 102.0, 104.4})  // A millisecond of the turn.
      EXPECT_NEAR(fit->angle_at(at(t)), 0.3 + rate * (t - 100),
                  std::abs(rate) * 0.001 + kStep_rad / 4);
    EXPECT_LE(fit->residual_rms_rad, fit->residual_max_rad);
  }
}

TEST(PanFit, ExactSamplesGiveTheExactLine) {
  std::vector<PanSample> samples;
  for (int i = 0; i < 10; ++i) samples.push_back({at(i), at(i + 0.5), 1 + 0.25 * (i + 0.25)});
  const auto fit = fit_pan(samples, 1e-9);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->rate_radps, 0.25, 1e-14);
  EXPECT_NEAR(fit->angle_at(at(0)), 1, 1e-13);
  EXPECT_NEAR(fit->residual_max_rad, 0, 1e-14);
}

TEST(PanFit, AnswersThatBelongElsewhereAreLeftOut) {
  auto samples = sweep(0.1, 50, 9);
  samples[10].angle_rad += 0.5;
  samples[49].angle_rad -= 0.3;
  const auto fit = fit_pan(samples, 0.01);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->used, 48U);
  EXPECT_NEAR(fit->rate_radps, 0.1, 1e-3);
}

TEST(PanFit, TooLittleIsNoFit) {
  EXPECT_FALSE(fit_pan({}, 1));
  EXPECT_FALSE(fit_pan({{at(0), at(1), 0}, {at(1), at(2), 1}}, 1));
  EXPECT_FALSE(fit_pan({{at(0), at(1), 0}, {at(0), at(1), 1}, {at(0), at(1), 2}}, 9));
}

TEST(PanFit, RampsAreLeftOut) {
  std::vector<PanSample> samples;
  for (double t = 0; t < 10; t += 0.1) {
    // Still for 2 s, speeds up over 1 s, constant until 7 s, slows down over 1 s, still.
    const double up = std::clamp(t - 2, 0.0, 1.0), down = std::clamp(t - 7, 0.0, 1.0);
    const double angle = up * up / 2 + std::clamp(t - 3, 0.0, 4.0) + down - down * down / 2;
    samples.push_back({at(t), at(t), angle});
  }
  const auto part = constant_part(samples, 1e-6, 1.2);
  ASSERT_GT(part.size(), 25U);
  const auto fit = fit_pan(part, 1e-6);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->rate_radps, 1, 1e-9);
  EXPECT_TRUE(constant_part({samples[0], samples[1]}, 1e-6, 0).empty());
  EXPECT_TRUE(constant_part({}, 1e-6, 0).empty());
}

}  // namespace
}  // namespace drivers
