// Reads footprint.geojson for the tests of the shipped sites. Shares no code with the program that
// made it.
#pragma once

#include <boost/json.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nav/geometry.hpp"
#include "nav/polygons.hpp"

namespace tools_test {

struct MapRegion {
  nav::Polygons area;
  double ground_z_m{};
};

struct Footprint {
  nav::Polygons boundary;
  nav::Polygons obstacles;                     // United.
  std::map<std::string, nav::Polygons> named;  // Obstacles one by one; equal names united.
  std::map<std::string, MapRegion> regions;
  std::vector<nav::Ring> targets;  // Lines.
  std::optional<nav::PointMm> start;
  int rings_left_open = 0;
  int vertices_repeated = 0;
};

inline nav::PointMm point_of(const boost::json::value& position) {
  const auto number = [&](std::size_t i) { return position.at(i).to_number<double>(); };
  return nav::to_mm({number(0), number(1)});
}

inline nav::Ring line_of(const boost::json::value& positions) {
  nav::Ring line;
  for (const auto& position : positions.as_array()) line.push_back(point_of(position));
  return line;
}

inline nav::Polygons polygons_of(const boost::json::value& geometry, Footprint& footprint) {
  std::vector<nav::Ring> rings;
  for (const auto& positions : geometry.at("coordinates").as_array()) {
    nav::Ring& ring = rings.emplace_back(line_of(positions));
    if (ring.front() == ring.back()) {
      ring.pop_back();
    } else {
      ++footprint.rings_left_open;
    }
    for (std::size_t i = 1; i < ring.size(); ++i)
      footprint.vertices_repeated += ring[i] == ring[i - 1];
  }
  return nav::normalise(rings);
}

inline void add_feature(const boost::json::value& feature, Footprint& footprint) {
  const auto& properties = feature.at("properties");
  const auto& geometry = feature.at("geometry");
  const std::string role = properties.at("role").as_string().c_str();
  const std::string name = properties.at("name").as_string().c_str();
  if (role == "boundary") {
    footprint.boundary = polygons_of(geometry, footprint);
  } else if (role == "obstacle") {
    nav::Polygons& named = footprint.named[name];
    named = nav::unite(named, polygons_of(geometry, footprint));
  } else if (role == "region") {
    footprint.regions[name] = {polygons_of(geometry, footprint),
                               properties.at("ground_z_m").to_number<double>()};
  } else if (role == "target") {
    footprint.targets.push_back(line_of(geometry.at("coordinates")));
  } else if (role == "start") {
    footprint.start = point_of(geometry.at("coordinates"));
  } else if (role != "keep_out") {
    throw std::runtime_error("unknown role " + role);
  }
}

inline Footprint read_footprint(const std::filesystem::path& file) {
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const boost::json::value json = boost::json::parse(text);
  Footprint footprint;
  for (const auto& feature : json.at("features").as_array()) add_feature(feature, footprint);
  std::vector<nav::Polygons> all;
  for (const auto& [name, polygons] : footprint.named) all.push_back(polygons);
  footprint.obstacles = nav::unite(all);
  return footprint;
}

// Where something without size could be: the region inside the boundary, without the obstacles.
inline nav::Polygons free_space(const Footprint& footprint, const MapRegion& region) {
  return nav::subtract(nav::intersect(region.area, footprint.boundary), footprint.obstacles);
}

}  // namespace tools_test
