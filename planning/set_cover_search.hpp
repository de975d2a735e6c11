// Swap search for set covers of a given size: exchanges one set at a time, by exact gains.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "planning/set_cover.hpp"

namespace planning {

// What is wrong with these chosen sets apart from what they do not cover, in units of weight.
using Penalty = std::function<std::int64_t(const std::vector<int>& chosen)>;
inline constexpr std::size_t kLooked = 64;

// Holds some chosen sets and, kept up to date, what every exchange of one of them would change:
// what a set would add (atoms that none holds), and what it would save of the atoms that one
// chosen set alone holds (as in the swap search of Resende and Werneck for p-median). Each swap is
// the best one that is not tabu, also when it makes things worse. Where the goal leaves out less
// than an atom's weight, the atom must be covered: the longer it is not, the more it counts.
//
// Same problem, same start, same seed: the same swaps. Memory: chosen * sets and the atoms.
class SwapSearch {
 public:
  // Of all sets only `candidates` (and those chosen first) are swapped in. `problem` must outlive
  // the search.
  SwapSearch(const SetCover& problem, const std::vector<int>& candidates,
             const std::vector<int>& chosen, std::uint64_t seed);

  const std::vector<int>& chosen() const { return chosen_; }  // In no order.
  std::int64_t covered() const { return covered_; }
  bool reaches_goal() const { return covered_ >= problem_.goal; }

  // Takes out the set whose loss is least. At least one must be chosen.
  void drop();
  // Makes the best swap that is not tabu. False if there is none. With a penalty: of the
  // kLooked swaps that cover most, the one that covers most less its penalty.
  bool swap(const Penalty& penalty = {});

 private:
  struct Move {
    std::size_t slot{};
    int set = -1;
    std::int64_t delta{};
    std::int64_t since{};  // When the set left last, if it ever did.

    bool operator<(const Move& other) const {  // Worse; among equals: left later.
      return delta != other.delta ? delta < other.delta : since > other.since;
    }
  };

  void put(std::size_t slot, int set);
  void take(std::size_t slot);
  void press();    // Makes what must be covered and is not count more.
  void refresh();  // adds_ and those of saves_ that changed.
  template <class Counts>
  void sum_up(std::vector<std::int64_t>& of_sets, const Counts& counts);
  std::vector<Move> best_moves(std::size_t count) const;  // Best first.
  Move least_penalised(std::vector<Move> moves, const Penalty& penalty) const;
  std::int64_t loss(std::size_t slot) const;

  const SetCover& problem_;
  std::vector<int> candidates_;         // Ascending.
  std::vector<std::vector<Run>> runs_;  // By set.
  std::vector<int> required_;           // Atoms that must be covered.
  std::vector<int> chosen_;             // By slot; -1 while a slot is empty.
  std::vector<char> is_chosen_;         // By set.
  std::vector<std::int64_t> price_;     // By atom: its weight, or more.
  std::vector<int> times_;              // By atom: how many chosen sets hold it,
  std::vector<std::size_t> slots_;      // and their slots, each exclusive-ored with the others.
  std::vector<std::int64_t> adds_;      // By set: the price of what none holds.
  // By slot and set: the price of the set's atoms that this slot's set alone holds.
  std::vector<std::vector<std::int64_t>> saves_;
  std::vector<char> is_stale_;        // By slot: saves_ is to be worked out again.
  std::vector<std::int64_t> sum_to_;  // Of prices, over the first atoms; for one use each.
  std::int64_t covered_ = 0;
  std::int64_t now_ = 0;                    // Swaps made.
  std::vector<std::int64_t> in_again_at_;   // By set: when it may come back.
  std::vector<std::int64_t> out_again_at_;  // By slot: when its set may leave.
  std::mt19937_64 random_;
};

// Of a cover that reaches the goal: what the caller makes of it; empty if it may not be used.
using Accept = std::function<std::optional<std::vector<int>>(const std::vector<int>& chosen)>;

struct SearchEffort {
  int at_least{};   // Looks for no fewer sets.
  int swaps = 800;  // In a try, without success, for each number of sets.
  int tries = 3;    // From the best so far.
};

// Takes one set after the other from a cover that reaches the goal, and each time swaps others
// until it is reached again, until that fails. The last cover as accept returned it, or `start`.
// Where a try met covers that accept refused, the next ones mind the penalty.
std::vector<int> fewer_sets(const SetCover& problem, const std::vector<int>& candidates,
                            const std::vector<int>& start, const SearchEffort& effort,
                            std::uint64_t seed, const Accept& accept, const Penalty& penalty = {});

// A cover with few sets, without further rules: greedy, then fewer_sets. Ascending. Throws
// std::invalid_argument if all sets together miss the goal.
std::vector<int> few_sets(const SetCover& problem, const SearchEffort& effort, std::uint64_t seed);

}  // namespace planning
