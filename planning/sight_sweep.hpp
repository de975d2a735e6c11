// The angular sweep: which of many walls is nearest in every direction.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

#include "nav/geometry.hpp"
#include "planning/sight.hpp"

namespace planning {

// A wall as seen from the viewpoint, which is the origin: from p counter-clockwise to q, less than
// 180 deg and more than 0.
struct SightEdge {
  nav::PointMm p, q;
  int wall{};
  bool imaged{};  // A target, and its free side faces the viewpoint; then q is the wall's end a.

  // Where the ray in a direction between p and q meets the wall; for imaged edges.
  Share share_at(nav::PointMm direction) const {
    return {nav::cross(direction, q), nav::cross(p - q, direction)};
  }
};

// Directions from the viewpoint in order of their angle, [0, 360) deg from +x.
inline int half_plane(nav::PointMm d) {
  return d.y > 0 || (d.y == 0 && d.x > 0) ? 0 : 1;
}
inline bool angle_less(nav::PointMm d, nav::PointMm e) {
  const int hd = half_plane(d), he = half_plane(e);
  return hd != he ? hd < he : nav::cross(d, e) > 0;
}

// The walls that the sweep ray meets, nearest first. No two may cross or overlap.
class NearestFirst {
 public:
  explicit NearestFirst(const std::vector<SightEdge>& edges) : edges_(edges) {}

  int nearest() const { return order_.empty() ? -1 : order_.front(); }
  // The ray is at the edge's p, and at or past the p of all others here, before their q.
  void insert(int edge) {
    const SightEdge& e = edges_[static_cast<std::size_t>(edge)];
    const auto at = std::partition_point(order_.begin(), order_.end(), [&](int other) {
      return !starts_before(e, edges_[static_cast<std::size_t>(other)]);
    });
    order_.insert(at, edge);
  }
  void erase(int edge) { order_.erase(std::find(order_.begin(), order_.end(), edge)); }

 private:
  // Whether e is nearer than the other just past its p. (The viewpoint is left of p -> q.)
  static bool starts_before(const SightEdge& e, const SightEdge& other) {
    const std::int64_t at_p = nav::side(other.p, other.q, e.p);
    return at_p != 0 ? at_p > 0 : nav::side(other.p, other.q, e.q) > 0;
  }

  const std::vector<SightEdge>& edges_;
  std::vector<int> order_;
};

struct SightEvent {
  double key{};  // Grows with the angle but for rounding.
  nav::PointMm direction;
  int edge{};
  bool start{};
};

// In [0, 4]: a quarter of the way round is 1.
inline double angle_key(double x, double y) {
  const double share = x / (std::abs(x) + std::abs(y));
  return y > 0 || (y == 0 && x > 0) ? 1 - share : 3 + share;
}
inline double angle_key(nav::PointMm d) {
  return angle_key(static_cast<double>(d.x), static_cast<double>(d.y));
}

// Both ends of every edge, by angle; exact.
inline std::vector<SightEvent> sight_events(const std::vector<SightEdge>& edges) {
  std::vector<SightEvent> events;
  events.reserve(2 * edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    events.push_back({angle_key(edges[i].p), edges[i].p, static_cast<int>(i), true});
    events.push_back({angle_key(edges[i].q), edges[i].q, static_cast<int>(i), false});
  }
  std::ranges::sort(events, {}, &SightEvent::key);
  // Rounding leaves neighbours the wrong way round at most; this puts any order right.
  for (std::size_t i = 1; i < events.size(); ++i)
    for (std::size_t k = i; k > 0 && angle_less(events[k].direction, events[k - 1].direction); --k)
      std::swap(events[k], events[k - 1]);
  return events;
}

// Calls see(edge, begin, end) for every direction range [begin, end] (counter-clockwise, not empty)
// in which the edge is the nearest; ranges of one edge do not touch. No two edges may cross or
// overlap; they may share ends and touch.
template <class See>
void sweep(const std::vector<SightEdge>& edges, const See& see) {
  const std::vector<SightEvent> events = sight_events(edges);
  NearestFirst active(edges);
  for (const SightEvent& e : events) {  // What the ray meets just before it sets out from +x.
    const SightEdge& edge = edges[static_cast<std::size_t>(e.edge)];
    if (e.start && angle_less(edge.q, edge.p)) active.insert(e.edge);
  }
  const auto report = [&](int edge, nav::PointMm begin, nav::PointMm end) {
    if (edge >= 0) see(edges[static_cast<std::size_t>(edge)], begin, end);
  };
  const int at_start = active.nearest();
  int nearest = at_start;
  const nav::PointMm* since = nullptr;        // Null until the nearest changes for the first time:
  const nav::PointMm* start_until = nullptr;  // what is nearest at +x was so before already.
  for (std::size_t i = 0; i < events.size();) {
    const nav::PointMm& here = events[i].direction;
    std::size_t end = i;
    while (end < events.size() && !angle_less(here, events[end].direction)) ++end;
    for (std::size_t k = i; k < end; ++k)
      if (!events[k].start) active.erase(events[k].edge);
    for (std::size_t k = i; k < end; ++k)
      if (events[k].start) active.insert(events[k].edge);
    i = end;
    if (active.nearest() == nearest) continue;
    if (since) {
      report(nearest, *since, here);
    } else {
      start_until = &here;
    }
    since = &here;
    nearest = active.nearest();
  }
  if (since) report(at_start, *since, *start_until);
}

}  // namespace planning
