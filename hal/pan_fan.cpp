#include "hal/pan_fan.hpp"

namespace hal {

void FanAim::column(double pan_rad, std::span<Beam> beams) const {
  double c = std::cos(pan_rad), s = std::sin(pan_rad);
  const auto turned = [&](const Eigen::Vector3d& p) -> Eigen::Vector3f {
    return Eigen::Vector3d(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()).cast<float>();
  };
  for (std::size_t row = 0; row < fan_.P_directions.size(); ++row) {
    beams[row].S_direction = turned(fan_.P_directions[row]);
    beams[row].S_origin_m = turned(fan_.P_origin_m);
    const double next = c * cos_row_ - s * sin_row_;
    s = s * cos_row_ + c * sin_row_;
    c = next;
  }
}

std::vector<Beam> beams_of(const PanFan& fan) {
  const FanAim aim(fan);
  const std::size_t rows = fan.P_directions.size();
  std::vector<Beam> beams;
  beams.reserve(fan.beams());
  for (const double pan_rad : fan.pan_rad) {  // Each column while it is in the cache.
    beams.resize(beams.size() + rows);
    aim.column(pan_rad, std::span(beams).last(rows));
  }
  return beams;
}

}  // namespace hal
