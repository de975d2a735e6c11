// What a scanner saw, by direction: tells a point that stands where the scanner looked through from
// one that it could not see.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace nav {

// Of points as one scanner at the origin saw them.
class RangeImage {
 public:
  explicit RangeImage(std::span<const Eigen::Vector3f> points_m);

  enum class Sight { unknown, agrees, in_front, behind };
  // in_front: everything that was seen near this direction is clearly farther away, so that the
  // scanner would have seen the point. unknown: nothing was seen there.
  Sight look(const Eigen::Vector3f& point_m) const;

 private:
  struct Bin {
    float near_m, far_m;
  };
  Bin around(int row, int column) const;

  std::vector<Bin> bins_;
};

}  // namespace nav
