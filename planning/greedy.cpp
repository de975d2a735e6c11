#include "planning/greedy.hpp"

#include <queue>

namespace planning {
namespace {

struct Bound {
  std::int64_t adds_nm;
  int candidate;
  int round;  // When it was worked out.

  // For a queue with the most on top, ties to the lowest index.
  bool operator<(const Bound& other) const {
    return adds_nm != other.adds_nm ? adds_nm < other.adds_nm : candidate > other.candidate;
  }
};

class Greedy {
 public:
  Greedy(const std::vector<std::vector<Span>>& views, std::size_t walls, const CoverRules& rules)
      : views_(views), rules_(rules), covered_(walls) {
    for (const auto& view : views_) {
      sees_nm_.push_back(length_nm(view));
      bounds_.push({sees_nm_.back(), static_cast<int>(sees_nm_.size()) - 1, 0});
    }
  }

  GreedyCover run(const std::vector<int>& first) {
    for (const int candidate : first) pick(candidate, adds_nm(candidate));
    while (true) {
      if (round() > 0 && covered_.total_nm() >= rules_.goal_nm) return ended(CoverEnd::goal);
      const int best = next();
      if (best < 0) return ended(why_nothing_is_left());
      pick(best, cover_.next_gain_nm);
    }
  }

 private:
  std::size_t round() const { return cover_.picks.size(); }

  std::int64_t adds_nm(int candidate) const {
    const auto i = static_cast<std::size_t>(candidate);
    return sees_nm_[i] - covered_.overlap_nm(views_[i]);
  }

  bool may_be_picked(int candidate, std::int64_t adds_nm) const {
    const std::int64_t sees_nm = sees_nm_[static_cast<std::size_t>(candidate)];
    return round() == 0 || overlaps_enough(sees_nm, sees_nm - adds_nm, rules_.overlap_min);
  }

  // The candidate that adds the most of those that may be picked, if that is enough; else -1.
  int next() {
    std::vector<Bound> refused;  // For this round only.
    int best = -1;
    cover_.next_gain_nm = cover_.next_gain_refused_nm = 0;
    while (best < 0 && !bounds_.empty() && bounds_.top().adds_nm > 0) {
      Bound top = bounds_.top();
      bounds_.pop();
      if (top.round != static_cast<int>(round())) {
        top.adds_nm = adds_nm(top.candidate);
        top.round = static_cast<int>(round());
        bounds_.push(top);
        continue;
      }
      refused.push_back(top);
      if (may_be_picked(top.candidate, top.adds_nm)) {
        best = top.candidate;
        cover_.next_gain_nm = top.adds_nm;
      } else if (cover_.next_gain_refused_nm == 0) {
        cover_.next_gain_refused_nm = top.adds_nm;
      }
    }
    for (const Bound& bound : refused) bounds_.push(bound);
    return cover_.next_gain_nm >= rules_.gain_min_nm ? best : -1;
  }

  void pick(int candidate, std::int64_t adds_nm) {
    const auto i = static_cast<std::size_t>(candidate);
    cover_.picks.push_back({candidate, adds_nm, sees_nm_[i] - adds_nm});
    covered_.add(views_[i]);
  }

  CoverEnd why_nothing_is_left() const {
    const std::int64_t refused_nm = cover_.next_gain_refused_nm;
    if (refused_nm > 0 && refused_nm >= rules_.gain_min_nm) return CoverEnd::overlap;
    return cover_.next_gain_nm > 0 || refused_nm > 0 ? CoverEnd::gain : CoverEnd::all;
  }

  GreedyCover ended(CoverEnd end) {
    cover_.end = end;
    return std::move(cover_);
  }

  const std::vector<std::vector<Span>>& views_;
  CoverRules rules_;
  SpanSet covered_;
  std::vector<std::int64_t> sees_nm_;
  std::priority_queue<Bound> bounds_;
  GreedyCover cover_;
};

}  // namespace

GreedyCover greedy_cover(const std::vector<std::vector<Span>>& views, std::size_t walls,
                         const CoverRules& rules, const std::vector<int>& first) {
  return Greedy(views, walls, rules).run(first);
}

}  // namespace planning
