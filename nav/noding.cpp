#include "nav/noding.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "nav/box_tree.hpp"

namespace nav {
namespace {

constexpr int kRoundsMax = 60;

using Splits = std::vector<std::pair<int, PointMm>>;  // Piece, and where to split it.

Eigen::Vector2d exact(PointMm p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

// p is known to lie on the line through the piece.
bool strictly_between(const OutlinePiece& piece, PointMm p) {
  return dot(p - piece.a, piece.b - piece.a) > 0 && dot(p - piece.b, piece.a - piece.b) > 0;
}

PointMm crossing(const OutlinePiece& s, const OutlinePiece& t) {
  const auto from_a = static_cast<double>(side(t.a, t.b, s.a));
  const auto from_b = static_cast<double>(side(t.a, t.b, s.b));
  const Eigen::Vector2d p = exact(s.a) + (exact(s.b) - exact(s.a)) * (from_a / (from_a - from_b));
  return {std::llround(p.x()), std::llround(p.y())};
}

class Noder {
 public:
  explicit Noder(std::vector<OutlinePiece> pieces) : pieces_(std::move(pieces)) {}

  // One round; false when nothing was left to split.
  bool split_once() {
    find_splits();
    if (splits_.empty()) return false;
    apply_splits();
    return true;
  }

  std::vector<OutlinePiece> take() { return std::move(pieces_); }

 private:
  OutlinePiece& piece(int i) { return pieces_[static_cast<std::size_t>(i)]; }

  void find_splits() {
    std::vector<Box2> boxes;
    boxes.reserve(pieces_.size());
    for (const OutlinePiece& p : pieces_) boxes.push_back(box_of({exact(p.a), exact(p.b)}));
    const BoxTree tree(boxes);
    splits_.clear();
    for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
      tree.near({exact(piece(i).a), exact(piece(i).b)}, 0.5, [&](int j) {
        if (j > i) compare(i, j);
        return 0.5;
      });
  }

  void compare(int i, int j) {
    OutlinePiece& s = piece(i);
    OutlinePiece& t = piece(j);
    const int t_a = sign(side(s.a, s.b, t.a));
    const int t_b = sign(side(s.a, s.b, t.b));
    const int s_a = sign(side(t.a, t.b, s.a));
    const int s_b = sign(side(t.a, t.b, s.b));
    if (t_a * t_b < 0 && s_a * s_b < 0) {
      const PointMm at = crossing(s, t);
      split(i, at);
      split(j, at);
      s.doubtful = t.doubtful = true;
      return;
    }
    const std::size_t before = splits_.size();
    if (t_a == 0 && strictly_between(s, t.a)) split(i, t.a);
    if (t_b == 0 && strictly_between(s, t.b)) split(i, t.b);
    if (s_a == 0 && strictly_between(t, s.a)) split(j, s.a);
    if (s_b == 0 && strictly_between(t, s.b)) split(j, s.b);
    const bool along_each_other = t_a == 0 && t_b == 0;
    if (along_each_other && splits_.size() > before) s.doubtful = t.doubtful = true;
  }

  void split(int i, PointMm at) {
    if (at != piece(i).a && at != piece(i).b) splits_.emplace_back(i, at);
  }

  void apply_splits() {
    std::sort(splits_.begin(), splits_.end(), [&](const auto& l, const auto& r) {
      if (l.first != r.first) return l.first < r.first;
      const OutlinePiece& p = piece(l.first);
      const auto l_along = dot(l.second - p.a, p.b - p.a);
      const auto r_along = dot(r.second - p.a, p.b - p.a);
      return l_along != r_along ? l_along < r_along : l.second < r.second;
    });
    for (std::size_t k = 0; k < splits_.size();) {
      const int i = splits_[k].first;
      const OutlinePiece whole = piece(i);
      PointMm from = whole.a;
      bool first = true;
      for (; k <= splits_.size(); ++k) {
        const bool last = k == splits_.size() || splits_[k].first != i;
        const PointMm to = last ? whole.b : splits_[k].second;
        if (to != from) {
          const OutlinePiece part{from, to, whole.doubtful};
          if (first)
            piece(i) = part;
          else
            pieces_.push_back(part);
          first = false;
        }
        from = to;
        if (last) break;
      }
    }
  }

  std::vector<OutlinePiece> pieces_;
  Splits splits_;
};

bool same_ends(const OutlinePiece& l, const OutlinePiece& r) {
  return std::minmax(l.a, l.b) == std::minmax(r.a, r.b);
}

// Of several pieces between the same two points one stays. Two that run in opposite directions are
// a wall without thickness or a corridor without width: doubtful.
std::vector<OutlinePiece> merge_equal(std::vector<OutlinePiece> pieces) {
  std::sort(pieces.begin(), pieces.end(), [](const OutlinePiece& l, const OutlinePiece& r) {
    const auto l_ends = std::pair<PointMm, PointMm>(std::minmax(l.a, l.b));
    const auto r_ends = std::pair<PointMm, PointMm>(std::minmax(r.a, r.b));
    return l_ends != r_ends ? l_ends < r_ends : l.a < r.a;
  });
  std::vector<OutlinePiece> merged;
  for (const OutlinePiece& p : pieces) {
    if (merged.empty() || !same_ends(merged.back(), p)) {
      merged.push_back(p);
      continue;
    }
    merged.back().doubtful |= p.doubtful || merged.back().a != p.a;
  }
  return merged;
}

}  // namespace

std::vector<OutlinePiece> node_outlines(const std::vector<SegmentMm>& segments) {
  std::vector<OutlinePiece> pieces;
  pieces.reserve(segments.size());
  for (const SegmentMm& s : segments)
    if (s.a != s.b) pieces.push_back({s.a, s.b, false});
  for (int round = 0; round < kRoundsMax; ++round) {
    Noder noder(merge_equal(std::move(pieces)));
    const bool more = noder.split_once();
    pieces = noder.take();
    if (!more) return pieces;
  }
  throw std::runtime_error("node_outlines: outlines still cross after 60 rounds of splitting");
}

}  // namespace nav
