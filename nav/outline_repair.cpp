#include "nav/outline_repair.hpp"

#include <algorithm>
#include <set>

#include "nav/polygons.hpp"
#include "nav/rings.hpp"
#include "nav/site_map.hpp"
#include "nav/words.hpp"

namespace nav {
namespace {

using Metres = std::vector<Eigen::Vector2d>;

// One ring as it is repaired, step by step.
struct RingRepair {
  Ring ring;
  Polygons area;
  std::vector<std::string> repairs;
  std::string reversal;
  std::string error;
};

void close(const Metres& ring_m, RingRepair& repair) {
  Ring& ring = repair.ring;
  for (const Eigen::Vector2d& p : ring_m) ring.push_back(to_mm(p));
  if (ring.size() < 2) return;
  const double gap_m = length_m(ring.front(), ring.back());
  if (gap_m > 0) {
    repair.repairs.push_back("was left open by " + in_m(gap_m) + "; closed");
  } else {
    ring.pop_back();
  }
}

void drop_repeated(RingRepair& repair) {
  Ring& ring = repair.ring;
  const std::size_t before = ring.size();
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  const int dropped = static_cast<int>(before - ring.size());
  if (dropped > 0) {
    repair.repairs.push_back("has " + counted(dropped, "repeated vertex", "repeated vertices") +
                             "; dropped");
  }
}

bool is_spike(PointMm before, PointMm tip, PointMm after) {
  return side(before, tip, after) == 0 && dot(before - tip, after - tip) > 0;
}

// Cuts off tips where the ring runs back on itself; cutting one can lay bare another.
void cut_spikes(RingRepair& repair) {
  Ring& ring = repair.ring;
  PointMm last_tip;
  int cut = 0;
  std::size_t i = 0;
  for (std::size_t unchanged = 0; ring.size() >= 3 && unchanged < ring.size();) {
    const std::size_t n = ring.size();
    i %= n;
    const PointMm before = ring[(i + n - 1) % n];
    const PointMm here = ring[i];
    const bool spike = is_spike(before, here, ring[(i + 1) % n]);
    if (!spike && before != here) {
      ++i;
      ++unchanged;
      continue;
    }
    if (spike) last_tip = here;
    cut += spike ? 1 : 0;
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
    i += n - 2;  // The vertex before, now of a ring of n - 1.
    unchanged = 0;
  }
  if (cut == 0) return;
  repair.repairs.push_back("has " + counted(cut, "zero-width spike", "zero-width spikes") +
                           (cut == 1 ? " at " : ", the last at ") + in_words(last_tip) +
                           "; cut off");
}

std::vector<Contact> self_contacts(const Ring& ring) {
  std::vector<SegmentMm> sides;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    sides.push_back({ring[i], ring[(i + 1) % ring.size()]});
  }
  return contacts(sides);
}

// Whether the ring encloses what it seems to, however it touches or crosses itself.
void check_crossings(RingRepair& repair, const std::vector<Contact>& found) {
  const double filled_m2 = area_m2(repair.area);
  const double signed_m2 = std::abs(static_cast<double>(twice_area_mm2(repair.ring))) * 0.5e-6;
  const double odd_m2 = area_m2(fill(repair.ring, FillRule::even_odd));
  const double doubt_m2 = std::max(std::abs(filled_m2 - signed_m2), filled_m2 - odd_m2);
  const auto crossing =
      std::find_if(found.begin(), found.end(), [](const Contact& c) { return c.crossing; });
  const PointMm place = crossing != found.end() ? crossing->point
                        : found.empty()         ? repair.ring.front()
                                                : found.front().point;
  if (doubt_m2 > self_crossing_allowed_m2(filled_m2)) {
    repair.error = "self-intersecting outline: it crosses or overlaps itself, first at " +
                   in_words(place) + ", which leaves " + in_m2(doubt_m2) + " of " +
                   in_m2(filled_m2) +
                   " in doubt; draw its vertices in order, or as several polygons";
  } else if (crossing != found.end()) {
    repair.repairs.push_back("crosses itself at " + in_words(place) + ", a matter of " +
                             decimal(doubt_m2, 4) + " m2; the loop was filled");
  }
}

void note_touches(RingRepair& repair, const std::vector<Contact>& found) {
  std::set<PointMm> places;
  for (const Contact& c : found) {
    if (!c.crossing) places.insert(c.point);
  }
  Ring sorted = repair.ring;
  std::sort(sorted.begin(), sorted.end());
  for (auto it = std::adjacent_find(sorted.begin(), sorted.end()); it != sorted.end();
       it = std::adjacent_find(it + 1, sorted.end())) {
    places.insert(*it);
  }
  if (places.empty()) return;
  repair.repairs.push_back("touches itself at " + in_words(*places.begin()) +
                           (places.size() == 1
                                ? std::string()
                                : " and " + counted(static_cast<int>(places.size()) - 1,
                                                    "other point", "other points")) +
                           "; split there");
}

RingRepair repair_ring(const Metres& ring_m, bool hole) {
  RingRepair repair;
  for (const Eigen::Vector2d& p : ring_m)
    repair.error = repair.error.empty() ? range_error(p) : repair.error;
  if (!repair.error.empty()) return repair;
  close(ring_m, repair);
  drop_repeated(repair);
  const std::set<PointMm> distinct(repair.ring.begin(), repair.ring.end());
  if (distinct.size() < 3) {
    repair.repairs = {
        "has only " +
        counted(static_cast<int>(distinct.size()), "distinct vertex", "distinct vertices") +
        "; dropped"};
    return repair;
  }
  cut_spikes(repair);
  repair.area = fill(repair.ring, FillRule::non_zero);
  if (repair.area.empty()) {
    repair.repairs = {"encloses no area; dropped"};
    return repair;
  }
  const std::vector<Contact> found = self_contacts(repair.ring);
  check_crossings(repair, found);
  note_touches(repair, found);
  const bool clockwise = twice_area_mm2(repair.ring) < 0;
  if (clockwise != hole) {
    repair.reversal = hole ? "is a hole but runs counter-clockwise; reversed"
                           : "is an outline but runs clockwise; reversed";
  }
  return repair;
}

// Collects what the rings of one feature say.
class OutlineRepair {
 public:
  RepairedOutline run(const std::vector<std::vector<Metres>>& polygons_m) {
    many_ = polygons_m.size() > 1;
    std::vector<Polygons> parts;
    for (std::size_t i = 0; i < polygons_m.size(); ++i) parts.push_back(part(polygons_m[i], i));
    double sum_m2 = 0;
    for (const Polygons& p : parts) sum_m2 += area_m2(p);
    out_.area = unite(parts);
    const double twice_m2 = sum_m2 - area_m2(out_.area);
    if (twice_m2 > kAreaToleranceM2) {
      out_.repairs.push_back("its own polygons overlap by " + in_m2(twice_m2) + "; united");
    }
    return std::move(out_);
  }

 private:
  Polygons part(const std::vector<Metres>& rings_m, std::size_t polygon) {
    if (rings_m.empty()) return {};
    const std::string outer_name = ring_name(polygon, 0);
    const Polygons outer = keep(repair_ring(rings_m[0], false), outer_name);
    std::vector<Polygons> holes;
    for (std::size_t i = 1; i < rings_m.size(); ++i) {
      holes.push_back(keep(repair_ring(rings_m[i], true), ring_name(polygon, i)));
      const double outside_m2 = area_m2(subtract(holes.back(), outer));
      if (outside_m2 > kAreaToleranceM2) {
        out_.repairs.push_back(ring_name(polygon, i) + " is a hole but reaches " +
                               in_m2(outside_m2) + " outside " + outer_name + "; cut off");
      }
    }
    return subtract(outer, unite(holes));
  }

  Polygons keep(RingRepair ring, const std::string& name) {
    for (const std::string& what : ring.repairs) out_.repairs.push_back(name + " " + what);
    if (!ring.reversal.empty()) out_.reversals.push_back(name + " " + ring.reversal);
    if (!ring.error.empty()) out_.errors.push_back(name + ": " + ring.error);
    return ring.error.empty() ? std::move(ring.area) : Polygons{};
  }

  std::string ring_name(std::size_t polygon, std::size_t ring) const {
    const std::string name = "ring " + std::to_string(ring);
    return many_ ? "polygon " + std::to_string(polygon) + ", " + name : name;
  }

  RepairedOutline out_;
  bool many_{};
};

}  // namespace

double self_crossing_allowed_m2(double ring_area_m2) {
  return std::clamp(0.005 * ring_area_m2, 0.01, 1.0);
}

RepairedOutline repair_outline(
    const std::vector<std::vector<std::vector<Eigen::Vector2d>>>& polygons_m) {
  return OutlineRepair().run(polygons_m);
}

RepairedLine repair_line(const std::vector<Eigen::Vector2d>& line_m) {
  RepairedLine repaired;
  for (const Eigen::Vector2d& p : line_m) {
    repaired.error = range_error(p);
    if (!repaired.error.empty()) return repaired;
    const PointMm mm = to_mm(p);
    if (repaired.line.empty() || repaired.line.back() != mm) repaired.line.push_back(mm);
  }
  if (repaired.line.size() < 2) repaired.line.clear();
  return repaired;
}

std::string range_error(const Eigen::Vector2d& point_m) {
  const double limit_m = kDrawnMaxM;
  // Written so that NaN fails, and before any rounding to an integer.
  if (std::abs(point_m.x()) <= limit_m && std::abs(point_m.y()) <= limit_m) return "";
  char place[100];
  std::snprintf(place, sizeof place, "(%.10g, %.10g)", point_m.x(), point_m.y());
  return std::string("coordinate ") + place + " m lies more than " + decimal(limit_m / 1000, 0) +
         " km from the origin; subtract an origin near the site";
}

}  // namespace nav
