// What turns with rows of beams do to the map of obstacles.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "nav/moving.hpp"
#include "nav/obstacle_map.hpp"

namespace nav {
namespace {

using Eigen::Vector2d;

constexpr int kAimings = 3;  // At a beam: the robot turns while its scanner does.

}  // namespace

// A turn: where each column of beams starts in W and which way it goes, and its rows.
struct ObstacleMap::Rows {
  struct Row {
    double tip_m, slope, flat_share;  // Height of its tip, rise per metre of way, way per range.
    const std::vector<float>* ranges_m;

    double height_m(double away_m) const { return tip_m + away_m * slope; }
  };
  std::vector<Vector2d> W_from_m, W_way;
  std::vector<Row> rows;
  double step_rad;

  explicit Rows(const MovingTurn& seen) : step_rad(seen.turn.angle_step_rad) {
    for (const hal::BeamRow& row : seen.turn.rows)
      rows.push_back({seen.height_m + row.tip_z_m, std::tan(row.elevation_rad),
                      std::cos(row.elevation_rad), &row.ranges_m});
    const std::size_t columns = seen.turn.columns();
    for (std::size_t i = 0; i < columns; ++i) {
      const Eigen::Isometry2d T_W_B =
          on_the_way(seen.W_first, seen.W_last, share_of_turn(i, columns));
      const double angle_rad = seen.turn.angle_first_rad + static_cast<double>(i) * step_rad;
      W_from_m.emplace_back(T_W_B.translation());
      W_way.emplace_back(T_W_B.linear() * Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
    }
  }
  // The column whose beams go there; all round there is always one.
  std::size_t column_at(const Vector2d& W_point_m) const {
    const auto count = static_cast<long>(W_way.size());
    long column = count / 2;
    for (int i = 0; i < kAimings; ++i) {
      const auto at = static_cast<std::size_t>(column);
      const Vector2d to = W_point_m - W_from_m[at];
      const double off_rad =
          std::atan2(W_way[at].x() * to.y() - W_way[at].y() * to.x(), W_way[at].dot(to));
      column = ((column + std::lround(off_rad / step_rad)) % count + count) % count;
    }
    return static_cast<std::size_t>(column);
  }
};

void ObstacleMap::add(const MovingTurn& seen, hal::Time now) {
  const Rows rows(seen);
  take_out_empty(rows, now);
  for (std::size_t row = 0; row < rows.rows.size(); ++row) put(rows, row, now);
}

void ObstacleMap::put(const Rows& rows, std::size_t row, hal::Time now) {
  const Rows::Row& beams = rows.rows[row];
  auto latest = cells_.end();
  for (std::size_t i = 0; i < beams.ranges_m->size(); ++i) {
    const double away_m = (*beams.ranges_m)[i] * beams.flat_share;
    if (!(away_m >= config_.range_min_m && away_m <= config_.reach_m)) continue;
    const double height_m = beams.height_m(away_m);
    if (height_m < config_.ground_m + config_.ground_rise * away_m || height_m > config_.top_m)
      continue;
    const Vector2d W_point_m = rows.W_from_m[i] + away_m * rows.W_way[i];
    Cell& cell = hit(W_point_m, rows.W_from_m[i], now, latest);
    const bool fresh = cell.low_m == 0;
    cell.low_m = fresh ? height_m : std::min(cell.low_m, height_m);
    cell.high_m = fresh ? height_m : std::max(cell.high_m, height_m);
  }
}

// All rows that pass through what was seen have to go on beyond it, with the beams beside them.
ObstacleMap::Look ObstacleMap::look_at(Cell& cell, const Rows& rows) const {
  const std::size_t count = rows.W_way.size(), column = rows.column_at(cell.W_point_m);
  const double away_m = (cell.W_point_m - rows.W_from_m[column]).norm();
  cell.hidden = true;
  bool passed = false, from_nowhere = false;
  for (const Rows::Row& row : rows.rows) {
    const double height_m = row.height_m(away_m);
    if (height_m <= cell.high_m) cell.hidden = away_m <= config_.blind_m;
    if (cell.hidden || height_m < cell.low_m || height_m > cell.high_m - config_.inside_m) continue;
    for (const std::size_t i : {(column + count - 1) % count, column, (column + 1) % count}) {
      const double range_m = (*row.ranges_m)[i];
      if (range_m == 0)
        from_nowhere = true;
      else if (!(range_m * row.flat_share > away_m + config_.see_through_m))
        return Look::nothing;
    }
    passed = true;
  }
  if (!passed) return Look::nothing;
  return from_nowhere ? Look::came_back_from_nowhere : Look::passed;
}

void ObstacleMap::take_out_empty(const Rows& rows, hal::Time now) {
  for (auto entry = cells_.begin(); entry != cells_.end();) {
    Cell& cell = entry->second;
    const Look look = look_at(cell, rows);
    const bool empty = look == Look::passed || (look == Look::came_back_from_nowhere &&
                                                ++cell.misses >= config_.misses_max);
    const double old_s = cell.hidden ? config_.forget_hidden_s : config_.forget_s;
    const bool old = hal::seconds(now - cell.seen) > old_s;
    entry = empty || old ? cells_.erase(entry) : std::next(entry);
  }
}

void ObstacleMap::clear_but_hidden() {
  std::erase_if(cells_, [](const auto& entry) { return !entry.second.hidden; });
}

}  // namespace nav
