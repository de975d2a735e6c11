#include "sim/pan_motion.hpp"

#include <algorithm>
#include <cmath>

namespace sim {

PanMotion PanMotion::standing(double at) {
  PanMotion motion;
  motion.start_ = motion.target_ = at;
  return motion;
}

PanMotion PanMotion::stopping(hal::Time begin, double at, double speed, double acceleration) {
  PanMotion motion;
  motion.begin_ = begin;
  motion.start_ = at;
  motion.start_speed_ = speed;
  motion.target_ = at + speed * std::abs(speed) / (2 * acceleration);
  motion.parts_[2] = {std::abs(speed) / acceleration, speed > 0 ? -acceleration : acceleration};
  motion.close();
  return motion;
}

PanMotion::PanMotion(hal::Time begin, double at, double speed, double target, double speed_max,
                     double acceleration)
    : begin_(begin), start_(at), start_speed_(speed), target_(target) {
  set_out(speed, speed_max, acceleration);
  close();
}

// Upwards is the direction in which it must go on from where it could stop.
void PanMotion::set_out(double speed, double speed_max, double acceleration) {
  const double stop = start_ + speed * std::abs(speed) / (2 * acceleration);
  const double up = target_ >= stop ? 1 : -1;
  const double way = up * (target_ - start_), from = up * speed;
  const double peak =
      std::min(speed_max, std::sqrt(std::max(0.0, acceleration * way + from * from / 2)));
  const double change = from <= peak ? acceleration : -acceleration;
  const double first_s = (peak - from) / change, last_s = peak / acceleration;
  const double covered = (peak * peak - from * from) / (2 * change) + peak * last_s / 2;
  const double cruise_s = peak > 0 ? std::max(0.0, (way - covered) / peak) : 0;
  parts_ = {Part{first_s, up * change}, Part{cruise_s, 0}, Part{last_s, -up * acceleration}};
}

void PanMotion::close() {
  double sum_s = 0;
  for (const Part& part : parts_) sum_s += part.duration_s;
  end_ = begin_ + hal::from_seconds(sum_s);
}

PanMotion::State PanMotion::state(hal::Time time) const {
  if (time >= end_) return {target_, 0};
  State now{start_, start_speed_};
  double left_s = std::max(0.0, hal::seconds(time - begin_));
  for (const Part& part : parts_) {
    const double t = std::min(left_s, part.duration_s);
    now.at += now.speed * t + part.acceleration * t * t / 2;
    now.speed += part.acceleration * t;
    left_s -= t;
  }
  return now;
}

double PanMotion::at(hal::Time time) const {
  return state(time).at;
}
double PanMotion::speed(hal::Time time) const {
  return state(time).speed;
}

}  // namespace sim
