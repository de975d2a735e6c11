#include "planning/set_cover_search.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace planning {
namespace {

std::int64_t total(const std::vector<std::int64_t>& weights) {
  return std::accumulate(weights.begin(), weights.end(), std::int64_t{0});
}

// How long a set stays out, and a slot keeps its set. Varies, so that the search does not circle.
constexpr std::uint64_t kOutMin = 4, kOutSpread = 6, kKeepMin = 1, kKeepSpread = 3;

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

SwapSearch::SwapSearch(const SetCover& problem, const std::vector<int>& candidates,
                       const std::vector<int>& chosen, std::uint64_t seed)
    : problem_(problem),
      candidates_(candidates),
      held_by_(problem.atoms()),
      is_chosen_(problem.sets.size()),
      price_(problem.weight),
      times_(problem.atoms()),
      slots_(problem.atoms()),
      adds_(problem.sets.size()),
      in_again_at_(problem.sets.size()),
      random_(seed) {
  candidates_.insert(candidates_.end(), chosen.begin(), chosen.end());
  std::ranges::sort(candidates_);
  candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
  for (const int i : candidates_) {
    for (const int atom : problem_.sets[index(i)]) held_by_[index(atom)].push_back(i);
    adds_[index(i)] = weight_of(problem_, problem_.sets[index(i)]);
  }
  const std::int64_t left_out = total(problem_.weight) - problem_.goal;
  for (std::size_t a = 0; a < problem_.atoms(); ++a)
    if (problem_.weight[a] > left_out) required_.push_back(static_cast<int>(a));
  chosen_.assign(chosen.size(), -1);
  saves_.assign(chosen.size(), std::vector<std::int64_t>(problem.sets.size()));
  out_again_at_.assign(chosen.size(), 0);
  for (std::size_t slot = 0; slot < chosen.size(); ++slot) put(slot, chosen[slot]);
}

void SwapSearch::shift(std::vector<std::int64_t>& of_sets, int atom, std::int64_t by) {
  for (const int i : held_by_[index(atom)]) of_sets[index(i)] += by;
}

void SwapSearch::put(std::size_t slot, int set) {
  chosen_[slot] = set;
  is_chosen_[index(set)] = true;
  for (const int atom : problem_.sets[index(set)]) {
    const std::size_t a = index(atom);
    if (times_[a] == 0) {
      covered_ += problem_.weight[a];
      shift(adds_, atom, -price_[a]);
      shift(saves_[slot], atom, price_[a]);
    } else if (times_[a] == 1) {
      shift(saves_[slots_[a]], atom, -price_[a]);
    }
    ++times_[a];
    slots_[a] ^= slot;
  }
}

void SwapSearch::take(std::size_t slot) {
  const int set = std::exchange(chosen_[slot], -1);
  is_chosen_[index(set)] = false;
  for (const int atom : problem_.sets[index(set)]) {
    const std::size_t a = index(atom);
    --times_[a];
    slots_[a] ^= slot;
    if (times_[a] == 0) {
      covered_ -= problem_.weight[a];
      shift(adds_, atom, price_[a]);
      shift(saves_[slot], atom, -price_[a]);
    } else if (times_[a] == 1) {
      shift(saves_[slots_[a]], atom, price_[a]);
    }
  }
}

void SwapSearch::drop() {
  std::size_t least = 0;
  for (std::size_t slot = 1; slot < chosen_.size(); ++slot)
    if (loss(slot) < loss(least)) least = slot;
  in_again_at_[index(chosen_[least])] = now_ + 1;
  take(least);
  // The last slot moves into the gap.
  const std::size_t last = chosen_.size() - 1;
  if (least != last) {
    const int moved = chosen_[last];
    take(last);
    put(least, moved);
    out_again_at_[least] = out_again_at_[last];
  }
  chosen_.pop_back();
  saves_.pop_back();
  out_again_at_.pop_back();
}

SwapSearch::Move SwapSearch::best_move() const {
  Move best;
  for (std::size_t slot = 0; slot < chosen_.size(); ++slot) {
    if (out_again_at_[slot] > now_) continue;
    const std::int64_t lost = loss(slot);
    for (const int i : candidates_) {
      if (is_chosen_[index(i)] || in_again_at_[index(i)] > now_) continue;
      const std::int64_t delta = adds_[index(i)] + saves_[slot][index(i)] - lost;
      const bool older = best.set >= 0 && in_again_at_[index(i)] < in_again_at_[index(best.set)];
      if (best.set < 0 || delta > best.delta || (delta == best.delta && older))
        best = {slot, i, delta};
    }
  }
  return best;
}

bool SwapSearch::swap() {
  ++now_;
  const Move move = best_move();
  if (move.set < 0) return false;
  in_again_at_[index(chosen_[move.slot])] =
      now_ + static_cast<std::int64_t>(kOutMin + random_() % kOutSpread);
  out_again_at_[move.slot] = now_ + static_cast<std::int64_t>(kKeepMin + random_() % kKeepSpread);
  take(move.slot);
  put(move.slot, move.set);
  press();
  return true;
}

void SwapSearch::press() {
  for (const int atom : required_) {
    if (times_[index(atom)] > 0) continue;
    const std::int64_t more = problem_.weight[index(atom)];
    price_[index(atom)] += more;
    shift(adds_, atom, more);
  }
}

}  // namespace planning
