// What the mission knows of the site in 3-D: the voxel map, what is still worth looking at, and the
// obstacles that the 2-D map lacks. Values only; waits for nothing.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "mission/config.hpp"
#include "mission/density_goal.hpp"
#include "mission/plan.hpp"
#include "mission/record.hpp"
#include "nav/raster.hpp"
#include "planning/next_views.hpp"
#include "planning/running_tally.hpp"
#include "planning/voxel_foliage.hpp"
#include "planning/voxel_map.hpp"

namespace mission {

// The voxel box: x and y hold the boundary, the obstacles and the areas; z from the lowest ground,
// which lies 0.1 voxel below the top of its layer, so that range noise on the ground stays in the
// layer and beams that skim the ground do not carve it.
planning::VoxelGrid voxel_grid(const MissionConfig& config, const nav::SiteMap& map,
                               const std::vector<AreaTask>& tasks);

// Of a scanner that stands upright, height_m above level ground.
Eigen::Isometry3d scanner_pose(const hal::Pose2& pose, double ground_z_m, double height_m);

// A place where a next best view may be taken.
struct ViewCell {
  planning::Voxel voxel;  // Holds the scanner.
  int task{};             // Index into the tasks.
};

struct CellTally {
  ViewCell cell;
  // Boundary unseen, all around; with a density goal also surface voxels to be brought there.
  std::uint32_t voxels{};
};

// A possible next view and how many boundary unseen voxels it counts.
struct NextView {
  ViewCell cell;
  hal::Pose2 pose;
  double ground_z_m{};
  std::uint32_t voxels{};  // With a density goal: and surface voxels that it would bring there.
  // false: pose.heading_rad is not worked out yet, and voxels is what it would see all around.
  bool faced = true;
};

// One of several views to come.
struct ViewAhead {
  ViewCell cell;
  std::uint32_t sees_voxels{};
  std::uint32_t adds_voxels{};  // Seen by none of those before it.
  double heading_rad{};         // Of a scanner that does not see all around.
};

// What one scan did to the model.
struct ScanEffect {
  std::uint64_t points_outside_box{};  // After the box has grown.
  int layers_added{};                  // To the box, because scans saw higher.
  std::vector<Eigen::Vector2d>
      new_obstacles_m;  // Centres of 0.25 m cells that the map has as free.
  // Of such cells whose ground is too steep, or a step, for the robot: new ones.
  std::vector<Eigen::Vector2d> rough_ground_m;

  // Both: where no road leads any more.
  std::vector<Eigen::Vector2d> closed_m() const;
};

class SiteModel {
 public:
  static constexpr double kObstacleCellM = 0.25;

  SiteModel(const MissionConfig& config, const nav::SiteMap& map, std::vector<AreaTask> tasks,
            int threads);
  // Goes on from what an earlier run has seen. Throws std::invalid_argument unless the map's box is
  // voxel_grid() of the same arguments, but for its height.
  SiteModel(const MissionConfig& config, const nav::SiteMap& map, std::vector<AreaTask> tasks,
            int threads, planning::VoxelMap seen);

  // Merges a scan taken from the ground at ground_z_m; T_W_S is the scanner's believed pose and
  // W_points_m the scan's points seen from there (scan_points).
  ScanEffect add(const hal::ScanCloud& scan, const std::vector<Eigen::Vector3f>& W_points_m,
                 const Eigen::Isometry3d& T_W_S, double ground_z_m);

  // Before the first add(): takes up which views another model of the same site has tried and given
  // up, though not what its scans showed.
  void take_up(const SiteModel& before);

  // Every cell that a view may be asked for, and what it counts.
  std::vector<CellTally> tally();
  // The same from the best heading of each cell: what a view there would see.
  std::vector<CellTally> faced_tally();

  // Candidates by gain, best first, ties to the lowest index; those below the threshold are left
  // out. Empty: no view would add enough. best_voxels() tells the maximum all the same.
  // A scanner that does not see all around faces where it sees the most (site_facing.cpp): headings
  // are worked out until the best is known. Then views that see enough come first, and those that
  // might follow, not faced, by what they would see all around.
  std::vector<NextView> next_views();
  // Works out the heading of a view and what it sees then, as the map stands.
  void face(NextView& view) const;
  std::uint64_t best_voxels() const { return best_voxels_; }

  // The next `count` views at once, threshold aside (planning::next_views); `tallies` is tally(),
  // last_tally() that of next_views().
  std::vector<ViewAhead> views_ahead(const std::vector<CellTally>& tallies,
                                     std::size_t count) const;
  const std::vector<CellTally>& last_tally() const { return last_tally_; }

  // Takes note that a view is about to be taken at the cell: what it should resolve.
  void expect(const NextView& view);
  // After add(): how many of the expected voxels are no longer unseen. Those that still are have
  // used up one of their tries; after tries_max they are set aside, so that the mission ends.
  std::uint64_t settle();
  std::uint64_t set_aside() const { return set_aside_; }

  // The frontier within the site's boundary, less what is set aside: what tally() counts.
  std::vector<planning::BoundaryVoxel> worth_seeing() const;

  // Which voxels are set aside, as index x + nx (y + ny z), and the same taken up again.
  std::vector<std::uint64_t> voxels_set_aside() const;
  void set_aside(const std::vector<std::uint64_t>& voxels);
  // Likewise the surface voxels that views did not bring to the density goal, and what views look
  // through though it is seen-occupied: foliage.
  std::vector<std::uint64_t> thin_set_aside() const;
  std::vector<std::uint64_t> foliage() const;
  // With the map of an earlier run: takes up the foliage that it found, if that is asked for, and
  // which surfaces its scans brought to the density goal.
  void restore(const std::vector<std::uint64_t>& foliage,
               const std::vector<DensityGoal::PastScan>& scans,
               const std::vector<std::uint64_t>& thin_set_aside);

  // Never ask for a view from this cell again; or do, after all.
  void exclude(const planning::Voxel& cell);
  void include(const planning::Voxel& cell);

  VoxelCounts counts() const;
  // Whether any view could still help, and what none can see (site_leftover.cpp). Several tallies.
  Leftover leftover() const;
  // The boundary unseen voxels that leftover() counts as never visible.
  std::vector<planning::Voxel> never_visible_voxels() const;
  DensityFacts density() const { return density_.facts(); }
  // Grows in z when at least kReturnsToGrow points lie in a layer above the box or higher, up to
  // [phase2] height_max_m. What is then in it, and everything derived from it, is as if the box had
  // been this high from the start.
  const planning::VoxelMap& map() const { return map_; }
  static constexpr std::uint64_t kReturnsToGrow = 10;
  // Of all scans, with the box as it is now.
  std::uint64_t points_outside_box() const { return points_outside_; }
  std::uint64_t points_above_box() const;
  // The map as views look through it: without foliage, if that is asked for.
  const planning::VoxelMap& planner_map() const { return see_through_ ? *see_through_ : map_; }
  // Of everything kept per voxel.
  std::size_t voxel_bytes() const;
  const std::vector<ViewCell>& cells() const { return cells_; }
  Eigen::Vector3d cell_position_m(const ViewCell& cell) const;
  // That scans showed to be too steep for the robot, or a step.
  double rough_ground_m2() const;

 private:
  static constexpr int kTriesMax = 2;

  void find_cells();
  void find_ground(const nav::RasterGrid& columns);
  void restore_ground();
  int grow(const planning::InsertReport& report);
  void look_through();
  void find_boundary();
  std::vector<NextView> faced(std::vector<NextView> views);
  std::vector<planning::Voxel> worth_in_sight(const std::vector<planning::BoundaryVoxel>& worth,
                                              const planning::Voxel& cell) const;
  std::vector<planning::Voxel> unseen_in_sight(const std::vector<planning::BoundaryVoxel>& worth,
                                               const planning::Voxel& cell) const;
  std::vector<planning::Voxel> standing_cells() const;
  std::uint64_t number_of(const planning::Voxel& v) const;
  planning::Voxel numbered(std::uint64_t number) const;
  bool is_in_site(const planning::Voxel& v) const;
  bool is_set_aside(const planning::Voxel& v) const;
  void note_ground(const std::vector<Eigen::Vector3f>& W_points_m,
                   const Eigen::Vector2d& W_scanner_m, double ground_z_m, ScanEffect& effect);
  void note_obstacle(const Eigen::Vector3f& W_point_m, double ground_z_m, ScanEffect& effect);

  const MissionConfig config_;
  const std::vector<AreaTask> tasks_;
  const int threads_;
  planning::VoxelMap map_;
  planning::RunningTally tally_;
  std::vector<planning::BoundaryVoxel> boundary_;  // Within the site's boundary only.
  std::vector<std::uint8_t> in_site_;              // Per column of voxels.
  std::vector<planning::WallLine> walls_;          // Of the map.
  std::vector<planning::Voxel> ground_;            // Hold the mapped ground; never seen-empty.
  std::vector<ViewCell> cells_;
  std::map<planning::Voxel, int> tries_;      // Of those that a view did not resolve.
  std::vector<std::uint8_t> excluded_;        // Per cells_ index.
  std::vector<std::uint64_t> returns_above_;  // [z]: of all scans, above the box at first.
  std::uint64_t points_outside_{};
  std::optional<planning::BeamCounts> beams_;      // Only for [phase2] foliage.
  std::optional<planning::VoxelMap> see_through_;  // The same.
  std::vector<planning::Voxel> expected_;
  DensityGoal density_;
  std::vector<CellTally> last_tally_;
  std::uint64_t best_voxels_{};
  std::uint64_t set_aside_{};

  nav::RasterGrid obstacle_grid_;
  std::vector<std::uint8_t> open_;   // 1 where the map says free, well away from every known wall.
  std::vector<std::uint8_t> hits_;   // Points seen there at the height of the robot, up to 255.
  std::vector<std::uint8_t> rough_;  // 1 where the robot cannot drive for the ground.
};

}  // namespace mission
