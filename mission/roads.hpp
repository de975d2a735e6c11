// The roads of one area as the mission knows them now: the map's, less the obstacles met since.
#pragma once

#include <map>
#include <vector>

#include "nav/free_space.hpp"
#include "nav/roadmap.hpp"

namespace mission {

class Roads {
 public:
  Roads(nav::FreeArea area, double robot_radius_m);

  // Obstacles that the map lacks, as squares around their centres. The roadmap is built anew
  // without them, so that roads lead round them. `scan`: the number of the scan that shows them;
  // kNoScan: the robot met them.
  static constexpr int kNoScan = 0;
  void close(const std::vector<Eigen::Vector2d>& centers_m, double side_m, int scan = kNoScan);
  // What the scans show now, by their numbers, in place of all that scans showed before: what one
  // that stood elsewhere than believed had closed is open again.
  void close_anew(const std::map<int, std::vector<Eigen::Vector2d>>& centers_m, double side_m);
  // The same for what may go away again, until reopen(). What is closed there for the third time
  // is closed for good, so that nothing is tried for ever.
  void close_for_now(const std::vector<Eigen::Vector2d>& centers_m, double side_m);
  bool reopen();  // False: nothing was closed for now.
  bool is_closed_for_now() const { return !closed_for_now_.empty(); }
  // So often roads changed because something was open again.
  int openings() const { return openings_; }

  const nav::FreeArea& area() const { return area_; }
  const nav::Polygons& mapped() const { return mapped_; }  // Drivable as the map has it.
  const nav::Roadmap& roadmap() const { return roadmap_; }

 private:
  struct Closing {
    int scan{};  // Who caused it.
    nav::Polygons squares;
  };
  void close_for_good(int scan, const std::vector<Eigen::Vector2d>& centers_m, double side_m);
  bool rebuild();  // False: the roads are as they were.

  nav::FreeArea area_;
  nav::Polygons mapped_;
  nav::Polygons open_;             // Drivable but for what is closed for now.
  std::vector<Closing> closings_;  // What open_ lacks, in the order in which it came.
  nav::Polygons closed_for_now_, closed_once_, closed_twice_;
  int openings_{};
  double robot_radius_m_;
  nav::Roadmap roadmap_;
};

}  // namespace mission
