// People who walk about on the site: upright cylinders on a way of their own. They look where they
// go, but no farther than a step: a robot that does not stop for them runs into them.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace sim {

struct Person {
  std::vector<Eigen::Vector2d> way_m;  // At least one point, in W; there and back for ever.
  double speed_mps = 1.2;
  double radius_m = 0.25;
  double height_m = 1.75;
  double start_s = 0;  // Stands at the beginning of the way for so long.
};

class Walker {
 public:
  explicit Walker(Person person) : person_(std::move(person)), at_m_(person_.way_m.front()) {}

  // How near to a robot's rim somebody walks on: one that moves, and one that stands.
  static constexpr double kStepsAsideM = 0.9, kPassesM = 0.3;
  static constexpr double kPatienceS = 3;  // Then turns round.

  void walk(double span_s, const Eigen::Vector2d& robot_m, double robot_radius_m, bool robot_moves);
  // Where a robot is put: goes on along the way, at once, until a standing one is passed.
  void make_room(const Eigen::Vector2d& robot_m, double robot_radius_m);
  // Along a ray (unit direction) whose origin is given above the ground; infinite: not met.
  double range_m(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;
  // The same along many rays from one origin: lowers those of ranges_m that are longer.
  void shorten(const Eigen::Vector3d& from, std::span<const Eigen::Vector3d> directions,
               std::span<double> ranges_m) const;

  const Eigen::Vector2d& position_m() const { return at_m_; }
  const Person& person() const { return person_; }

 private:
  void turn_round();

  Person person_;
  Eigen::Vector2d at_m_;
  double walked_s_ = 0, waited_s_ = 0;
  int next_ = 0;  // Point of the way.
  int step_ = 1;  // 1: there; -1: back.
};

}  // namespace sim
