#include "planning/set_cover_search.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace planning {
namespace {

// How long a set stays out, and a slot keeps its set. Varies, so that the search does not circle.
constexpr std::uint64_t kOutMin = 4, kOutSpread = 6, kKeepMin = 1, kKeepSpread = 3;

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

std::vector<int> united(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::ranges::sort(a);
  a.erase(std::unique(a.begin(), a.end()), a.end());
  return a;
}

}  // namespace

SwapSearch::SwapSearch(const SetCover& problem, const std::vector<int>& candidates,
                       const std::vector<int>& chosen, std::uint64_t seed)
    : problem_(problem),
      candidates_(united(candidates, chosen)),
      runs_(runs(problem)),
      chosen_(chosen.size(), -1),
      is_chosen_(problem.sets.size()),
      price_(problem.weight),
      times_(problem.atoms()),
      slots_(problem.atoms()),
      adds_(problem.sets.size()),
      saves_(chosen.size(), std::vector<std::int64_t>(problem.sets.size())),
      is_stale_(chosen.size(), true),
      sum_to_(problem.atoms() + 1),
      in_again_at_(problem.sets.size()),
      out_again_at_(chosen.size()),
      random_(seed) {
  const std::int64_t left_out = total(problem) - problem.goal;
  for (std::size_t a = 0; a < problem_.atoms(); ++a)
    if (problem_.weight[a] > left_out) required_.push_back(static_cast<int>(a));
  for (std::size_t slot = 0; slot < chosen.size(); ++slot) put(slot, chosen[slot]);
  refresh();
}

void SwapSearch::put(std::size_t slot, int set) {
  chosen_[slot] = set;
  is_chosen_[index(set)] = true;
  is_stale_[slot] = true;
  for (const int atom : problem_.sets[index(set)]) {
    const std::size_t a = index(atom);
    if (times_[a] == 0) covered_ += problem_.weight[a];
    if (times_[a] == 1) is_stale_[slots_[a]] = true;
    ++times_[a];
    slots_[a] ^= slot;
  }
}

void SwapSearch::take(std::size_t slot) {
  const int set = std::exchange(chosen_[slot], -1);
  is_chosen_[index(set)] = false;
  is_stale_[slot] = true;
  for (const int atom : problem_.sets[index(set)]) {
    const std::size_t a = index(atom);
    --times_[a];
    slots_[a] ^= slot;
    if (times_[a] == 0) covered_ -= problem_.weight[a];
    if (times_[a] == 1) is_stale_[slots_[a]] = true;
  }
}

// of_sets: the prices of each candidate's atoms that count.
template <class Counts>
void SwapSearch::sum_up(std::vector<std::int64_t>& of_sets, const Counts& counts) {
  for (std::size_t a = 0; a < price_.size(); ++a)
    sum_to_[a + 1] = sum_to_[a] + (counts(a) ? price_[a] : 0);
  for (const int i : candidates_) {
    std::int64_t sum = 0;
    for (const Run& run : runs_[index(i)]) sum += sum_to_[run.to] - sum_to_[run.from];
    of_sets[index(i)] = sum;
  }
}

void SwapSearch::refresh() {
  sum_up(adds_, [&](std::size_t a) { return times_[a] == 0; });
  for (std::size_t slot = 0; slot < chosen_.size(); ++slot)
    if (std::exchange(is_stale_[slot], false))
      sum_up(saves_[slot], [&](std::size_t a) { return times_[a] == 1 && slots_[a] == slot; });
}

std::int64_t SwapSearch::loss(std::size_t slot) const {
  return saves_[slot][index(chosen_[slot])];
}

void SwapSearch::drop() {
  std::size_t least = 0;
  for (std::size_t slot = 1; slot < chosen_.size(); ++slot)
    if (loss(slot) < loss(least)) least = slot;
  in_again_at_[index(chosen_[least])] = now_ + 1;
  take(least);
  const std::size_t last = chosen_.size() - 1;
  if (least != last) {  // The last slot moves into the gap.
    const int moved = chosen_[last];
    take(last);
    put(least, moved);
    out_again_at_[least] = out_again_at_[last];
  }
  chosen_.pop_back();
  saves_.pop_back();
  is_stale_.pop_back();
  out_again_at_.pop_back();
  refresh();
}

std::vector<SwapSearch::Move> SwapSearch::best_moves(std::size_t count) const {
  std::vector<Move> best;
  for (std::size_t slot = 0; slot < chosen_.size(); ++slot) {
    if (out_again_at_[slot] > now_) continue;
    const std::int64_t lost = loss(slot);
    for (const int i : candidates_) {
      if (is_chosen_[index(i)] || in_again_at_[index(i)] > now_) continue;
      const Move move{slot, i, adds_[index(i)] + saves_[slot][index(i)] - lost,
                      in_again_at_[index(i)]};
      if (best.size() == count && !(best.back() < move)) continue;
      if (best.size() == count) best.pop_back();
      const auto place = std::partition_point(best.begin(), best.end(),
                                              [&](const Move& other) { return !(other < move); });
      best.insert(place, move);
    }
  }
  return best;
}

SwapSearch::Move SwapSearch::least_penalised(std::vector<Move> moves,
                                             const Penalty& penalty) const {
  std::vector<int> after = chosen_;
  for (Move& move : moves) {
    const int before = std::exchange(after[move.slot], move.set);
    move.delta -= penalty(after);
    after[move.slot] = before;
  }
  return *std::ranges::max_element(moves,
                                   [](const Move& a, const Move& b) { return a.delta < b.delta; });
}

bool SwapSearch::swap(const Penalty& penalty) {
  ++now_;
  const std::vector<Move> moves = best_moves(penalty ? kLooked : 1);
  if (moves.empty()) return false;
  const Move move = penalty ? least_penalised(moves, penalty) : moves.front();
  in_again_at_[index(chosen_[move.slot])] =
      now_ + static_cast<std::int64_t>(kOutMin + random_() % kOutSpread);
  out_again_at_[move.slot] = now_ + static_cast<std::int64_t>(kKeepMin + random_() % kKeepSpread);
  take(move.slot);
  put(move.slot, move.set);
  press();
  refresh();
  return true;
}

void SwapSearch::press() {
  for (const int atom : required_)
    if (times_[index(atom)] == 0) price_[index(atom)] += problem_.weight[index(atom)];
}

namespace {

// One try: makes `best` smaller as far as it comes. Whether accept refused anything.
bool try_fewer(SwapSearch search, std::vector<int>& best, const SearchEffort& effort,
               const Accept& accept, const Penalty& penalty) {
  bool refused = false;
  search.drop();
  for (int swaps = 0; swaps < effort.swaps; ++swaps) {
    if (search.reaches_goal()) {
      if (auto accepted = accept(search.chosen())) {
        best = *std::move(accepted);
        if (static_cast<int>(best.size()) <= std::max(1, effort.at_least)) return false;
        search.drop();
        swaps = 0;
        continue;
      }
      refused = true;
    }
    if (!search.swap(penalty)) return refused;
  }
  return refused;
}

}  // namespace

std::vector<int> fewer_sets(const SetCover& problem, const std::vector<int>& candidates,
                            const std::vector<int>& start, const SearchEffort& effort,
                            std::uint64_t seed, const Accept& accept, const Penalty& penalty) {
  std::vector<int> best = start;
  bool refused = false;
  for (int tried = 0; tried < effort.tries; ++tried) {
    if (static_cast<int>(best.size()) <= std::max(1, effort.at_least)) break;
    SwapSearch search(problem, candidates, best, seed + static_cast<std::uint64_t>(tried));
    refused |= try_fewer(std::move(search), best, effort, accept, refused ? penalty : Penalty{});
  }
  return best;
}

std::vector<int> few_sets(const SetCover& problem, const SearchEffort& effort, std::uint64_t seed) {
  std::vector<int> greedy;
  for (std::int64_t so_far = 0; so_far < problem.goal;) {
    std::int64_t most = so_far;
    greedy.push_back(-1);
    for (std::size_t i = 0; i < problem.sets.size(); ++i) {
      std::vector<int> more = greedy;
      more.back() = static_cast<int>(i);
      if (const std::int64_t sum = covered(problem, more); sum > most) {
        most = sum;
        greedy.back() = static_cast<int>(i);
      }
    }
    if (most == so_far) throw std::invalid_argument("all sets together miss the goal of the cover");
    so_far = most;
  }
  auto best = fewer_sets(problem, undominated(problem), greedy, effort, seed,
                         [](const std::vector<int>& chosen) { return std::optional(chosen); });
  std::ranges::sort(best);
  return best;
}

}  // namespace planning
