// Roadmap: building it and finding routes, on made-up sites of about 1,000 and 10,000 edges.
#include <benchmark/benchmark.h>

#include "nav/medial_axis.hpp"
#include "nav/polygons.hpp"
#include "nav/roadmap.hpp"
#include "tests/support/random_site.hpp"

namespace {

constexpr double kRadiusM = 0.5;

struct Site {
  double side_m;
  nav::FreeArea area;
};

// 100 obstacles come to about 700 edges.
const Site& site(int obstacles) {
  static const auto make = [](int count) {
    support::Dice dice(1);
    const double side_m = 300 * std::sqrt(count / 150.0);
    const support::SiteSize size{side_m, count, 10, 12};
    return Site{side_m, support::random_area(dice, size, kRadiusM)};
  };
  static const Site small = make(150);
  static const Site large = make(1700);
  return obstacles == 150 ? small : large;
}

void count_edges(benchmark::State& state, const Site& s) {
  state.counters["edges"] = static_cast<double>(nav::edges(s.area.drivable).size());
}

std::vector<Eigen::Vector2d> stations(const Site& s, int count) {
  support::Dice dice(2);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i)
    points.push_back(support::random_point(dice, s.area.standable, s.side_m));
  return points;
}

void BM_RoadmapBuild(benchmark::State& state) {
  const Site& s = site(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(nav::Roadmap::build(s.area, kRadiusM));
  count_edges(state, s);
  state.counters["roads"] =
      static_cast<double>(nav::Roadmap::build(s.area, kRadiusM).polylines().size());
}
BENCHMARK(BM_RoadmapBuild)->Arg(150)->Arg(1700)->Unit(benchmark::kMillisecond);

void BM_MedialAxis(benchmark::State& state) {
  const Site& s = site(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(nav::medial_axis(s.area.drivable, {}));
  count_edges(state, s);
}
BENCHMARK(BM_MedialAxis)->Arg(150)->Arg(1700)->Unit(benchmark::kMillisecond);

void BM_Noding(benchmark::State& state) {
  const Site& s = site(static_cast<int>(state.range(0)));
  const auto outline = nav::edges(s.area.drivable);
  for (auto _ : state) benchmark::DoNotOptimize(nav::node_outlines(outline));
  count_edges(state, s);
}
BENCHMARK(BM_Noding)->Arg(150)->Arg(1700)->Unit(benchmark::kMillisecond);

void BM_Route(benchmark::State& state) {
  const Site& s = site(static_cast<int>(state.range(0)));
  const auto smoothing = state.range(1) == 0 ? nav::Smoothing::none : nav::Smoothing::shortcut;
  const nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
  const auto points = stations(s, 20);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        roadmap.route(points[i % 20], points[(i * 7 + 3) % 20], nullptr, smoothing));
    ++i;
  }
}
BENCHMARK(BM_Route)->ArgsProduct({{150, 1700}, {0, 1}})->Unit(benchmark::kMillisecond);

void BM_AllPairsOf26(benchmark::State& state) {
  const Site& s = site(150);
  const auto smoothing = state.range(0) == 0 ? nav::Smoothing::none : nav::Smoothing::shortcut;
  const nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
  const auto points = stations(s, 26);
  for (auto _ : state) benchmark::DoNotOptimize(roadmap.lengths_m(points, smoothing));
}
BENCHMARK(BM_AllPairsOf26)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void BM_BlockAThousandCells(benchmark::State& state) {
  const Site& s = site(150);
  const nav::Roadmap clean = nav::Roadmap::build(s.area, kRadiusM);
  const auto points = stations(s, 1000);
  for (auto _ : state) {
    nav::Roadmap roadmap = clean;
    for (const auto& p : points) roadmap.block_cell(p, p + Eigen::Vector2d(1, 1));
    benchmark::DoNotOptimize(roadmap);
  }
}
BENCHMARK(BM_BlockAThousandCells)->Unit(benchmark::kMillisecond);

}  // namespace
