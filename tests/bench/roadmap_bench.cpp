// Roadmap: building it and finding routes, on made-up sites of about 1,000 and 10,000 edges. In the
// same run the paper's way of building (points on the outlines) and Dijkstra's search.
#include <benchmark/benchmark.h>

#include <boost/polygon/voronoi.hpp>

#include "nav/medial_axis.hpp"
#include "nav/polygons.hpp"
#include "nav/roadmap.hpp"
#include "tests/support/random_site.hpp"

namespace {

constexpr double kRadiusM = 0.5;
constexpr int kSmall = 150, kLarge = 1400;  // Obstacles; 100 come to about 720 edges.

struct RoadSite {
  double side_m;
  nav::FreeArea area;
};

const RoadSite& site(int obstacles) {
  static const auto make = [](int count) {
    support::Dice dice(1);
    const double side_m = 300 * std::sqrt(count / 150.0);
    const support::SiteSize size{side_m, count, 10, 12};
    return RoadSite{side_m, support::random_area(dice, size, kRadiusM)};
  };
  static const RoadSite small = make(kSmall);
  static const RoadSite large = make(kLarge);
  return obstacles == kSmall ? small : large;
}

void count_edges(benchmark::State& state, const RoadSite& s) {
  state.counters["edges"] = static_cast<double>(nav::edges(s.area.drivable).size());
}

std::vector<Eigen::Vector2d> stations(const RoadSite& s, int count) {
  support::Dice dice(2);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i)
    points.push_back(support::random_point(dice, s.area.standable, s.side_m));
  return points;
}

void roadmap_build(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(nav::Roadmap::build(s.area, kRadiusM));
  count_edges(state, s);
}
BENCHMARK(roadmap_build)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMillisecond);

// The paper's way: a point every 0.1 m on the outlines and the diagram of the points. Only the
// diagram is timed; dropping what lies in obstacles or is too narrow would come on top.
void roadmap_build_by_points(benchmark::State& state) {
  constexpr double kStepM = 0.1;
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  std::vector<boost::polygon::point_data<std::int32_t>> points;
  for (const nav::SegmentMm& e : nav::edges(s.area.drivable)) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(nav::length_m(e.a, e.b) / kStepM)));
    for (int k = 0; k < pieces; ++k) {
      const nav::PointMm p =
          nav::to_mm(nav::to_m(e.a) + (nav::to_m(e.b) - nav::to_m(e.a)) * k / pieces);
      points.emplace_back(static_cast<std::int32_t>(p.x), static_cast<std::int32_t>(p.y));
    }
  }
  for (auto _ : state) {
    boost::polygon::voronoi_diagram<double> diagram;
    boost::polygon::construct_voronoi(points.begin(), points.end(), &diagram);
    benchmark::DoNotOptimize(diagram);
  }
  count_edges(state, s);
  state.counters["points"] = static_cast<double>(points.size());
}
BENCHMARK(roadmap_build_by_points)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMillisecond);

void medial_axis(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(nav::medial_axis(s.area.drivable, {}));
  count_edges(state, s);
}
BENCHMARK(medial_axis)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMillisecond);

void noding(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  const auto outline = nav::edges(s.area.drivable);
  for (auto _ : state) benchmark::DoNotOptimize(nav::node_outlines(outline));
  count_edges(state, s);
}
BENCHMARK(noding)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMillisecond);

// From node to node along the roads, the same pairs for both searches.
void search_roads(benchmark::State& state, nav::Roadmap::Search search) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  const nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
  const int nodes = static_cast<int>(roadmap.graph().nodes_m.size());
  support::Dice dice(4);
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < 100; ++i) pairs.emplace_back(dice.below(nodes), dice.below(nodes));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(roadmap.along_roads(pairs[i].first, pairs[i].second, search));
    i = (i + 1) % pairs.size();
  }
  double searched = 0, length_m = 0;
  for (const auto& [from, to] : pairs) {
    const auto found = roadmap.along_roads(from, to, search);
    searched += found.nodes_searched;
    if (std::isfinite(found.length_m)) length_m += found.length_m;
  }
  state.counters["nodes_searched"] = searched / static_cast<double>(pairs.size());
  state.counters["length_m"] = length_m / static_cast<double>(pairs.size());
}
void along_roads(benchmark::State& state) {
  search_roads(state, nav::Roadmap::Search::a_star);
}
void along_roads_by_dijkstra(benchmark::State& state) {
  search_roads(state, nav::Roadmap::Search::dijkstra);
}
BENCHMARK(along_roads)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMicrosecond);
BENCHMARK(along_roads_by_dijkstra)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMicrosecond);

void route(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
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
BENCHMARK(route)->ArgsProduct({{kSmall, kLarge}, {0, 1}})->Unit(benchmark::kMillisecond);

void all_pairs_of_26(benchmark::State& state) {
  const RoadSite& s = site(kSmall);
  const auto smoothing = state.range(0) == 0 ? nav::Smoothing::none : nav::Smoothing::shortcut;
  const nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
  const auto points = stations(s, 26);
  for (auto _ : state) benchmark::DoNotOptimize(roadmap.lengths_m(points, smoothing));
}
BENCHMARK(all_pairs_of_26)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// An obstacle found underway closes roads; the reference makes the roadmap anew.
void block(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
  const auto points = stations(s, 1000);
  std::size_t i = 0;
  for (auto _ : state) {
    if (i == points.size()) {
      state.PauseTiming();
      roadmap.unblock_all();
      i = 0;
      state.ResumeTiming();
    }
    roadmap.block_cell(points[i], points[i] + Eigen::Vector2d(1, 1));
    ++i;
  }
}
void block_by_rebuilding(benchmark::State& state) {
  const RoadSite& s = site(static_cast<int>(state.range(0)));
  const auto points = stations(s, 1000);
  std::size_t i = 0;
  for (auto _ : state) {
    nav::Roadmap roadmap = nav::Roadmap::build(s.area, kRadiusM);
    roadmap.block_cell(points[i], points[i] + Eigen::Vector2d(1, 1));
    benchmark::DoNotOptimize(roadmap);
    i = (i + 1) % points.size();
  }
}
BENCHMARK(block)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMicrosecond);
BENCHMARK(block_by_rebuilding)->Arg(kSmall)->Arg(kLarge)->Unit(benchmark::kMicrosecond);

}  // namespace
