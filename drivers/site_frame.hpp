// Where the site frame W lies on the earth.
#pragma once

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>

namespace drivers {

// W's origin on the WGS84 ellipsoid, and how W is turned against north.
struct GeoAnchor {
  double latitude_deg{}, longitude_deg{};
  double height_m{};   // Above the ellipsoid.
  double north_rad{};  // Where true north lies in W: counter-clockwise from the y axis.
};

struct GeoPoint {
  double latitude_deg{}, longitude_deg{}, height_m{};  // North, east, above the ellipsoid.
};

// W's z axis is the ellipsoid's normal at the anchor.
class SiteFrame {
 public:
  explicit SiteFrame(const GeoAnchor& anchor);

  Eigen::Vector3d to_site(const GeoPoint& point) const;
  GeoPoint to_earth(const Eigen::Vector3d& W_point) const;
  const GeoAnchor& anchor() const { return anchor_; }

 private:
  GeoAnchor anchor_;
  GeographicLib::LocalCartesian tangent_;
  Eigen::Matrix2d R_W_enu_;
};

}  // namespace drivers
