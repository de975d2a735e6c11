#include "drivers/site_frame.hpp"

#include <Eigen/Geometry>

namespace drivers {

SiteFrame::SiteFrame(const GeoAnchor& anchor)
    : anchor_(anchor),
      tangent_(anchor.latitude_deg, anchor.longitude_deg, anchor.height_m),
      R_W_enu_(Eigen::Rotation2Dd(anchor.north_rad).toRotationMatrix()) {}

Eigen::Vector3d SiteFrame::to_site(const GeoPoint& point) const {
  Eigen::Vector3d enu_m;
  tangent_.Forward(point.latitude_deg, point.longitude_deg, point.height_m, enu_m.x(), enu_m.y(),
                   enu_m.z());
  enu_m.head<2>() = (R_W_enu_ * enu_m.head<2>()).eval();
  return enu_m;
}

GeoPoint SiteFrame::to_earth(const Eigen::Vector3d& W_point) const {
  const Eigen::Vector2d enu_m = R_W_enu_.transpose() * W_point.head<2>();
  GeoPoint point;
  tangent_.Reverse(enu_m.x(), enu_m.y(), W_point.z(), point.latitude_deg, point.longitude_deg,
                   point.height_m);
  return point;
}

}  // namespace drivers
