// Line of sight by CGAL's triangular expansion with its exact kernel, and by ours, in one run.
// Built by tools/bench, which fetches CGAL's headers; nothing else needs them.
#include <CGAL/Arr_segment_traits_2.h>
#include <CGAL/Arr_walk_along_line_point_location.h>
#include <CGAL/Arrangement_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Triangular_expansion_visibility_2.h>
#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <string>

#include "planning/visibility.hpp"
#include "tests/bench/visibility_sites.hpp"

namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Arrangement = CGAL::Arrangement_2<CGAL::Arr_segment_traits_2<Kernel>>;
using Expansion = CGAL::Triangular_expansion_visibility_2<Arrangement>;

constexpr planning::SensorLimits kLimits{
    .range_min_m = 1, .range_max_m = 100, .grazing_max_deg = 70, .fov_deg = 270};

Kernel::Point_2 point(nav::PointMm p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

// The same site for both, with everything made ready that does not depend on the viewpoint; for
// CGAL also the face in which each viewpoint lies.
struct Case {
  bench::VisibilitySite site;
  planning::Visibility ours;
  Arrangement arrangement;
  std::unique_ptr<Expansion> cgal;
  std::vector<Arrangement::Face_const_handle> faces;

  explicit Case(bench::VisibilitySite made) : site(std::move(made)), ours(site.walls, kLimits) {
    std::vector<Kernel::Segment_2> segments;
    for (const auto& wall : site.walls) segments.emplace_back(point(wall.a), point(wall.b));
    CGAL::insert_non_intersecting_curves(arrangement, segments.begin(), segments.end());
    cgal = std::make_unique<Expansion>(arrangement);
    const CGAL::Arr_walk_along_line_point_location<Arrangement> locate(arrangement);
    for (const auto& at : site.candidates) {
      const auto found = locate.locate(point(at.position));
      faces.push_back(*boost::get<Arrangement::Face_const_handle>(&found));
    }
  }

  Arrangement region(std::size_t i) const {
    Arrangement seen;
    cgal->compute_visibility(point(site.candidates[i].position), faces[i], seen);
    return seen;
  }
};

// Of the region's border that is wall: what does not lie in line with the viewpoint.
double wall_length_m(const Arrangement& region, const Kernel::Point_2& from) {
  double sum_m = 0;
  for (auto e = region.edges_begin(); e != region.edges_end(); ++e) {
    const auto& a = e->source()->point();
    const auto& b = e->target()->point();
    if (!CGAL::collinear(from, a, b))
      sum_m += std::sqrt(CGAL::to_double(CGAL::squared_distance(a, b))) / 1000;
  }
  return sum_m;
}

// Viewpoints from which the two see wall of different length.
int differences(const Case& c) {
  int different = 0;
  for (std::size_t i = 0; i < c.site.candidates.size(); ++i) {
    double ours_m = 0;
    for (const auto& piece : c.ours.in_sight(c.site.candidates[i].position))
      ours_m += piece.to_m - piece.from_m;
    const double cgal_m = wall_length_m(c.region(i), point(c.site.candidates[i].position));
    if (std::abs(ours_m - cgal_m) > 1e-6) ++different;
  }
  return different;
}

// Obstacles and metres between them: about 1,000 and 10,000 edges as dense as a campus, and 10,000
// edges of which a third lie in range.
const Case& site_case(int obstacles, int pitch_m) {
  static std::map<std::pair<int, int>, std::unique_ptr<Case>> made;
  auto& slot = made[{obstacles, pitch_m}];
  if (!slot) slot = std::make_unique<Case>(bench::visibility_site(obstacles, pitch_m));
  return *slot;
}

template <class Look>
void look_round(benchmark::State& state, const Look& look) {
  const Case& c = site_case(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(look(c, i));
    i = (i + 1) % c.site.candidates.size();
  }
  state.counters["edges"] = static_cast<double>(c.site.walls.size());
}

// Clipped by range, grazing angle and field of view; CGAL does none of that.
void view(benchmark::State& state) {
  look_round(state, [](const Case& c, std::size_t i) { return c.ours.from(c.site.candidates[i]); });
}
void sight(benchmark::State& state) {
  look_round(state, [](const Case& c, std::size_t i) {
    return c.ours.in_sight(c.site.candidates[i].position);
  });
}
void by_cgal(benchmark::State& state) {
  look_round(state, [](const Case& c, std::size_t i) { return c.region(i).number_of_edges(); });
  static std::map<const Case*, int> known;
  const Case& c = site_case(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  if (!known.contains(&c)) known[&c] = differences(c);
  state.counters["differ"] = known[&c];
}

void sizes(benchmark::internal::Benchmark* b) {
  b->Args({170, 30})->Args({1770, 30})->Args({1770, 8})->Unit(benchmark::kMicrosecond);
}
BENCHMARK(view)->Apply(sizes);
BENCHMARK(by_cgal)->Name("view_by_cgal")->Apply(sizes);
BENCHMARK(sight)->Apply(sizes);
BENCHMARK(by_cgal)->Name("sight_by_cgal")->Apply(sizes);

}  // namespace
