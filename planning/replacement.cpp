#include "planning/replacement.hpp"

#include <algorithm>
#include <cmath>

#include "planning/greedy.hpp"
#include "planning/spans.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

constexpr std::size_t kPlacesPerPiece = 16;  // Of work for a thread.

class ReplacementSearch {
 public:
  ReplacementSearch(const LostStation& lost, const std::vector<Wall>& walls,
                    const SensorLimits& limits, int threads)
      : lost_(lost), kept_(walls.size()), missing_(walls.size()) {
    for (const auto& sees : lost.kept) kept_.add(spans_of(sees));
    SpanSet seen(walls.size());
    seen.add(spans_of(lost.sees));
    missing_ = seen.minus(kept_);
    worth_nm_ =
        std::max(to_nm(kWorthM),
                 static_cast<std::int64_t>(std::ceil(kWorthShare * double(missing_.total_nm()))));
    if (missing_.total_nm() >= worth_nm_) look(Visibility(walls, limits), threads);
  }

  Replacements run() {
    Replacements found{.lost_m = nm_to_m(missing_.total_nm()), .left_m = 0, .stations = {}};
    for (int best; (best = next()) >= 0;) {
      const auto i = static_cast<std::size_t>(best);
      const std::int64_t sees_nm = length_nm(views_[i]), adds_nm = missing_.overlap_nm(views_[i]);
      found.stations.push_back({.at = lost_.candidates[i],
                                .sees = pieces_of(views_[i]),
                                .sees_m = nm_to_m(sees_nm),
                                .adds_m = nm_to_m(adds_nm),
                                .overlaps_m = nm_to_m(kept_.overlap_nm(views_[i]))});
      kept_.add(views_[i]);
      missing_ = missing_.minus(kept_);
    }
    found.left_m = nm_to_m(missing_.total_nm());
    return found;
  }

 private:
  void look(const Visibility& visibility, int threads) {
    views_.resize(lost_.candidates.size());
    for_pieces(threads, views_.size(), kPlacesPerPiece,
               [&](int, std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i)
                   views_[i] = spans_of(visibility.from(lost_.candidates[i]));
               });
  }

  // -1: none is worth it.
  int next() {
    std::vector<std::pair<std::int64_t, int>> by_gain;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const std::int64_t adds_nm = missing_.overlap_nm(views_[i]);
      const bool fits = overlaps_enough(length_nm(views_[i]), kept_.overlap_nm(views_[i]),
                                        lost_.kept.empty() ? 0 : lost_.overlap_min);
      if (adds_nm >= worth_nm_ && fits) by_gain.emplace_back(-adds_nm, static_cast<int>(i));
    }
    std::ranges::sort(by_gain);
    for (const auto& [loss_nm, i] : by_gain) {
      if (lost_.can_be_reached(lost_.candidates[static_cast<std::size_t>(i)])) return i;
      views_[static_cast<std::size_t>(i)].clear();  // Not to be asked again.
    }
    return -1;
  }

  const LostStation& lost_;
  SpanSet kept_, missing_;
  std::int64_t worth_nm_{};
  std::vector<std::vector<Span>> views_;
};

}  // namespace

Replacements replace_station(const LostStation& lost, const std::vector<Wall>& walls,
                             const SensorLimits& limits, int threads) {
  return ReplacementSearch(lost, walls, limits, threads).run();
}

}  // namespace planning
