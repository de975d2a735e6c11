// Random viewpoints, uniform over the ground the scanner can stand on.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "nav/polygons.hpp"
#include "planning/cover.hpp"

namespace planning {
namespace {

using nav::PointMm;
using nav::SegmentMm;

// The ground between two edges and two levels that no edge ends between.
struct Trapezoid {
  SegmentMm left, right;
  double y0, y1;
};

double x_at(const SegmentMm& edge, double y) {
  const double share =
      (y - static_cast<double>(edge.a.y)) / static_cast<double>(edge.b.y - edge.a.y);
  return static_cast<double>(edge.a.x) + share * static_cast<double>(edge.b.x - edge.a.x);
}

double width_at(const Trapezoid& t, double y) {
  return std::max(0.0, x_at(t.right, y) - x_at(t.left, y));
}

double area_of(const Trapezoid& t) {
  return (width_at(t, t.y0) + width_at(t, t.y1)) / 2 * (t.y1 - t.y0);
}

// Cuts the polygons at the level of every vertex: between two levels, edges in order of x enclose
// the ground pair by pair.
std::vector<Trapezoid> trapezoids_of(const nav::Polygons& polygons) {
  std::vector<SegmentMm> edges = nav::edges(polygons);
  std::erase_if(edges, [](const SegmentMm& e) { return e.a.y == e.b.y; });
  std::vector<std::int64_t> levels;
  for (SegmentMm& e : edges) {
    if (e.b.y < e.a.y) std::swap(e.a, e.b);
    levels.insert(levels.end(), {e.a.y, e.b.y});
  }
  std::ranges::sort(levels);
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  std::vector<Trapezoid> trapezoids;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i) {
    std::vector<SegmentMm> across;
    for (const SegmentMm& e : edges)
      if (e.a.y <= levels[i] && e.b.y >= levels[i + 1]) across.push_back(e);
    const auto y0 = static_cast<double>(levels[i]), y1 = static_cast<double>(levels[i + 1]);
    std::ranges::sort(across, [&](const SegmentMm& e, const SegmentMm& f) {
      return std::pair(x_at(e, (y0 + y1) / 2), e) < std::pair(x_at(f, (y0 + y1) / 2), f);
    });
    for (std::size_t k = 0; k + 1 < across.size(); k += 2)
      trapezoids.push_back({across[k], across[k + 1], y0, y1});
  }
  return trapezoids;
}

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double below(double limit) { return limit * (static_cast<double>(engine_() >> 11) * 0x1.0p-53); }

 private:
  std::mt19937_64 engine_;
};

// The level below which the share `of_area` of the trapezoid lies: the width grows evenly with it.
double level_at(const Trapezoid& t, double of_area) {
  const double w0 = width_at(t, t.y0), w1 = width_at(t, t.y1);
  const double w = std::sqrt(w0 * w0 + of_area * (w1 * w1 - w0 * w0));
  const double share = w0 + w > 0 ? of_area * (w0 + w1) / (w0 + w) : of_area;
  return t.y0 + std::clamp(share, 0.0, 1.0) * (t.y1 - t.y0);
}

}  // namespace

std::vector<Candidate> draw_candidates(const nav::FreeArea& area, int count, double fov_deg,
                                       std::uint64_t seed) {
  const std::vector<Trapezoid> trapezoids = trapezoids_of(area.standable);
  std::vector<double> area_to;  // Of the trapezoids up to and with each.
  double sum = 0;
  for (const Trapezoid& t : trapezoids) area_to.push_back(sum += area_of(t));
  std::vector<Candidate> candidates;
  if (sum <= 0) return candidates;
  Dice dice(seed);
  constexpr int kTriesEach = 20;  // Rounding to the grid may step outside.
  for (int tries = 0; tries < kTriesEach * count; ++tries) {
    if (static_cast<int>(candidates.size()) >= count) break;
    const auto at = std::upper_bound(area_to.begin(), area_to.end() - 1, dice.below(sum));
    const Trapezoid& t = trapezoids[static_cast<std::size_t>(at - area_to.begin())];
    const double y = level_at(t, dice.below(1));
    const double x = x_at(t.left, y) + dice.below(width_at(t, y));
    const double heading = fov_deg < 360 ? dice.below(2 * std::numbers::pi) - std::numbers::pi : 0;
    const PointMm position{std::llround(x), std::llround(y)};
    if (nav::contains(area.standable, position)) candidates.push_back({position, heading});
  }
  return candidates;
}

}  // namespace planning
