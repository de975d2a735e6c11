#include "nav/rings.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <utility>

namespace nav {
namespace {

struct Box {
  std::int64_t x0, y0, x1, y1;
};

Box box_of(const SegmentMm& s) {
  const auto [x0, x1] = std::minmax(s.a.x, s.b.x);
  const auto [y0, y1] = std::minmax(s.a.y, s.b.y);
  return {x0, y0, x1, y1};
}

// Strictly between the ends of an edge on whose line the point lies.
bool inside_edge(const SegmentMm& edge, PointMm point) {
  return dot(point - edge.a, edge.b - edge.a) > 0 && dot(point - edge.b, edge.a - edge.b) > 0;
}

PointMm crossing_point(const SegmentMm& s, const SegmentMm& t) {
  const PointMm d = s.b - s.a;
  const PointMm e = t.b - t.a;
  const long double share =
      static_cast<long double>(cross(t.a - s.a, e)) / static_cast<long double>(cross(d, e));
  return {s.a.x + std::llround(share * static_cast<long double>(d.x)),
          s.a.y + std::llround(share * static_cast<long double>(d.y))};
}

void add_contacts(const std::vector<SegmentMm>& edges, int i, int j, std::vector<Contact>& found) {
  const SegmentMm& s = edges[i];
  const SegmentMm& t = edges[j];
  const int ta = sign(side(s.a, s.b, t.a));
  const int tb = sign(side(s.a, s.b, t.b));
  if (ta * tb > 0) return;
  const int sa = sign(side(t.a, t.b, s.a));
  const int sb = sign(side(t.a, t.b, s.b));
  if (sa * sb > 0) return;
  const auto [first, second] = std::minmax(i, j);
  if (ta * tb < 0 && sa * sb < 0) {
    found.push_back({first, second, crossing_point(s, t), true});
    return;
  }
  const auto touch = [&, first, second](int at, const SegmentMm& edge, PointMm p) {
    if (at == 0 && inside_edge(edge, p)) found.push_back({first, second, p, false});
  };
  touch(ta, s, t.a);
  touch(tb, s, t.b);
  touch(sa, t, s.a);
  touch(sb, t, s.b);
}

// Calls visit(k, l), k < l, for each pair of boxes that overlap, once; the boxes are in the order
// of x0. Looks for them in bands of y: a pair counts in the lowest band that both reach.
template <class Visit>
void for_overlapping(const std::vector<Box>& boxes, Visit visit) {
  constexpr std::size_t kBoxesPerBand = 16, kBandsMax = 256;
  struct Entry {
    Box box;
    int index, lowest_band;
  };
  if (boxes.empty()) return;
  std::int64_t low = boxes.front().y0, high = boxes.front().y1;
  for (const Box& box : boxes) low = std::min(low, box.y0), high = std::max(high, box.y1);
  const std::size_t count = std::clamp<std::size_t>(boxes.size() / kBoxesPerBand, 1, kBandsMax);
  const std::int64_t height = (high - low) / static_cast<std::int64_t>(count) + 1;
  const auto band_of = [&](std::int64_t y) { return static_cast<int>((y - low) / height); };
  std::vector<std::vector<Entry>> bands(count);
  for (int k = 0; k < static_cast<int>(boxes.size()); ++k) {
    const Entry entry{boxes[k], k, band_of(boxes[k].y0)};
    const int highest_band = band_of(boxes[k].y1);
    for (int band = entry.lowest_band; band <= highest_band; ++band) bands[band].push_back(entry);
  }
  for (int band = 0; band < static_cast<int>(count); ++band) {
    const Entry* const end = bands[band].data() + bands[band].size();
    for (const Entry* mine = bands[band].data(); mine != end; ++mine)
      for (const Entry* other = mine + 1; other != end; ++other) {
        if (other->box.x0 > mine->box.x1) break;
        if (other->box.y0 > mine->box.y1 || other->box.y1 < mine->box.y0) continue;
        if (std::max(mine->lowest_band, other->lowest_band) == band)
          visit(mine->index, other->index);
      }
  }
}

// Contacts of which at least one edge is `of_these`; empty: of any. In the order of the edges'
// boxes from left to right.
std::vector<Contact> contacts_of(const std::vector<SegmentMm>& edges,
                                 const std::vector<bool>& of_these) {
  std::vector<std::pair<std::int64_t, int>> order;  // x0 of its box, and the edge.
  order.reserve(edges.size());
  for (int i = 0; i < static_cast<int>(edges.size()); ++i)
    if (edges[i].a != edges[i].b) order.emplace_back(std::min(edges[i].a.x, edges[i].b.x), i);
  std::sort(order.begin(), order.end());
  std::vector<Box> boxes;
  boxes.reserve(order.size());
  for (const auto& [_, i] : order) boxes.push_back(box_of(edges[i]));
  struct Pair {
    int k, l;
    std::size_t first, end;  // Of `found`.
  };
  std::vector<Pair> pairs;
  std::vector<Contact> found;
  for_overlapping(boxes, [&](int k, int l) {
    const int i = order[k].second, j = order[l].second;
    if (!of_these.empty() && !of_these[i] && !of_these[j]) return;
    const std::size_t first = found.size();
    add_contacts(edges, i, j, found);
    if (found.size() > first) pairs.push_back({k, l, first, found.size()});
  });
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& p, const Pair& q) { return std::pair(p.k, p.l) < std::pair(q.k, q.l); });
  std::vector<Contact> sorted;
  sorted.reserve(found.size());
  for (const Pair& pair : pairs)
    sorted.insert(sorted.end(), found.begin() + static_cast<std::ptrdiff_t>(pair.first),
                  found.begin() + static_cast<std::ptrdiff_t>(pair.end));
  return sorted;
}

// A directed edge of one of the two ring sets; after merging, of the arrangement of both.
struct Edge {
  SegmentMm line;
  int net_a{};  // How often the rings of a run along it, less how often against it.
  int net_b{};
};

// Cuts every edge at its contacts; false when there was nothing to cut. A cut at a rounded crossing
// bends the edge by up to 0.71 mm, so it can cause further crossings: repeat until there are none.
// That ends, because every crossing cuts at least one of its edges into shorter ones.
//
// `bent`: the edges whose contacts with any other are not known to be none; empty: all of them.
bool cut_at_contacts(std::vector<Edge>& edges, std::vector<bool>& bent) {
  std::vector<SegmentMm> lines;
  lines.reserve(edges.size());
  for (const Edge& e : edges) lines.push_back(e.line);
  const std::vector<Contact> found = contacts_of(lines, bent);
  if (found.empty()) return false;
  std::vector<std::vector<PointMm>> cuts(edges.size());
  std::vector<bool> crossed(edges.size());
  for (const Contact& c : found) {
    cuts[c.first].push_back(c.point);
    cuts[c.second].push_back(c.point);
    if (c.crossing) crossed[c.first] = crossed[c.second] = true;
  }
  std::vector<Edge> pieces;
  bent.clear();
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto [a, b] = edges[i].line;
    std::sort(cuts[i].begin(), cuts[i].end(), [a, b](PointMm p, PointMm q) {
      return std::pair(dot(p - a, b - a), p) < std::pair(dot(q - a, b - a), q);
    });
    cuts[i].push_back(b);
    PointMm from = a;
    for (const PointMm to : cuts[i]) {
      if (to != from) {
        pieces.push_back({{from, to}, edges[i].net_a, edges[i].net_b});
        bent.push_back(crossed[i]);
      }
      from = to;
    }
  }
  edges = std::move(pieces);
  return true;
}

// The sweep goes up; among points of equal y the one farther right is higher (as if the plane were
// sheared by an infinitesimal amount), so that no edge is level.
bool lower(PointMm p, PointMm q) {
  return p.y != q.y ? p.y < q.y : p.x < q.x;
}

// Makes one upward edge of all that join the same two points; drops what cancels.
std::vector<Edge> merged(const std::vector<Edge>& edges) {
  std::map<SegmentMm, std::pair<int, int>> nets;
  for (const auto& [line, net_a, net_b] : edges) {
    const bool up = lower(line.a, line.b);
    auto& net = nets[up ? line : SegmentMm{line.b, line.a}];
    net.first += up ? net_a : -net_a;
    net.second += up ? net_b : -net_b;
  }
  std::vector<Edge> kept;
  for (const auto& [line, net] : nets) {
    if (net.first != 0 || net.second != 0) kept.push_back({line, net.first, net.second});
  }
  return kept;
}

// Keeps the edges with the inside on one side only, directed so that it is the left one. The
// winding left of an edge is what the edges left of its middle add up to.
std::vector<SegmentMm> borders(const std::vector<Edge>& edges, Inside inside) {
  std::vector<Edge> doubled = edges;  // So that middles are integers.
  for (Edge& e : doubled) e.line = {e.line.a + e.line.a, e.line.b + e.line.b};
  std::sort(doubled.begin(), doubled.end(),
            [](const Edge& e, const Edge& f) { return lower(e.line.a, f.line.a); });
  const auto middle = [](const Edge& e) {
    return PointMm{(e.line.a.x + e.line.b.x) / 2, (e.line.a.y + e.line.b.y) / 2};
  };
  std::vector<Edge> queries = doubled;
  std::sort(queries.begin(), queries.end(),
            [&](const Edge& e, const Edge& f) { return lower(middle(e), middle(f)); });
  std::vector<SegmentMm> kept;
  std::vector<Edge> crossing;  // Edges that the sweep line may meet.
  std::size_t next = 0;
  for (const Edge& query : queries) {
    const PointMm m = middle(query);
    for (; next < doubled.size() && !lower(m, doubled[next].line.a); ++next) {
      crossing.push_back(doubled[next]);
    }
    std::erase_if(crossing, [&](const Edge& e) { return !lower(m, e.line.b); });
    int left_a = 0;
    int left_b = 0;
    for (const Edge& e : crossing) {
      if (side(e.line.a, e.line.b, m) >= 0) continue;  // Right of the middle, or the edge itself.
      left_a -= e.net_a;
      left_b -= e.net_b;
    }
    const bool left = inside(left_a, left_b);
    const bool right = inside(left_a - query.net_a, left_b - query.net_b);
    if (left == right) continue;
    const PointMm a{query.line.a.x / 2, query.line.a.y / 2};
    const PointMm b{query.line.b.x / 2, query.line.b.y / 2};
    kept.push_back(left ? SegmentMm{a, b} : SegmentMm{b, a});
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

// 0 for a turn from `back` clockwise by (0, 180] degrees, 1 for more.
int half_turn(PointMm back, PointMm out) {
  const std::int64_t c = cross(back, out);
  return c < 0 || (c == 0 && dot(back, out) < 0) ? 0 : 1;
}

// Does a walker who came from `back` meet `p` before `q` when turning clockwise from there?
bool turns_earlier(PointMm back, PointMm p, PointMm q) {
  const int hp = half_turn(back, p);
  const int hq = half_turn(back, q);
  return hp != hq ? hp < hq : cross(p, q) < 0;
}

// Walks the borders of the inside and cuts off a ring whenever a vertex comes back. At a vertex
// with several ways on, the sharpest left turn stays on the border of the same inside face.
class Tracer {
 public:
  explicit Tracer(std::vector<SegmentMm> edges) : edges_(std::move(edges)), used_(edges_.size()) {}

  std::vector<Ring> rings() {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (!used_[i]) walk_from(i);
    }
    return std::move(rings_);
  }

 private:
  void walk_from(std::size_t first) {
    std::size_t edge = first;
    step_to(edges_[first].a);
    while (true) {
      used_[edge] = true;
      step_to(edges_[edge].b);
      if (path_.size() == 1) break;  // Back where the walk began.
      edge = next_after(edges_[edge]);
    }
    path_.clear();
    position_.clear();
  }

  void step_to(PointMm vertex) {
    const auto [seen, fresh] = position_.try_emplace(vertex, path_.size());
    if (fresh) {
      path_.push_back(vertex);
      return;
    }
    const auto begin = path_.begin() + static_cast<std::ptrdiff_t>(seen->second);
    rings_.emplace_back(begin, path_.end());
    for (auto it = begin + 1; it != path_.end(); ++it) position_.erase(*it);
    path_.erase(begin + 1, path_.end());
  }

  std::size_t next_after(const SegmentMm& edge) const {
    const PointMm back = edge.a - edge.b;
    std::size_t best = edges_.size();
    auto it = std::lower_bound(edges_.begin(), edges_.end(), edge.b,
                               [](const SegmentMm& e, PointMm p) { return e.a < p; });
    for (; it != edges_.end() && it->a == edge.b; ++it) {
      const auto i = static_cast<std::size_t>(it - edges_.begin());
      if (used_[i]) continue;
      if (best == edges_.size() ||
          turns_earlier(back, it->b - it->a, edges_[best].b - edges_[best].a)) {
        best = i;
      }
    }
    assert(best < edges_.size() && "as many edges leave a vertex as arrive");
    return best;
  }

  std::vector<SegmentMm> edges_;  // Sorted.
  std::vector<bool> used_;
  std::vector<Ring> rings_;
  Ring path_;
  std::map<PointMm, std::size_t> position_;  // Of every vertex of path_.
};

bool is_sliver(const Ring& ring) {
  double perimeter_mm = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const PointMm d = ring[(i + 1) % ring.size()] - ring[i];
    perimeter_mm += std::hypot(static_cast<double>(d.x), static_cast<double>(d.y));
  }
  return std::abs(static_cast<double>(twice_area_mm2(ring))) < kSliverWidthMm * perimeter_mm;
}

// The hole shares at most one vertex with the outer ring it lies in; with the ring of an island
// inside it, it may share every vertex.
bool lies_in(const Ring& hole, const Ring& outer) {
  for (const PointMm p : hole) {
    const int where = locate(outer, p);
    if (where != 0) return where > 0;
  }
  return false;
}

void drop_straight_vertices(std::vector<Ring>& rings) {
  std::map<PointMm, int> visits;
  for (const Ring& ring : rings) {
    for (const PointMm p : ring) ++visits[p];
  }
  for (Ring& ring : rings) {
    Ring kept;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const PointMm before = kept.empty() ? ring.back() : kept.back();
      const bool straight = side(before, ring[i], ring[(i + 1) % ring.size()]) == 0;
      if (!straight || visits[ring[i]] > 1) kept.push_back(ring[i]);
    }
    ring = std::move(kept);
  }
}

Polygon* polygon_around(const Ring& hole, Polygons& polygons) {
  Polygon* best = nullptr;
  for (Polygon& polygon : polygons) {
    if (best && twice_area_mm2(polygon.outer) >= twice_area_mm2(best->outer)) continue;
    if (lies_in(hole, polygon.outer)) best = &polygon;
  }
  return best;
}

Polygons assembled(std::vector<Ring> rings) {
  Polygons polygons;
  for (const Ring& ring : rings) {
    if (twice_area_mm2(ring) > 0) polygons.push_back({ring, {}});
  }
  for (Ring& ring : rings) {
    if (twice_area_mm2(ring) > 0) continue;
    // Without a polygon around it, the hole lies in a sliver that was dropped.
    if (Polygon* around = polygon_around(ring, polygons)) around->holes.push_back(std::move(ring));
  }
  return polygons;
}

void add_edges(const std::vector<Ring>& rings, int net_a, int net_b, std::vector<Edge>& edges) {
  for (const Ring& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const PointMm to = ring[(i + 1) % ring.size()];
      if (ring[i] != to) edges.push_back({{ring[i], to}, net_a, net_b});
    }
  }
}

}  // namespace

std::vector<Contact> contacts(const std::vector<SegmentMm>& edges) {
  return contacts_of(edges, {});
}

std::int64_t twice_area_mm2(const Ring& ring) {
  // Unsigned sums wrap around, so partial sums may overflow as long as the result (<= 2^60) fits.
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    sum += static_cast<std::uint64_t>(cross(ring[i], ring[(i + 1) % ring.size()]));
  }
  return static_cast<std::int64_t>(sum);
}

int locate(const Ring& ring, PointMm point) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const PointMm a = ring[j];
    const PointMm b = ring[i];
    if (std::max(a.y, b.y) < point.y || std::min(a.y, b.y) > point.y) continue;
    const std::int64_t s = side(a, b, point);
    if (s == 0 && dot(point - a, point - b) <= 0) return 0;
    if ((a.y > point.y) != (b.y > point.y) && (s > 0) == (b.y > a.y)) inside = !inside;
  }
  return inside ? 1 : -1;
}

Polygons overlay(const std::vector<Ring>& a, const std::vector<Ring>& b, Inside inside,
                 Straight straight) {
  std::vector<Edge> edges;
  add_edges(a, 1, 0, edges);
  add_edges(b, 0, 1, edges);
  std::vector<bool> bent;
  while (cut_at_contacts(edges, bent)) {
  }
  std::vector<Ring> rings = Tracer(borders(merged(edges), inside)).rings();
  std::erase_if(rings, is_sliver);
  if (straight == Straight::drop) drop_straight_vertices(rings);
  for (Ring& ring : rings) {
    std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
  }
  std::sort(rings.begin(), rings.end());
  return assembled(std::move(rings));
}

}  // namespace nav
