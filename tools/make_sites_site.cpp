#include "tools/make_sites_site.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sites {
namespace {

std::string position(const Eigen::Vector2d& p) {
  const nav::PointMm mm = nav::to_mm(p);
  return "[" + metres_text(mm.x) + ", " + metres_text(mm.y) + "]";
}

std::string positions(const Path& path, bool close) {
  std::string text = "[";
  for (const Eigen::Vector2d& p : path) text += (text.size() > 1 ? ", " : "") + position(p);
  if (close) text += ", " + position(path.front());
  return text + "]";
}

std::string geometry(const Feature& feature) {
  if (feature.point) {
    return R"({"type": "Point", "coordinates": )" + position(*feature.point) + "}";
  }
  if (!feature.line.empty()) {
    return R"({"type": "LineString", "coordinates": )" + positions(feature.line, false) + "}";
  }
  std::string rings;
  for (const Path& ring : feature.rings) {
    const bool hole = !rings.empty();  // Holes are authored like outlines and written clockwise.
    rings += (hole ? ", " : "") + positions(hole ? reversed(ring) : ring, !feature.left_open);
  }
  return R"({"type": "Polygon", "coordinates": [)" + rings + "]}";
}

std::string properties(const Feature& feature) {
  std::string text = fmt::format(R"({{"role": "{}", "name": "{}")", feature.role, feature.name);
  if (feature.role == "boundary") text += fmt::format(R"(, "wall": {})", feature.wall);
  if (feature.ground_z_m) text += fmt::format(R"(, "ground_z_m": {:.1f})", *feature.ground_z_m);
  if (feature.heading_deg) text += fmt::format(R"(, "heading_deg": {:.1f})", *feature.heading_deg);
  return text + "}";
}

std::string geojson(const Site& site) {
  std::string text = fmt::format(
      "{{\"type\": \"FeatureCollection\", \"name\": \"{}\", \"features\": [\n", site.name);
  for (std::size_t i = 0; i < site.features.size(); ++i) {
    const Feature& feature = site.features[i];
    text += R"({"type": "Feature", "properties": )" + properties(feature) +
            ",\n \"geometry\": " + geometry(feature) +
            (i + 1 < site.features.size() ? "},\n" : "}\n");
  }
  return text + "]}\n";
}

// What the table says about all solids of one name.
struct PartSummary {
  std::string name;
  bool closed{};
  int solids{};
  std::size_t triangles{};
  std::int64_t low_mm[3]{}, high_mm[3]{};
};

void include(PartSummary& part, const Solid& solid) {
  const bool first = part.solids == 0;
  part.closed = solid.closed;
  ++part.solids;
  part.triangles += solid.triangles.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax_element(solid.vertices_mm.begin(), solid.vertices_mm.end(),
                            [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    part.low_mm[axis] = first ? (*low)[axis] : std::min(part.low_mm[axis], (*low)[axis]);
    part.high_mm[axis] = first ? (*high)[axis] : std::max(part.high_mm[axis], (*high)[axis]);
  }
}

std::vector<PartSummary> parts_of(const Site& site) {
  std::vector<PartSummary> parts;
  for (const Solid& solid : site.model.solids()) {
    auto found = std::find_if(parts.begin(), parts.end(),
                              [&](const PartSummary& part) { return part.name == solid.part; });
    if (found == parts.end()) {
      parts.push_back({.name = solid.part});
      found = parts.end() - 1;
    }
    include(*found, solid);
  }
  return parts;
}

std::string short_metres(std::int64_t millimetres) {
  return fmt::format("{:.1f}", static_cast<double>(millimetres) / 1000);
}

std::string parts_table(const Site& site) {
  std::string text =
      "| part | x (m) | y (m) | z (m) | solids | triangles |\n|---|---|---|---|---:|---:|\n";
  for (const PartSummary& part : parts_of(site)) {
    text += "| " + part.name + (part.closed ? "" : " (open surface)") + " | ";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      text += short_metres(part.low_mm[axis]) + " to " + short_metres(part.high_mm[axis]) + " | ";
    }
    text += fmt::format("{} | {} |\n", part.solids, part.triangles);
  }
  return text;
}

std::string map_table(const Site& site) {
  std::string text = "| role | name | corners | note |\n|---|---|---:|---|\n";
  for (const Feature& feature : site.features) {
    std::size_t corners = feature.line.size() + (feature.point ? 1 : 0);
    for (const Path& ring : feature.rings) corners += ring.size();
    std::string note;
    if (feature.rings.size() > 1) note += "with a hole ";
    if (feature.wall) note += "its edge is a wall ";
    if (feature.left_open) note += "ring left open ";
    if (feature.ground_z_m) note += fmt::format("ground at {:.1f} m ", *feature.ground_z_m);
    if (feature.heading_deg) note += fmt::format("heading {:.0f} deg ", *feature.heading_deg);
    text += fmt::format("| {} | {} | {} | {}|\n", feature.role, feature.name, corners, note);
  }
  return text;
}

std::string site_readme(const Site& site) {
  std::size_t triangles = 0;
  for (const Solid& solid : site.model.solids()) triangles += solid.triangles.size();
  return fmt::format(
      "# {}: {}\n\n{}\n## Map (`footprint.geojson`)\n\nLocal metres, x east, y north.\n\n{}\n"
      "## Model (`model.obj`)\n\nMetres, z up, {} triangles. Every part is closed and faces "
      "outward, "
      "except where it says open surface.\n\n{}\nMade by `make_sites`; do not edit by hand.\n",
      site.name, site.title, site.about, map_table(site), triangles, parts_table(site));
}

}  // namespace

Feature& Site::add(const std::string& role, const std::string& what) {
  Feature& feature = features.emplace_back();
  feature.role = role;
  feature.name = what;
  return feature;
}

void Site::region(const std::string& what, const Shape& area, double ground_z_m) {
  Feature& feature = add("region", what);
  feature.rings = {area.outer};
  feature.rings.insert(feature.rings.end(), area.holes.begin(), area.holes.end());
  feature.ground_z_m = ground_z_m;
}

void Site::boundary(const Path& outline, bool wall) {
  Feature& feature = add("boundary", "boundary");
  feature.rings = {outline};
  feature.wall = wall;
}

void Site::start(Eigen::Vector2d point, double heading_deg) {
  Feature& feature = add("start", "start");
  feature.point = point;
  feature.heading_deg = heading_deg;
}

void write_site(const Site& site, Files& files) {
  files[site.name + "/footprint.geojson"] = geojson(site);
  files[site.name + "/model.obj"] = site.model.obj(site.name + ": " + site.title);
  files[site.name + "/README.md"] = site_readme(site);
}

std::string sites_readme(const std::vector<Site>& sites) {
  std::string text =
      "# Sites that ship with Vantage\n\nAuthored by us after the places of the paper (Blaer and "
      "Allen 2009); no measurement of the real buildings went into them.\n\n"
      "| site | what | triangles |\n|---|---|---:|\n";
  for (const Site& site : sites) {
    std::size_t triangles = 0;
    for (const Solid& solid : site.model.solids()) triangles += solid.triangles.size();
    text += fmt::format("| [{0}]({0}/README.md) | {1} | {2} |\n", site.name, site.title, triangles);
  }
  return text +
         "\nEach folder holds `footprint.geojson` (the map the planner gets, metres, with the "
         "faults "
         "of real maps where its README says so), `model.obj` (the truth that the simulation "
         "scans, "
         "ground included) and a README.\n\nAll of it is made by one program and checked byte for "
         "byte by a test:\n\n```sh\nmake_sites configs/sites          # write\n"
         "make_sites --check configs/sites  # compare, exit 1 when something differs\n```\n";
}

}  // namespace sites
