// Roads: the generalised Voronoi diagram of the obstacles, pruned to where the robot fits, and the
// shortest ways along it (paper 5.2.1).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "nav/box_tree.hpp"
#include "nav/free_space.hpp"
#include "nav/medial_axis.hpp"

namespace nav {

// Where to drive, from start to goal, in W.
struct Route {
  std::vector<Eigen::Vector2d> points_m;  // At least one.
  std::vector<double> clearance_m;  // Of each piece points_m[i] -> [i + 1], to outline and blocks.
  double length_m{};
  double clearance_min_m = std::numeric_limits<double>::infinity();
};

// Why there is no route.
enum class NoRoute {
  none,           // There is one.
  from_outside,   // The start lies outside the drivable area.
  to_outside,     // The goal does.
  to_too_close,   // The goal is closer to an outline or a block than the robot's radius.
  from_enclosed,  // No way from the start on to any road.
  to_enclosed,    // No way from any road to the goal.
  blocked,        // There was a way before something was blocked.
  not_connected   // The two lie in parts between which the robot does not fit.
};
// In words fit for the operator: "the goal is closer to an obstacle than the robot's radius".
std::string_view name(NoRoute reason);

enum class Smoothing { none, shortcut };

// A road network for one free area and one size of robot. Copies share what building made.
class Roadmap {
 public:
  // Routes keep robot_radius_m from the area's outline, less kSlackM.
  static Roadmap build(const FreeArea& area, double robot_radius_m);

  // Standable polygons, grid and chords are that far off at most: a route may come this much
  // closer than the radius. Give a radius with this added where it matters.
  static constexpr double kSlackM = 0.025;
  // Shortcuts keep this much more than the radius, unless what they replace had less.
  static constexpr double kComfortM = 0.2;

  // The shortest way from start to goal: straight where they see each other with room to spare,
  // else by straight pieces on to the roads, along them (A*) and off again. A start closer to an
  // obstacle than the radius is accepted as long as the way out does not come closer to it.
  //
  // Smoothing::shortcut then replaces parts of the way by straight lines. A shortcut keeps the
  // radius + kComfortM, or the clearance of the part it replaces if that is less. The result is
  // never longer, and never has less clearance than the lesser of the two.
  std::optional<Route> route(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m,
                             NoRoute* why = nullptr,
                             Smoothing smoothing = Smoothing::shortcut) const;

  // Why no way leads from there to each of these, by one search: NoRoute::none where one does.
  std::vector<NoRoute> why_not(const Eigen::Vector2d& from_m,
                               const std::vector<Eigen::Vector2d>& to_m) const;

  // Lengths of the ways between all pairs: row from, column to; infinite where there is none.
  // Dijkstra once per point; without smoothing it equals route(). Symmetric, but for points closer
  // to an obstacle than the radius: such a point can be left, not reached.
  Eigen::MatrixXd lengths_m(const std::vector<Eigen::Vector2d>& points_m,
                            Smoothing smoothing = Smoothing::shortcut) const;

  // The shortest way along the roads that are not blocked, from node to node of graph(). A* heads
  // for the goal, Dijkstra looks all round: the same length, for more nodes searched.
  enum class Search { a_star, dijkstra };
  struct AlongRoads {
    double length_m = std::numeric_limits<double>::infinity();  // Infinite: there is none.
    int nodes_searched{};
  };
  AlongRoads along_roads(int from_node, int to_node, Search search = Search::a_star) const;

  // Distance to the nearest outline or block; 0 inside a block. Says nothing of inside or outside.
  double clearance_m(const Eigen::Vector2d& point_m) const;

  // An obstacle that the map lacks: from now on no route comes closer to it than the robot's radius
  // (less kSlackM). Roads are only closed, not moved: the way round an obstacle in the open
  // may need a new roadmap, built from the drivable area minus the obstacle.
  void block(const Eigen::Vector2d& center_m, double radius_m);
  // The same for an axis-aligned box, such as a voxel seen from above.
  void block_cell(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m);
  void unblock_all();
  // True where a robot at the point would touch something blocked.
  bool blocked(const Eigen::Vector2d& point_m) const;

  // For drawing: the roads as polylines between junctions and dead ends. Each road once.
  std::vector<std::vector<Eigen::Vector2d>> polylines() const;
  const MedialAxis& graph() const& { return fixed_->axis; }
  const MedialAxis& graph() const&& = delete;  // It would outlive its roadmap.
  bool edge_blocked(int edge) const { return edge_blocked_[static_cast<std::size_t>(edge)] != 0; }
  double radius_m() const { return fixed_->radius_m; }
  double length_m() const;  // Of all roads.

 private:
  struct HalfEdge {
    int to{};
    int edge{};
    double length_m{};
  };

  // What building made; never changes.
  struct Fixed {
    double radius_m{};
    Polygons drivable;
    MedialAxis axis;
    std::vector<Segment2> outline_m;
    BoxTree outline_tree;
    BoxTree edge_tree;
    std::vector<int> first_half_edge;  // Of each node, and one past the last.
    std::vector<HalfEdge> half_edges;
  };

  // A box with round corners; a disc is a box of size zero.
  struct Block {
    Eigen::Vector2d min, max;
    double radius_m{};
  };

  // A way from a point on to the roads: to `foot`, which lies on `edge`, `along_m` from its node a.
  struct Link {
    std::vector<Eigen::Vector2d> way_m;  // From the point to the foot.
    double length_m{};
    int edge{};
    double along_m{};
  };

  struct Tree;  // Shortest ways from one point to the nodes.

  void add_block(const Block& block);
  double block_distance(int block, const Segment2& piece_m) const;
  template <class Visit>
  void blocks_near(const Segment2& piece_m, double radius_m, Visit&& visit) const;

  double limit_m() const { return fixed_->radius_m - kSlackM; }
  double comfort_m() const { return fixed_->radius_m + kComfortM; }
  // Least distance along the piece to outline and blocks, or cap_m if that is less.
  double clearance_m(const Segment2& piece_m, double cap_m) const;
  // Whether the piece keeps keep_m from everything, or does not come closer to what `leaving` (a
  // point) is closer to already.
  bool is_free(const Segment2& piece_m, double keep_m,
               const Eigen::Vector2d* leaving = nullptr) const;
  bool sees(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const;

  Segment2 edge_segment(int edge) const;
  std::vector<Link> links(const Eigen::Vector2d& point_m, bool is_start) const;
  std::optional<Link> link_to(const Eigen::Vector2d& point_m, const Eigen::Vector2d* by_m, int edge,
                              bool is_start) const;
  std::vector<int> nearest_edges(const Eigen::Vector2d& point_m, int count) const;
  std::optional<Eigen::Vector2d> climb(const Eigen::Vector2d& point_m) const;

  NoRoute check_ends(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const;
  Link link_at_node(int node) const;
  Tree search(const std::vector<Link>& starts, const std::vector<Link>& goals,
              const Eigen::Vector2d* to_m) const;
  std::optional<std::vector<Eigen::Vector2d>> trace(const Tree& tree,
                                                    const std::vector<Link>& starts,
                                                    const std::vector<Link>& goals) const;
  static NoRoute why_not_joined(const std::vector<Link>& starts, const std::vector<Link>& goals);
  std::optional<std::vector<Eigen::Vector2d>> way(const Eigen::Vector2d& from_m,
                                                  const Eigen::Vector2d& to_m, NoRoute& why) const;
  Route finish(std::vector<Eigen::Vector2d> points_m, Smoothing smoothing) const;

  std::shared_ptr<const Fixed> fixed_;
  std::vector<Block> blocks_;
  BoxTree block_tree_;  // Of the first `in_tree_` blocks; the rest are looked at one by one.
  std::size_t in_tree_ = 0;
  std::vector<char> edge_blocked_;
};

}  // namespace nav
