// What a scanner that looks level, or with rows of beams above each other, shows around the robot
// while it drives, and how fast that lets it go. Pure: profiles, poses and times in, points and
// speeds out.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hal/turns.hpp"
#include "hal/values.hpp"
#include "nav/follow.hpp"

namespace nav {

// A turn with rows of beams, and how the body went while it was measured.
struct MovingTurn {
  hal::Turn turn;
  double height_m{};           // Of S, which stands over the body's middle, above the ground.
  hal::Pose2 W_first, W_last;  // The body as believed at the first and at the last column.
};

struct ObstacleMapConfig {
  double cell_m = 0.1;
  double reach_m = 6.0;         // Farther returns are no concern yet.
  double range_min_m = 0.05;    // Nearer ones are the scanner's own window.
  int hits_min = 2;             // Of a cell, until it counts: one is dust or rain.
  double see_through_m = 0.15;  // A beam that goes on so far beyond a cell has found it empty.
  int misses_max = 5;           // Beams at a cell that came back from nowhere, until it is empty.
  double forget_s = 10;         // What nothing looked at any more for so long.
  // Of turns with rows. Heights are above the ground under the robot, in its own plane.
  double blind_m = 0;            // Nearer than this the scanner measures nothing: no news there.
  double ground_m = 0.15;        // What ends lower is ground, which may rise
  double ground_rise = 0.05;     // so much a metre;
  double top_m = 1.5;            // what ends higher the robot drives under.
  double inside_m = 0.02;        // A beam tells that a thing has gone where it passes through it
                                 // so far below its top as seen, and not under it.
  double forget_hidden_s = 120;  // What stands too low or too near for any beam to look at it.
};

// At most one point per cell, so at most (2 reach / cell)^2.
class ObstacleMap {
 public:
  explicit ObstacleMap(const ObstacleMapConfig& config = {}) : config_(config) {}

  // One turn, measured level at W_scanner (its x axis along the heading). Returns within reach
  // become points; points through which beams went are taken out, and so are old ones.
  void add(const hal::Profile& profile, const hal::Pose2& W_scanner, hal::Time now);
  // One turn with rows, each beam from where the robot was. A beam takes out only what was seen at
  // the height at which it passes: what it passes over may stand there still.
  void add(const MovingTurn& seen, hal::Time now);
  void clear() { cells_.clear(); }
  // But for what the latest turn with rows could not look at: it is not going to be seen anew.
  void clear_but_hidden();

  // The latest return of each cell that counts, in W; the order depends on nothing but their
  // places.
  std::vector<Eigen::Vector2d> points_m() const;

 private:
  struct Cell {
    Eigen::Vector2d W_point_m;
    int hits{}, misses{};
    hal::Time seen{};
    double low_m{}, high_m{};  // Of its returns, above the ground; of turns with rows.
    bool hidden{};             // From all rows of the latest turn.
  };
  using Cells = std::map<std::pair<int, int>, Cell>;
  // What the beams at a cell say of it.
  enum class Look { nothing, passed, came_back_from_nowhere };
  Look look_at(const Cell& cell, const hal::Profile& profile, const hal::Pose2& W_scanner) const;
  void take_out_empty(const hal::Profile& profile, const hal::Pose2& W_scanner, hal::Time now);
  struct Rows;
  Look look_at(Cell& cell, const Rows& rows) const;
  void take_out_empty(const Rows& rows, hal::Time now);
  void put(const Rows& rows, std::size_t row, hal::Time now);
  // `latest`: the cell of the return before, or the end.
  Cell& hit(const Eigen::Vector2d& W_point_m, const Eigen::Vector2d& W_from_m, hal::Time now,
            Cells::iterator& latest);

  const ObstacleMapConfig config_;
  Cells cells_;
};

struct ZoneConfig {
  double robot_radius_m = 0.5;
  double keep_m = 0.03;       // Beside: what comes nearer than this is in the way.
  double stop_gap_m = 0.3;    // Ahead: what the robot leaves when it stops.
  double end_slack_m = 0.1;   // But not of what would touch it just before the path's end.
  double touch_gap_m = 0.04;  // The same of what is ahead only because of how it turns.
  double reaction_s = 0.45;   // From a person's step to the wheels' braking, at the worst.
  double brake_max_mps2 = 0.6;
  double horizon_m = 2.5;      // Looked ahead; the braking distance from full speed and more.
  double slow_beside_m = 0.4;  // What is nearer than this beside the way slows the robot down,
  double slow_mps = 0.4;       // to no less than this.
};

struct Zones {
  double cap_mps = std::numeric_limits<double>::infinity();
  bool stop{};                                // The robot has to stand.
  std::optional<Eigen::Vector2d> W_in_way_m;  // What is in the way, within the horizon.
};

// The fastest speed from which the robot, `reaction` late, still stops within the distance.
double stopping_speed_mps(const ZoneConfig& config, double distance_m);

// Looks along the path from progress_m on, and along the arc of the twist as far as the robot runs
// until it stands. What lies behind the path's end is not in the way, nor is what the robot gets
// away from.
Zones look_ahead(const ZoneConfig& config, std::span<const Eigen::Vector2d> W_obstacles_m,
                 const Path& path, double progress_m, const hal::Pose2& pose,
                 const hal::Twist& twist);

}  // namespace nav
