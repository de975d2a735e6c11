#include "mission/geojson_crs.hpp"

#include <fmt/format.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace mission {
namespace {

template <class Feature, class Visit>
void for_each_position(Feature& feature, Visit visit) {
  for (auto& polygon : feature.polygons_m) {
    for (auto& ring : polygon) {
      for (auto& p : ring) visit(p);
    }
  }
  for (auto& line : feature.lines_m) {
    for (auto& p : line) visit(p);
  }
  if (feature.point_m) visit(*feature.point_m);
}

bool on_globe(const Eigen::Vector2d& lon_lat) {
  return std::abs(lon_lat.x()) <= 180 && std::abs(lon_lat.y()) <= 90;
}

}  // namespace

std::optional<Crs> crs_named(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c))) {
      plain += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  if (plain == "LOCAL") return Crs::local;
  constexpr std::array kWgs84{"WGS84",
                              "CRS84",
                              "OGCCRS84",
                              "URNOGCDEFCRSOGC13CRS84",
                              "EPSG4326",
                              "EPSG4979",
                              "OGC84",
                              "URNOGCDEFCRSOGCCRS84",
                              "URNOGCDEFCRSEPSG4326",
                              "URNOGCDEFCRSEPSG4979",
                              "HTTPWWWOPENGISNETDEFCRSOGC13CRS84"};
  if (std::find(kWgs84.begin(), kWgs84.end(), plain) != kWgs84.end()) return Crs::wgs84;
  return std::nullopt;
}

bool looks_like_degrees(const nav::RawSite& site) {
  Eigen::Vector2d min(1e300, 1e300);
  Eigen::Vector2d max(-1e300, -1e300);
  bool globe = true;
  for (const nav::RawFeature& feature : site.features) {
    for_each_position(feature, [&](const Eigen::Vector2d& p) {
      globe = globe && on_globe(p);
      min = min.cwiseMin(p);
      max = max.cwiseMax(p);
    });
  }
  const Eigen::Vector2d extent = max - min;
  return globe && extent.minCoeff() >= 0 && extent.maxCoeff() > 0 && extent.maxCoeff() < 1;
}

std::optional<Eigen::Vector2d> first_position(const nav::RawSite& site) {
  std::optional<Eigen::Vector2d> first;
  for (const nav::RawFeature& feature : site.features) {
    for_each_position(feature, [&](const Eigen::Vector2d& p) {
      if (!first) first = p;
    });
  }
  return first;
}

std::vector<std::string> to_local(nav::RawSite& site, const GeoOrigin& origin) {
  const GeographicLib::LocalCartesian tangent(origin.lat_deg, origin.lon_deg, origin.h_m);
  std::vector<std::string> errors;
  for (nav::RawFeature& feature : site.features) {
    std::optional<Eigen::Vector2d> off;
    for_each_position(feature, [&](Eigen::Vector2d& p) {
      if (!on_globe(p)) {
        off = off.value_or(p);
        return;
      }
      double x_m = 0;
      double y_m = 0;
      double z_m = 0;
      tangent.Forward(p.y(), p.x(), origin.h_m, x_m, y_m, z_m);
      p = {x_m, y_m};
    });
    if (!off) continue;
    errors.push_back(fmt::format(
        "{}: ({}, {}) is no longitude and latitude in degrees; for metres write \"crs\": \"local\"",
        feature.where, off->x(), off->y()));
  }
  return errors;
}

}  // namespace mission
