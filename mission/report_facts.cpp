#include "mission/report_facts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace mission {
namespace {

using planning::Excluded;
using planning::WallPiece;

constexpr double kSame_m = 0.001;  // The planner's grid.

double length_of(const planning::Wall& wall) {
  return nav::length_m(wall.a, wall.b);
}

bool is_scan_of(const ScanRecord& scan, const AreaPlan& plan, const planning::Station& station) {
  return !scan.next_best_view && scan.area == plan.area.name &&
         (scan.planned.position_m - nav::to_m(station.at.position)).norm() < kSame_m &&
         std::abs(scan.planned.heading_rad - station.at.heading_rad) < 1e-6;
}

int scan_of(const RunRecord& record, const AreaPlan& plan, const planning::Station& station) {
  const auto found =
      std::find_if(record.scans.begin(), record.scans.end(),
                   [&](const ScanRecord& scan) { return is_scan_of(scan, plan, station); });
  return found == record.scans.end() ? -1 : static_cast<int>(found - record.scans.begin());
}

// Disjoint and in order, by wall.
std::vector<WallPiece> united(std::vector<WallPiece> pieces) {
  std::sort(pieces.begin(), pieces.end(), [](const WallPiece& a, const WallPiece& b) {
    return std::tie(a.wall, a.from_m, a.to_m) < std::tie(b.wall, b.from_m, b.to_m);
  });
  std::vector<WallPiece> result;
  for (const WallPiece& piece : pieces) {
    if (!result.empty() && result.back().wall == piece.wall &&
        piece.from_m <= result.back().to_m + kSame_m) {
      result.back().to_m = std::max(result.back().to_m, piece.to_m);
    } else {
      result.push_back(piece);
    }
  }
  return result;
}

// The wall's parts outside `covered` (disjoint, in order, may name other walls too).
std::vector<WallPiece> rest_of(const planning::Wall& wall, int index,
                               const std::vector<WallPiece>& covered) {
  std::vector<WallPiece> rest;
  double from_m = 0;
  const auto first = std::lower_bound(covered.begin(), covered.end(), index,
                                      [](const WallPiece& p, int i) { return p.wall < i; });
  for (auto piece = first; piece != covered.end() && piece->wall == index; ++piece) {
    if (piece->from_m > from_m + kSame_m) rest.push_back({index, from_m, piece->from_m});
    from_m = std::max(from_m, piece->to_m);
  }
  if (length_of(wall) > from_m + kSame_m) rest.push_back({index, from_m, length_of(wall)});
  return rest;
}

// Cuts an uncovered part of a wall where the plan's reason changes.
void append_gaps(const WallPiece& part, const std::vector<planning::UncoveredPiece>& reasons,
                 std::vector<Gap>& gaps) {
  std::vector<double> cuts{part.from_m, part.to_m};
  for (const auto& reason : reasons) {
    for (const double cut_m : {reason.piece.from_m, reason.piece.to_m}) {
      if (cut_m > part.from_m && cut_m < part.to_m) cuts.push_back(cut_m);
    }
  }
  std::sort(cuts.begin(), cuts.end());
  const std::size_t before = gaps.size();
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double middle_m = (cuts[i] + cuts[i + 1]) / 2;
    const auto reason = std::find_if(reasons.begin(), reasons.end(), [middle_m](const auto& r) {
      return r.piece.from_m <= middle_m && middle_m <= r.piece.to_m;
    });
    const auto why = reason == reasons.end() ? std::nullopt : std::optional(reason->reason);
    const bool sliver = cuts[i + 1] - cuts[i] <= kSame_m;  // Rounding, not a reason of its own.
    if (gaps.size() > before && (sliver || gaps.back().why == why)) {
      gaps.back().piece.to_m = cuts[i + 1];
    } else {
      gaps.push_back({{part.wall, cuts[i], cuts[i + 1]}, why});
    }
  }
}

std::vector<Gap> gaps_of(const AreaPlan& plan, const std::vector<WallPiece>& covered) {
  std::vector<std::vector<planning::UncoveredPiece>> reasons(plan.walls.size());
  for (const auto& piece : plan.cover.uncovered) {
    reasons.at(static_cast<std::size_t>(piece.piece.wall)).push_back(piece);
  }
  std::vector<Gap> gaps;
  for (std::size_t i = 0; i < plan.walls.size(); ++i) {
    if (!plan.walls[i].target) continue;
    for (const WallPiece& part : rest_of(plan.walls[i], static_cast<int>(i), covered)) {
      append_gaps(part, reasons[i], gaps);
    }
  }
  return gaps;
}

bool continues(const AreaPlan& plan, const Gap& before, const Gap& after) {
  if (before.why != after.why) return false;
  if (before.piece.wall == after.piece.wall) {
    return std::abs(before.piece.to_m - after.piece.from_m) <= kSame_m;
  }
  const auto& first = plan.walls[static_cast<std::size_t>(before.piece.wall)];
  const auto& next = plan.walls[static_cast<std::size_t>(after.piece.wall)];
  return first.b == next.a && before.piece.to_m >= length_of(first) - kSame_m &&
         after.piece.from_m <= kSame_m;
}

AreaFacts places_in_tour(const AreaPlan& plan) {
  AreaFacts facts;
  facts.scan_of_station.assign(plan.cover.stations.size(), -1);
  facts.place_in_tour.assign(plan.cover.stations.size(), 0);
  for (std::size_t i = 0; i < plan.tour.size(); ++i) {
    facts.place_in_tour.at(static_cast<std::size_t>(plan.tour[i])) = static_cast<int>(i) + 1;
  }
  return facts;
}

// From the pieces in facts.covered, which may overlap.
AreaFacts sum_up(const AreaPlan& plan, AreaFacts facts) {
  facts.covered = united(std::move(facts.covered));
  for (const WallPiece& piece : facts.covered) facts.covered_m += piece.to_m - piece.from_m;
  facts.gaps = gaps_of(plan, facts.covered);
  return facts;
}

}  // namespace

Eigen::Vector2d wall_point_m(const planning::Wall& wall, double along_m) {
  const Eigen::Vector2d a = nav::to_m(wall.a), b = nav::to_m(wall.b);
  const double length_m = (b - a).norm();
  return length_m > 0 ? Eigen::Vector2d(a + (b - a) * (along_m / length_m)) : a;
}

AreaFacts area_facts(const RunRecord& record, const AreaPlan& plan) {
  AreaFacts facts = places_in_tour(plan);
  for (std::size_t i = 0; i < plan.cover.stations.size(); ++i) {
    const planning::Station& station = plan.cover.stations[i];
    facts.scan_of_station[i] = scan_of(record, plan, station);
    if (facts.scan_of_station[i] < 0) continue;
    const auto scan = static_cast<std::size_t>(facts.scan_of_station[i]);
    if (record.scans[scan].fit.verdict == ScanVerdict::refused) continue;  // Not merged.
    facts.covered.insert(facts.covered.end(), station.sees.begin(), station.sees.end());
  }
  return sum_up(plan, std::move(facts));
}

AreaFacts planned_facts(const AreaPlan& plan) {
  AreaFacts facts = places_in_tour(plan);
  for (const int station : plan.tour) {
    const auto& sees = plan.cover.stations[static_cast<std::size_t>(station)].sees;
    facts.covered.insert(facts.covered.end(), sees.begin(), sees.end());
  }
  return sum_up(plan, std::move(facts));
}

std::vector<GapStretch> gap_stretches(const AreaPlan& plan, const std::vector<Gap>& gaps) {
  std::vector<GapStretch> stretches;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const auto& wall = plan.walls[static_cast<std::size_t>(gaps[i].piece.wall)];
    const Eigen::Vector2d to_m = wall_point_m(wall, gaps[i].piece.to_m);
    const double length_m = gaps[i].piece.to_m - gaps[i].piece.from_m;
    if (i > 0 && continues(plan, gaps[i - 1], gaps[i])) {
      stretches.back().to_m = to_m;
      stretches.back().length_m += length_m;
    } else {
      stretches.push_back({wall_point_m(wall, gaps[i].piece.from_m), to_m, length_m, gaps[i].why});
    }
  }
  std::stable_sort(
      stretches.begin(), stretches.end(),
      [](const GapStretch& a, const GapStretch& b) { return a.length_m > b.length_m; });
  return stretches;
}

std::optional<double> Coverage::of_coverable() const {
  return coverable_m > 0 ? std::optional(covered_m / coverable_m) : std::nullopt;
}

std::optional<double> Coverage::of_target() const {
  return target_m > 0 ? std::optional(covered_m / target_m) : std::nullopt;
}

Coverage& Coverage::operator+=(const Coverage& other) {
  target_m += other.target_m;
  coverable_m += other.coverable_m;
  planned_m += other.planned_m;
  covered_m += other.covered_m;
  return *this;
}

Coverage coverage_of(const AreaPlan& plan, const AreaFacts& facts) {
  return {plan.cover.target_m, plan.cover.coverable_m, plan.cover.covered_m, facts.covered_m};
}

Why why_text(std::optional<Excluded> reason) {
  if (reason)
    return {planning::name(*reason), planning::meaning(*reason), planning::remedy(*reason)};
  return {"not_scanned", "The station that was to cover it was not scanned.",
          "See the dropped stations for the reason; visit them again."};
}

std::int64_t occupied_gained(const RunRecord& record, std::size_t scan) {
  const auto after = static_cast<std::int64_t>(record.scans[scan].after.seen_occupied);
  return scan == 0 ? after
                   : after - static_cast<std::int64_t>(record.scans[scan - 1].after.seen_occupied);
}

std::optional<PoseError> pose_error(const ScanRecord& scan) {
  if (!scan.truth) return std::nullopt;
  const double turn_rad = scan.believed.heading_rad - scan.truth->heading_rad;
  return PoseError{(scan.believed.position_m - scan.truth->position_m).norm(),
                   std::abs(std::remainder(turn_rad, 2 * std::numbers::pi))};
}

}  // namespace mission
