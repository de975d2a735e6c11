#include "planning/cover.hpp"

#include <algorithm>
#include <cmath>

#include "nav/words.hpp"
#include "planning/spans.hpp"
#include "planning/station_choice.hpp"
#include "planning/voxel_parallel.hpp"

namespace planning {
namespace {

constexpr std::int64_t kPieceMinNm = 1'000'000;
constexpr std::size_t kCandidatesPerPiece = 16;  // Of work for a thread.

std::vector<std::vector<Span>> views_of(const std::vector<Candidate>& candidates,
                                        const Visibility& visibility, int threads) {
  std::vector<std::vector<Span>> views(candidates.size());
  for_pieces(threads, candidates.size(), kCandidatesPerPiece,
             [&](int, std::size_t begin, std::size_t end) {
               for (std::size_t i = begin; i < end; ++i)
                 views[i] = spans_of(visibility.from(candidates[i]));
             });
  join_ends(views, visibility.walls().size());
  return views;
}

SpanSet targets_of(const std::vector<Wall>& walls) {
  SpanSet targets(walls.size());
  for (std::size_t i = 0; i < walls.size(); ++i)
    if (walls[i].target) targets.add(Span{static_cast<int>(i), 0, to_nm(walls[i].length_m())});
  return targets;
}

// What passed the first k constraints at some candidate, for each k: smaller and smaller sets.
class Passed {
 public:
  static constexpr std::size_t kSteps = 5;
  static constexpr Excluded kStep[kSteps] = {Excluded::occluded, Excluded::range_max,
                                             Excluded::range_min, Excluded::grazing,
                                             Excluded::field_of_view};

  explicit Passed(std::size_t walls) : steps_(kSteps, SpanSet(walls)) {}

  void add(const Outcome& outcome) {
    const Span span = spans_of({outcome.piece}).front();
    for (std::size_t k = 0; k < kSteps && outcome.excluded != kStep[k]; ++k) steps_[k].add(span);
  }
  void add(const Passed& other) {
    for (std::size_t k = 0; k < kSteps; ++k) steps_[k].add(other.steps_[k]);
  }
  const SpanSet& step(std::size_t k) const { return steps_[k]; }

 private:
  std::vector<SpanSet> steps_;
};

// For the walls of `missed` only.
Passed passed(const SpanSet& missed, const std::vector<Candidate>& candidates,
              const Visibility& visibility, int threads) {
  const std::size_t walls = visibility.walls().size();
  std::vector<Passed> by_thread(static_cast<std::size_t>(std::max(1, threads)), Passed(walls));
  for_pieces(threads, candidates.size(), kCandidatesPerPiece,
             [&](int thread, std::size_t begin, std::size_t end) {
               for (std::size_t i = begin; i < end; ++i)
                 for (const Outcome& outcome : visibility.explain(candidates[i]))
                   if (!missed.on(outcome.piece.wall).empty())
                     by_thread[static_cast<std::size_t>(thread)].add(outcome);
             });
  for (std::size_t i = 1; i < by_thread.size(); ++i) by_thread[0].add(by_thread[i]);
  return by_thread[0];
}

bool worth_telling(const SpanSet& set) {
  const std::vector<Span> spans = set.spans();
  return std::ranges::any_of(spans, [](const Span& s) { return s.length_nm() >= kPieceMinNm; });
}

void tell(const SpanSet& pieces, Excluded reason, std::vector<UncoveredPiece>& uncovered) {
  for (const Span& span : pieces.spans())
    if (span.length_nm() >= kPieceMinNm) uncovered.push_back({pieces_of({span}).front(), reason});
}

// Pieces that no candidate sees.
void tell_missed(SpanSet missed, const std::vector<Candidate>& candidates,
                 const Visibility& visibility, int threads,
                 std::vector<UncoveredPiece>& uncovered) {
  if (!worth_telling(missed)) return;
  const Passed reached = passed(missed, candidates, visibility, threads);
  for (std::size_t k = 0; k < Passed::kSteps; ++k) {
    const SpanSet stopped = missed.minus(reached.step(k));
    tell(stopped, Passed::kStep[k], uncovered);
    missed = missed.minus(stopped);
  }
  tell(missed, Excluded::gain, uncovered);  // Seen, but only in bits below kPieceMinM.
}

// Pieces that candidates see, of which none was chosen.
void tell_left(const SpanSet& left, const SpanSet& covered, const GreedyCover& cover,
               const std::vector<std::vector<Span>>& views, const CoverRules& rules,
               std::vector<UncoveredPiece>& uncovered) {
  if (cover.end == CoverEnd::goal) return tell(left, Excluded::goal, uncovered);
  if (cover.end == CoverEnd::given) return tell(left, Excluded::given, uncovered);
  SpanSet within_overlap(covered.walls());
  for (const auto& view : views) {
    const bool enough =
        overlaps_enough(length_nm(view), covered.overlap_nm(view), rules.overlap_min);
    if (enough || cover.picks.empty()) within_overlap.add(view);
  }
  const SpanSet refused = left.minus(within_overlap);
  tell(refused, Excluded::overlap, uncovered);
  tell(left.minus(refused), Excluded::gain, uncovered);
}

std::string percent(double part, double whole) {
  return nav::decimal(whole > 0 ? 100 * part / whole : 100, 1) + " %";
}

std::string least_gain(const CoverConfig& config) {
  std::string words = "gain_min (" + percent(config.gain_min, 1) + ")";
  if (std::isfinite(config.gain_enough_m))
    words += " and gain_enough_m (" + nav::decimal(config.gain_enough_m, 1) + " m)";
  return words;
}

std::string in_words(const GreedyCover& cover, const CoverPlan& plan, const CoverConfig& config) {
  if (plan.candidates.empty()) return "The scanner can stand nowhere in this area.";
  if (plan.target_m <= 0) return "No wall that counts borders this area.";
  if (plan.coverable_m <= 0) return "No candidate sees any wall that counts.";
  const std::string share = percent(plan.covered_m, plan.coverable_m) + " of what can be covered";
  const auto gain = [&](std::int64_t nm) { return percent(nm_to_m(nm), plan.target_m); };
  switch (cover.end) {
    case CoverEnd::goal:
      return "The goal is reached: " + share + " (coverage_goal " +
             percent(config.coverage_goal, 1) + ").";
    case CoverEnd::gain:
      return "The best further view would add " + gain(cover.next_gain_nm) +
             " of the target walls, less than " + least_gain(config) + "; covered is " + share +
             ".";
    case CoverEnd::overlap:
      return "Further views would add up to " + gain(cover.next_gain_refused_nm) +
             " of the target walls, but overlap the others by less than overlap_min (" +
             percent(config.overlap_min, 1) + "); covered is " + share + ".";
    case CoverEnd::given:
      return "The stations were given; covered is " + share + ".";
    case CoverEnd::all:
      break;
  }
  return "All that can be covered is covered.";
}

// The last `count` views, in their order, whatever they add.
GreedyCover given_cover(const std::vector<std::vector<Span>>& views, std::size_t count,
                        std::size_t walls) {
  GreedyCover cover;
  cover.end = CoverEnd::given;
  SpanSet covered(walls);
  for (std::size_t i = views.size() - count; i < views.size(); ++i) {
    const std::int64_t overlaps_nm = covered.overlap_nm(views[i]);
    cover.picks.push_back({static_cast<int>(i), length_nm(views[i]) - overlaps_nm, overlaps_nm});
    covered.add(views[i]);
  }
  return cover;
}

Station station(const Candidate& at, const std::vector<Span>& view, const Pick& pick) {
  return {.at = at,
          .sees = pieces_of(view),
          .sees_m = nm_to_m(length_nm(view)),
          .adds_m = nm_to_m(pick.adds_nm),
          .overlaps_m = nm_to_m(pick.overlaps_nm)};
}

std::string bound_in_words(std::size_t stations, int at_least) {
  if (stations == 0) return "";
  const std::string text =
      nav::counted(static_cast<int>(stations), "station", "stations") + "; provably ";
  return text + (static_cast<int>(stations) <= at_least
                     ? "no fewer will do."
                     : "at least " + std::to_string(at_least) + ".");
}

// The given stations, or those that the search finds. Of given ones the bound says how few would
// cover as much.
StationChoice chosen(const std::vector<std::vector<Span>>& views, std::size_t walls,
                     CoverRules rules, const CoverConfig& config, std::uint64_t seed) {
  const bool refine = config.method == CoverMethod::refined;
  if (!config.given) return choose_stations(views, walls, rules, refine, seed);
  GreedyCover given = given_cover(views, config.given->size(), walls);
  rules.goal_nm = covered_nm(given);
  StationChoice choice = choose_stations(views, walls, rules, false, seed);
  choice.cover = std::move(given);
  return choice;
}

// What they cover together.
SpanSet add_stations(const GreedyCover& cover, const std::vector<std::vector<Span>>& views,
                     std::size_t walls, CoverPlan& plan) {
  SpanSet covered(walls);
  for (const Pick& pick : cover.picks) {
    const auto i = static_cast<std::size_t>(pick.candidate);
    plan.stations.push_back(station(plan.candidates[i], views[i], pick));
    covered.add(views[i]);
  }
  return covered;
}

OverlapGraph overlap_of(const GreedyCover& cover, const std::vector<std::vector<Span>>& views,
                        double overlap_min) {
  std::vector<std::vector<Span>> chosen;
  for (const Pick& pick : cover.picks)
    chosen.push_back(views[static_cast<std::size_t>(pick.candidate)]);
  return overlap_graph(chosen, overlap_min);
}

// Rounded up, so that reaching it is reaching the share.
std::int64_t share_of(double share, std::int64_t whole_nm) {
  return static_cast<std::int64_t>(std::ceil(share * static_cast<double>(whole_nm)));
}

// What a further station must add.
std::int64_t gain_min_nm(const CoverConfig& config, std::int64_t target_nm) {
  const std::int64_t share_nm = share_of(config.gain_min, target_nm);
  if (config.gain_enough_m >= nm_to_m(share_nm)) return share_nm;
  return to_nm(config.gain_enough_m);
}

}  // namespace

CoverPlan plan_cover(const nav::FreeArea& area, const std::vector<Wall>& walls,
                     const SensorLimits& limits, const CoverConfig& config, std::uint64_t seed,
                     int threads) {
  CoverPlan plan;
  plan.candidates = draw_candidates(area, config.candidates, limits.fov_deg, seed);
  if (config.given)
    plan.candidates.insert(plan.candidates.end(), config.given->begin(), config.given->end());
  const Visibility visibility(walls, limits);
  const auto views = views_of(plan.candidates, visibility, threads);

  const SpanSet targets = targets_of(walls);
  SpanSet coverable(walls.size());
  for (const auto& view : views) coverable.add(view);
  const CoverRules rules{.goal_nm = share_of(config.coverage_goal, coverable.total_nm()),
                         .gain_min_nm = gain_min_nm(config, targets.total_nm()),
                         .overlap_min = config.overlap_min};
  const StationChoice choice = chosen(views, walls.size(), rules, config, seed);
  const GreedyCover& cover = choice.cover;
  const SpanSet covered = add_stations(cover, views, walls.size(), plan);
  plan.overlap = overlap_of(cover, views, config.overlap_min);
  plan.target_m = nm_to_m(targets.total_nm());
  plan.coverable_m = nm_to_m(coverable.total_nm());
  plan.covered_m = nm_to_m(covered.total_nm());
  plan.end = in_words(cover, plan, config);
  plan.stations_greedy = choice.greedy;
  plan.goal_m = nm_to_m(choice.goal_nm);
  plan.stations_at_least = choice.at_least;
  plan.bound = bound_in_words(plan.stations.size(), choice.at_least);

  tell_missed(targets.minus(coverable), plan.candidates, visibility, threads, plan.uncovered);
  tell_left(coverable.minus(covered), covered, cover, views, rules, plan.uncovered);
  std::ranges::sort(plan.uncovered, [](const UncoveredPiece& p, const UncoveredPiece& q) {
    return std::pair(p.piece.wall, p.piece.from_m) < std::pair(q.piece.wall, q.piece.from_m);
  });
  return plan;
}

SetCover cover_problem(const CoverPlan& plan, const std::vector<Wall>& walls,
                       const SensorLimits& limits, int threads) {
  SetCover problem =
      wall_atoms(views_of(plan.candidates, Visibility(walls, limits), threads), walls.size());
  problem.goal = to_nm(plan.goal_m);
  return problem;
}

}  // namespace planning
