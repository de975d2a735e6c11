// Registration of two scans of 70,000 points, made ready and brought together, beside plain
// point-to-point ICP on the same clouds, thinned alike; and the localizer's steps.
#include <benchmark/benchmark.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <list>
#include <numbers>

#include "nav/localizer.hpp"
#include "nav/registration/registration.hpp"
#include "tests/support/random_site.hpp"
#include "tests/support/whole_covariance.hpp"

namespace {

// A walled yard of 50 x 40 m as a scanner sees it, about 70,000 returns.
nav::Points yard_from(const Eigen::Vector2d& at_m, double heading_rad, std::uint64_t seed) {
  support::Dice dice(seed);
  nav::Points points;
  const double walls_x[] = {-25, 25}, walls_y[] = {-20, 20};
  for (int i = 0; i < 70000; ++i) {
    const double azimuth = dice.uniform(0, 2 * std::numbers::pi);
    const double elevation = dice.uniform(-0.5, 0.3);
    const Eigen::Vector2d way(std::cos(azimuth + heading_rad), std::sin(azimuth + heading_rad));
    double range_m = 1e9;
    for (const double x : walls_x)
      if ((x - at_m.x()) / way.x() > 0) range_m = std::min(range_m, (x - at_m.x()) / way.x());
    for (const double y : walls_y)
      if ((y - at_m.y()) / way.y() > 0) range_m = std::min(range_m, (y - at_m.y()) / way.y());
    if (elevation < 0) range_m = std::min(range_m, 1.5 / std::tan(-elevation));
    range_m += dice.gauss(0.01);
    points.emplace_back(static_cast<float>(range_m * std::cos(azimuth)),
                        static_cast<float>(range_m * std::sin(azimuth)),
                        static_cast<float>(range_m * std::tan(elevation)));
  }
  return points;
}

struct Pair {
  nav::Points reference = yard_from({-3, 2}, 0.1, 1), reading = yard_from({-2.5, 2.2}, 0.16, 2);
};

void registration_pair(benchmark::State& state) {
  const Pair pair;
  const nav::RegistrationConfig config;
  for (auto _ : state) {
    const nav::PreparedScan reference(pair.reference, config);
    const nav::PreparedScan reading(pair.reading, config, {}, nav::PreparedScan::Use::reading_only);
    const auto result =
        nav::register_scans(reference, reading, Eigen::Isometry3d::Identity(), config);
    if (result.verdict == nav::Verdict::refused) state.SkipWithError(result.reason.c_str());
    state.counters["steps"] = result.steps;
  }
}

// As PCL's IterativeClosestPoint: every point of the reading, its nearest in the reference, the
// best rigid motion by SVD, until the step is below 1e-4 m; at most so many rounds.
void registration_pair_point_to_point(benchmark::State& state) {
  const Pair pair;
  const double voxel_m = static_cast<double>(state.range(0)) / 100;
  const auto thin = [&](const nav::Points& points) {
    return voxel_m > 0 ? nav::thinned(points, voxel_m) : points;
  };
  int rounds = 0;
  for (auto _ : state) {
    const nav::NearestPoints reference(thin(pair.reference));
    const nav::Points reading = thin(pair.reading);
    Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
    double step_m = 1;
    for (rounds = 0; rounds < 100 && step_m > 1e-4; ++rounds) {
      nav::Points from, to;
      for (const auto& p : reading) {
        nav::Neighbour near;
        const Eigen::Vector3f at = pose * p;
        if (!reference.nearest(at, 2.F, near)) continue;
        from.push_back(at);
        to.push_back(reference.points_m()[near.index]);
      }
      const Eigen::Map<const Eigen::Matrix3Xf> A(from[0].data(), 3,
                                                 static_cast<Eigen::Index>(from.size()));
      const Eigen::Map<const Eigen::Matrix3Xf> B(to[0].data(), 3,
                                                 static_cast<Eigen::Index>(to.size()));
      const Eigen::Isometry3f move(Eigen::Matrix4f(Eigen::umeyama(A, B, false)));
      step_m = move.translation().norm();
      pose = move * pose;
    }
    benchmark::DoNotOptimize(pose);
  }
  state.counters["steps"] = rounds;
}
BENCHMARK(registration_pair)->Unit(benchmark::kMillisecond);
BENCHMARK(registration_pair_point_to_point)->Arg(0)->Arg(25)->Unit(benchmark::kMillisecond);

// One step of the localizer: a travel report, and a fix that comes 0.2 s late, beside a matrix
// product of the filter's size.
void localizer_step(benchmark::State& state) {
  nav::Localizer localizer({}, {}, Eigen::Matrix3d::Identity() * 0.01);
  const bool late_fix = state.range(0) != 0;
  double time_s = 0;
  for (auto _ : state) {
    time_s += 0.05;
    const auto at = [](double t) { return hal::Time{} + hal::from_seconds(t); };
    for (int k = 1; k <= 5; ++k)
      localizer.add(nav::InertialSample{at(time_s - 0.05 + 0.01 * k), {0, 0, 0.1}});
    localizer.add(hal::WheelTravel{at(time_s), 0.05, 0.05});
    if (late_fix)
      localizer.add(nav::GnssPosition{at(time_s - 0.2), localizer.pose().position_m,
                                      Eigen::Matrix2d::Identity()});
  }
}
void localizer_step_by_matrix_product(benchmark::State& state) {
  nav::ErrorMatrix F = nav::ErrorMatrix::Identity(), P = F;
  for (auto _ : state) {
    benchmark::DoNotOptimize(F.data());
    P = (F * P * F.transpose()).eval();
    benchmark::DoNotOptimize(P.data());
  }
}

// As robots tell it: a travel report, then the inertial sample of its stamp, which belongs before
// it; every tenth time a fix in between.
template <class Told>
void tell(Told& told, double& time_s, int& count) {
  time_s += 0.02;
  const hal::Time stamp = hal::Time{} + hal::from_seconds(time_s);
  told.travel({stamp, 0.02, 0.02});
  if (++count % 10 == 0)
    told.event(nav::GnssPosition{stamp, {0.02 * count, 0}, 4e-4 * Eigen::Matrix2d::Identity()});
  told.event(nav::InertialSample{stamp, {0, 0, 1e-4}});
}

struct ToldLocalizer {
  nav::Localizer localizer{{}, {}, Eigen::Matrix3d::Identity() * 0.01};
  void travel(const hal::WheelTravel& travel) { localizer.predict(travel); }
  void event(const nav::LocalizerEvent& event) { localizer.add(event); }
};

// Keeps the filter after every event.
struct ToldPlainHistory {
  struct Entry {
    nav::LocalizerEvent event;
    nav::LocalizerFilter after;
  };
  nav::LocalizerConfig config;
  std::list<Entry> history{
      {nav::InertialSample{}, {config, {}, Eigen::Matrix3d::Identity() * 0.01}}};
  nav::LocalizerFilter filter = history.front().after;

  void travel(const hal::WheelTravel& travel) { event(travel); }
  void event(const nav::LocalizerEvent& event) {
    auto at = history.end();
    while (nav::goes_before(event, std::prev(at)->event)) --at;
    filter = std::prev(at)->after;
    filter.apply(config, event);
    history.insert(at, {event, filter});
    for (; at != history.end(); ++at) {
      filter.apply(config, at->event);
      at->after = filter;
    }
    const hal::Time oldest =
        nav::stamp_of(history.back().event) - hal::from_seconds(config.history_s);
    while (nav::stamp_of(history.front().event) < oldest) history.pop_front();
  }
};

template <class Told>
void localizer_told_to(benchmark::State& state) {
  Told told;
  double time_s = 0;
  int count = 0;
  for (auto _ : state) tell(told, time_s, count);
}
void localizer_told(benchmark::State& state) {
  localizer_told_to<ToldLocalizer>(state);
}
void localizer_told_by_plain_history(benchmark::State& state) {
  localizer_told_to<ToldPlainHistory>(state);
}
BENCHMARK(localizer_told)->Unit(benchmark::kMicrosecond);
BENCHMARK(localizer_told_by_plain_history)->Unit(benchmark::kMicrosecond);

// The filter's arithmetic for a travel report and for a fix, beside products of whole matrices.
nav::Motion some_motion() {
  nav::Motion motion = nav::Motion::Constant(0.01);
  motion.bottomLeftCorner<3, 3>().setZero();
  motion.middleCols<2>(3).setZero();
  return motion;
}
void covariance_carry(benchmark::State& state) {
  nav::ErrorMatrix P = nav::ErrorMatrix::Identity();
  const nav::Motion motion = some_motion();
  for (auto _ : state) {
    P.setIdentity();
    nav::carry(P, motion, false);
    benchmark::DoNotOptimize(P.data());
    benchmark::ClobberMemory();
  }
}
void covariance_carry_by_whole_matrices(benchmark::State& state) {
  nav::ErrorMatrix P = nav::ErrorMatrix::Identity();
  const nav::Motion motion = some_motion();
  for (auto _ : state) {
    P.setIdentity();
    support::carry_whole(P, motion);
    benchmark::DoNotOptimize(P.data());
    benchmark::ClobberMemory();
  }
}
nav::Measurement<2> some_fix() {
  nav::Measurement<2> fix{nav::ErrorColumns<2>::Zero(), {0.01, 0.02}, Eigen::Matrix2d::Identity()};
  fix.Ht(0, 0) = fix.Ht(1, 1) = 1;
  fix.Ht(11, 0) = fix.Ht(12, 1) = 0.01;
  return fix;
}
void covariance_fix(benchmark::State& state) {
  nav::ErrorMatrix P = nav::ErrorMatrix::Identity();
  const auto fix = some_fix();
  for (auto _ : state) {
    const auto expected = nav::expected<2>(P, fix.Ht);
    benchmark::DoNotOptimize(nav::squared(fix, expected));
    benchmark::DoNotOptimize(nav::learn(P, fix, expected).error.data());
  }
}
void covariance_fix_by_whole_matrices(benchmark::State& state) {
  nav::ErrorMatrix P = nav::ErrorMatrix::Identity();
  const auto fix = some_fix();
  support::Whole whole{fix.Ht, fix.innovation, fix.R, {}, {}};
  for (auto _ : state) {
    benchmark::DoNotOptimize(whole.squared(P));
    benchmark::DoNotOptimize(whole.learn(P).data());
  }
}
BENCHMARK(covariance_carry);
BENCHMARK(covariance_carry_by_whole_matrices);
BENCHMARK(covariance_fix);
BENCHMARK(covariance_fix_by_whole_matrices);
BENCHMARK(localizer_step)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(localizer_step_by_matrix_product)->Unit(benchmark::kMicrosecond);

}  // namespace
