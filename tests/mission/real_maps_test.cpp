// Maps and models of real places, drawn by others: each goes from file to roads, and nothing that
// repair changes is kept quiet. They lie beside the project.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "mission/site_io.hpp"
#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "nav/rings.hpp"
#include "nav/roadmap.hpp"
#include "planning/cover.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;

const fs::path kData = VANTAGE_SOURCE_DIR "/../shared/data";
constexpr double kRadiusM = 0.5;

// Outlines of what stands on the ground; cuts through models are not maps.
std::vector<fs::path> real_maps() {
  std::vector<fs::path> files;
  for (const char* folder : {"maps", "models"}) {
    if (!fs::exists(kData / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(kData / folder))
      if (entry.path().extension() == ".geojson" && entry.path().stem() != "slice")
        files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Area of the rings as drawn, holes off, each polygon for itself.
double drawn_area_m2(const nav::RawSite& raw) {
  const auto ring_area_m2 = [](const std::vector<Eigen::Vector2d>& ring) {
    double twice = 0;
    for (std::size_t i = 0; i < ring.size(); ++i)
      twice += nav::cross2(ring[i] - ring[0], ring[(i + 1) % ring.size()] - ring[0]);
    return std::abs(twice) / 2;
  };
  double sum_m2 = 0;
  for (const auto& feature : raw.features) {
    if (feature.role != nav::Role::obstacle) continue;
    for (const auto& polygon : feature.polygons_m)
      for (std::size_t i = 0; i < polygon.size(); ++i)
        sum_m2 += (i == 0 ? 1 : -1) * ring_area_m2(polygon[i]);
  }
  return sum_m2;
}

// Whether repair owns up to having changed the obstacles.
bool tells_of_obstacles(const nav::RepairedSite& site) {
  return std::any_of(site.repairs.begin(), site.repairs.end(), [](const nav::Repair& repair) {
    return repair.what.find("draws no boundary") == std::string::npos;
  });
}

void expect_roads_fit(const nav::RepairedSite& site) {
  for (const nav::FreeArea& area : nav::free_areas(site.map, kRadiusM, 1)) {
    EXPECT_FALSE(planning::walls_of(site.map, area).empty());
    const nav::Roadmap roadmap = nav::Roadmap::build(area, kRadiusM);
    const auto& graph = roadmap.graph();
    EXPECT_FALSE(graph.edges.empty()) << area.name;
    for (std::size_t i = 0; i < graph.nodes_m.size(); ++i) {
      EXPECT_GE(graph.clearance_m[i], kRadiusM - nav::Roadmap::kSlackM);
      EXPECT_TRUE(nav::contains(area.drivable, nav::to_mm(graph.nodes_m[i])));
    }
  }
}

TEST(RealMaps, GoFromFileToRoadsAndRepairsAreTold) {
  const auto files = real_maps();
  if (files.empty()) GTEST_SKIP() << "no maps at " << kData;
  EXPECT_GE(files.size(), 10u);
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.lexically_relative(kData).string());
    const LoadedSite loaded = load_site(file);
    ASSERT_TRUE(loaded.errors.empty()) << loaded.errors.front();
    const nav::RepairedSite site = nav::repair_site(loaded.raw, 20);
    ASSERT_TRUE(site.errors.empty()) << site.errors.front();
    const double drawn_m2 = drawn_area_m2(loaded.raw), kept_m2 = area_m2(site.map.obstacles);
    const double perimeter_m = nav::perimeter_m(site.map.obstacles);
    const bool changed = std::abs(drawn_m2 - kept_m2) > nav::kAreaToleranceM2 + 0.002 * perimeter_m;
    EXPECT_TRUE(!changed || tells_of_obstacles(site)) << drawn_m2 << " -> " << kept_m2;
    EXPECT_TRUE(nav::contacts(nav::edges(site.map.obstacles)).empty());
    expect_roads_fit(site);
    std::printf("%-55s %5zu edges %3zu repairs\n", file.lexically_relative(kData).string().c_str(),
                nav::edges(site.map.obstacles).size(), site.repairs.size());
  }
}

}  // namespace
}  // namespace mission
