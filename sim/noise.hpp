// Randomness that repeats everywhere: numbers depend on the seed alone, never on a library's own
// distributions, on threads or on what other sources drew.
#pragma once

#include <boost/random/normal_distribution.hpp>
#include <cstdint>
#include <random>

namespace sim {

// A well mixed 64-bit function of its argument (the output step of splitmix64, Steele et al. 2014).
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

// The value below which a standard normal variable falls with this probability, 0 < p < 1 (P. J.
// Acklam's rational approximation, relative error below 1.2e-9).
double normal_quantile(double probability);

// One source of noise; `source` keeps streams of the same seed apart.
class NoiseStream {
 public:
  NoiseStream(std::uint64_t seed, std::uint64_t source) : engine_(mix(mix(seed) ^ source)) {}

  double normal(double sigma) { return sigma * normal_(engine_); }

 private:
  std::mt19937_64 engine_;
  boost::random::normal_distribution<double> normal_;
};

// A first-order Gauss-Markov process: a value that wanders with the given 1-sigma and forgets
// itself over `length` (seconds, metres). Exact for any step; over d >> length its integral has the
// variance 2 sigma^2 length d.
class WanderingNoise {
 public:
  WanderingNoise(std::uint64_t seed, std::uint64_t source, double sigma, double length);

  double value() const { return value_; }
  double step(double by);  // The value after `by`.

 private:
  NoiseStream stream_;
  double sigma_;
  double length_;
  double value_;
};

}  // namespace sim
