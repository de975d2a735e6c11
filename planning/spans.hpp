// Sets of places along walls, in whole nanometres: sums are exact and do not depend on their order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "planning/visibility.hpp"

namespace planning {

struct Span {
  int wall{};
  std::int64_t from_nm{}, to_nm{};

  std::int64_t length_nm() const { return to_nm - from_nm; }
  bool operator==(const Span&) const = default;
};

inline std::int64_t to_nm(double length_m) {
  return std::llround(length_m * 1e9);
}
inline double nm_to_m(std::int64_t length_nm) {
  return static_cast<double>(length_nm) * 1e-9;
}

// Gaps up to this are closed when spans are united: ends that are one place may differ by rounding.
inline constexpr std::int64_t kGapNm = 1;

std::vector<Span> spans_of(const std::vector<WallPiece>& pieces);
std::vector<WallPiece> pieces_of(const std::vector<Span>& spans);
std::int64_t length_nm(const std::vector<Span>& spans);

// Ends of views on the same wall that differ by rounding only (chains of ends at most kGapNm apart)
// become one place, the least of them; spans of a view that then touch become one. Afterwards sets
// of these views close no gaps, so that lengths of unions add up piece by piece. Each view is in
// order of wall and place.
void join_ends(std::vector<std::vector<Span>>& views, std::size_t walls);

// Disjoint spans on each of a number of walls.
class SpanSet {
 public:
  explicit SpanSet(std::size_t walls) : walls_(walls) {}

  void add(const Span& span);
  void add(const std::vector<Span>& spans) {
    for (const Span& span : spans) add(span);
  }
  void add(const SpanSet& other);

  // How much of the span lies in the set. Never shrinks when something is added.
  std::int64_t overlap_nm(const Span& span) const;
  std::int64_t overlap_nm(const std::vector<Span>& spans) const;
  std::int64_t total_nm() const;

  // What of this set is not in the other.
  SpanSet minus(const SpanSet& other) const;

  std::size_t walls() const { return walls_.size(); }
  // In order of wall and place.
  std::vector<Span> spans() const;
  const std::vector<Span>& on(int wall) const { return walls_[static_cast<std::size_t>(wall)]; }

 private:
  std::vector<std::vector<Span>> walls_;
};

}  // namespace planning
