#include "planning/set_cover.hpp"

#include <algorithm>
#include <boost/container_hash/hash.hpp>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace planning {
namespace {

struct End {
  std::int64_t place_nm;
  bool begins;  // At the same place ends come before beginnings.
  int candidate;

  auto operator<=>(const End&) const = default;
};

std::vector<std::vector<End>> ends_on_walls(const std::vector<std::vector<Span>>& views,
                                            std::size_t walls) {
  std::vector<std::vector<End>> ends(walls);
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (const Span& s : views[i]) {
      if (s.length_nm() <= 0) continue;
      ends[static_cast<std::size_t>(s.wall)].push_back({s.from_nm, true, static_cast<int>(i)});
      ends[static_cast<std::size_t>(s.wall)].push_back({s.to_nm, false, static_cast<int>(i)});
    }
  }
  for (auto& on_wall : ends) std::ranges::sort(on_wall);
  return ends;
}

// Walks along walls and gathers the pieces by who sees them.
class Atoms {
 public:
  explicit Atoms(std::size_t candidates) { problem_.sets.resize(candidates); }

  void add_wall(const std::vector<End>& ends) {
    std::vector<int> seen_by;  // Ascending.
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (i > 0) add_piece(seen_by, ends[i].place_nm - ends[i - 1].place_nm);
      const auto at = std::ranges::lower_bound(seen_by, ends[i].candidate);
      if (ends[i].begins) {
        seen_by.insert(at, ends[i].candidate);
      } else {
        seen_by.erase(at);
      }
    }
  }

  SetCover take() { return std::move(problem_); }

 private:
  void add_piece(const std::vector<int>& seen_by, std::int64_t length_nm) {
    if (seen_by.empty() || length_nm == 0) return;
    const auto [atom, is_new] =
        atoms_.try_emplace(seen_by, static_cast<int>(problem_.weight.size()));
    if (is_new) {
      problem_.weight.push_back(0);
      for (const int c : seen_by)
        problem_.sets[static_cast<std::size_t>(c)].push_back(atom->second);
    }
    problem_.weight[static_cast<std::size_t>(atom->second)] += length_nm;
  }

  SetCover problem_;
  std::unordered_map<std::vector<int>, int, boost::hash<std::vector<int>>> atoms_;
};

bool includes(const std::vector<int>& whole, const std::vector<int>& part) {
  return whole.size() >= part.size() && std::ranges::includes(whole, part);
}

// Whether some other set holds all of set i's atoms, and goes before it if they are equal.
bool is_dominated(const SetCover& problem, const std::vector<std::vector<int>>& held_by,
                  std::size_t i) {
  const auto& set = problem.sets[i];
  if (set.empty()) return true;
  const auto rarest = *std::ranges::min_element(
      set, {}, [&](int a) { return held_by[static_cast<std::size_t>(a)].size(); });
  return std::ranges::any_of(held_by[static_cast<std::size_t>(rarest)], [&](int k) {
    const auto j = static_cast<std::size_t>(k);
    const auto& other = problem.sets[j];
    return j != i && includes(other, set) && (other.size() > set.size() || j < i);
  });
}

// Whether covering what must be covered covers this atom too; of atoms alike the first stays.
bool is_implied(const SetCover& problem, const std::vector<std::vector<int>>& held_by,
                const std::vector<char>& required, int atom) {
  const auto& holders_of_atom = held_by[static_cast<std::size_t>(atom)];
  for (const int i : holders_of_atom) {
    for (const int other : problem.sets[static_cast<std::size_t>(i)]) {
      if (other == atom || !required[static_cast<std::size_t>(other)]) continue;
      const auto& holders_of_other = held_by[static_cast<std::size_t>(other)];
      const bool alike = holders_of_other.size() == holders_of_atom.size();
      if (includes(holders_of_atom, holders_of_other) && (!alike || other < atom)) return true;
    }
  }
  return false;
}

}  // namespace

std::vector<std::vector<int>> holders(const SetCover& problem) {
  std::vector<std::vector<int>> held_by(problem.atoms());
  for (std::size_t i = 0; i < problem.sets.size(); ++i)
    for (const int atom : problem.sets[i])
      held_by[static_cast<std::size_t>(atom)].push_back(static_cast<int>(i));
  return held_by;
}

std::vector<std::vector<Run>> runs(const SetCover& problem) {
  std::vector<std::vector<Run>> all;
  for (const auto& set : problem.sets) {
    auto& of_set = all.emplace_back();
    for (const int atom : set) {
      const auto a = static_cast<std::uint32_t>(atom);
      if (of_set.empty() || of_set.back().to != a) of_set.push_back({a, a});
      ++of_set.back().to;
    }
  }
  return all;
}

std::int64_t total(const SetCover& problem) {
  return std::accumulate(problem.weight.begin(), problem.weight.end(), std::int64_t{0});
}

std::int64_t weight_of(const SetCover& problem, const std::vector<int>& atoms) {
  std::int64_t sum = 0;
  for (const int atom : atoms) sum += problem.weight[static_cast<std::size_t>(atom)];
  return sum;
}

std::int64_t covered(const SetCover& problem, const std::vector<int>& chosen) {
  std::vector<char> is_covered(problem.atoms());
  std::int64_t sum = 0;
  for (const int i : chosen)
    for (const int atom : problem.sets[static_cast<std::size_t>(i)])
      if (!std::exchange(is_covered[static_cast<std::size_t>(atom)], 1))
        sum += problem.weight[static_cast<std::size_t>(atom)];
  return sum;
}

SetCover wall_atoms(const std::vector<std::vector<Span>>& views, std::size_t walls) {
  Atoms atoms(views.size());
  for (const auto& ends : ends_on_walls(views, walls)) atoms.add_wall(ends);
  return atoms.take();
}

std::vector<int> undominated(const SetCover& problem) {
  const auto held_by = holders(problem);
  std::vector<int> kept;
  for (std::size_t i = 0; i < problem.sets.size(); ++i)
    if (!is_dominated(problem, held_by, i)) kept.push_back(static_cast<int>(i));
  return kept;
}

SetCover without_implied_atoms(const SetCover& problem) {
  const auto held_by = holders(problem);
  const std::int64_t left_out = total(problem) - problem.goal;
  std::vector<char> required(problem.atoms());
  for (std::size_t a = 0; a < problem.atoms(); ++a)
    required[a] = problem.weight[a] > left_out && !held_by[a].empty();
  SetCover smaller{.weight = {},
                   .sets = std::vector<std::vector<int>>(problem.sets.size()),
                   .goal = problem.goal};
  for (std::size_t a = 0; a < problem.atoms(); ++a) {
    if (is_implied(problem, held_by, required, static_cast<int>(a))) {
      smaller.goal -= problem.weight[a];
      continue;
    }
    for (const int i : held_by[a])
      smaller.sets[static_cast<std::size_t>(i)].push_back(static_cast<int>(smaller.atoms()));
    smaller.weight.push_back(problem.weight[a]);
  }
  return smaller;
}

}  // namespace planning
