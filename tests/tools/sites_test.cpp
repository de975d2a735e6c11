// The sites that ship: what the maps say agrees with what the models are, and every mission loads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/random/uniform_int_distribution.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "mission/config.hpp"
#include "tests/tools/footprint_reader.hpp"
#include "tests/tools/obj_reader.hpp"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace tools_test;

const std::filesystem::path kSourceTree = VANTAGE_SOURCE_DIR;
const std::filesystem::path kSites = kSourceTree / "configs/sites";

constexpr std::int64_t kRobotRadiusMm = 500;

struct Site {
  Obj model;
  Footprint map;
};

Site load(const std::string& name) {
  return {read_obj(kSites / name / "model.obj"),
          read_footprint(kSites / name / "footprint.geojson")};
}

// ---- Every site ---------------------------------------------------------------------------------

// What the READMEs promise.
struct Expected {
  const char* name;
  Vector3d low, high;  // Bounding box of the model.
};

void PrintTo(const Expected& expected, std::ostream* out) {
  *out << expected.name;
}

class EverySite : public testing::TestWithParam<Expected> {
 protected:
  const Site site_ = load(GetParam().name);
};

TEST_P(EverySite, HasTheSizeItsReadmeSays) {
  Vector3d low = site_.model.vertices.front(), high = low;
  for (const Vector3d& p : site_.model.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_LT((low - GetParam().low).cwiseAbs().maxCoeff(), 0.05) << low.transpose();
  EXPECT_LT((high - GetParam().high).cwiseAbs().maxCoeff(), 0.05) << high.transpose();
}

TEST_P(EverySite, StaysSmall) {
  EXPECT_LT(std::filesystem::file_size(kSites / GetParam().name / "model.obj"), 400'000u);
}

TEST_P(EverySite, IsMadeOfClosedSolidsThatFaceOutward) {
  for (const Group& group : site_.model.groups) {
    if (!group.closed()) continue;
    EXPECT_EQ(bad_edges(group), 0) << group.name;
    EXPECT_GT(volume_m3(site_.model, group), 0) << group.name;
  }
}

TEST_P(EverySite, HasGroundThatFacesUp) {
  int grounds = 0;
  for (const Group& group : site_.model.groups) {
    if (group.closed()) continue;
    ++grounds;
    for (const auto& t : group.triangles) {
      const auto& v = site_.model.vertices;
      EXPECT_GT((v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).z(), 0) << group.name;
    }
  }
  EXPECT_GE(grounds, 1);
}

TEST_P(EverySite, HasRegionsThatDoNotMeetAndHoldARobot) {
  std::vector<nav::Polygons> seen;
  for (const auto& [name, region] : site_.map.regions) {
    const nav::Polygons free = free_space(site_.map, region);
    EXPECT_GT(nav::area_m2(nav::offset(free, -kRobotRadiusMm)), 100) << name;
    for (const nav::Polygons& other : seen)
      EXPECT_TRUE(nav::intersect(nav::offset(free, 100), other).empty()) << name;
    seen.push_back(free);
  }
}

TEST_P(EverySite, StartsWhereTheRobotFits) {
  ASSERT_TRUE(site_.map.start);
  int fits = 0;
  for (const auto& [name, region] : site_.map.regions)
    fits += nav::contains(nav::offset(free_space(site_.map, region), -kRobotRadiusMm),
                          *site_.map.start);
  EXPECT_EQ(fits, 1);
}

TEST_P(EverySite, DrawsItsTargetsOnWalls) {
  for (const nav::Ring& line : site_.map.targets)
    for (std::size_t i = 1; i < line.size(); ++i) {
      const nav::PointMm middle{(line[i - 1].x + line[i].x) / 2, (line[i - 1].y + line[i].y) / 2};
      EXPECT_TRUE(nav::contains(nav::offset(site_.map.obstacles, 3), middle));
      EXPECT_FALSE(nav::contains(nav::offset(site_.map.obstacles, -3), middle));
    }
}

// Pairs of points on both sides of the edges that border the free space of a region: 8 cm out into
// it, 5 cm into the obstacle. Away from corners, at odd distances so that no ray meets an edge.
struct EdgeSample {
  Vector2d out, in;
  double ground_z_m{};
};

std::vector<EdgeSample> edge_samples(const Footprint& map) {
  std::vector<EdgeSample> samples;
  for (const auto& [name, region] : map.regions) {
    const nav::Polygons free = free_space(map, region);
    for (const nav::SegmentMm& edge : nav::edges(map.obstacles)) {
      const Vector2d a = nav::to_m(edge.a), b = nav::to_m(edge.b);
      const Vector2d along = (b - a).normalized(), outward(along.y(), -along.x());
      const int pieces = std::max(1, static_cast<int>((b - a).norm()));
      for (int i = 0; i < pieces; ++i) {
        const Vector2d on = a + (b - a) * ((i + 0.4873) / pieces);
        const EdgeSample sample{on + 0.0803 * outward, on - 0.0497 * outward, region.ground_z_m};
        if (nav::contains(free, nav::to_mm(sample.out)) &&
            nav::contains(map.obstacles, nav::to_mm(sample.in)))
          samples.push_back(sample);
      }
    }
  }
  return samples;
}

// On the fort: within the building that the map lacks, or its yard.
bool in_gun_sheds(const Vector3d& p) {
  return p.x() > 68.7 && p.x() < 86.3 && std::abs(p.y()) < 17.5;
}

TEST_P(EverySite, HasItsWallsWhereTheMapDrawsThem) {
  const Columns columns(site_.model);
  const bool fort = std::string(GetParam().name) == "fort";
  const auto samples = edge_samples(site_.map);
  EXPECT_GT(samples.size(), 150u);
  for (const EdgeSample& s : samples) {
    if (fort && in_gun_sheds({s.out.x(), s.out.y(), 0})) continue;  // Built against the wall.
    const auto winding = [&](const Vector2d& p, double above_m) {
      return columns.above({p.x(), p.y(), s.ground_z_m + above_m}).winding;
    };
    EXPECT_EQ(winding(s.out, 0.5), 0) << "something stands in the open at " << s.out.transpose();
    EXPECT_GE(winding(s.in, 0.2), 1) << "nothing stands behind the wall at " << s.in.transpose();
  }
}

// Random points of the free space of all regions, with the height of the ground there.
std::vector<Vector3d> free_points(const Footprint& map, int tries) {
  std::mt19937_64 random(3);
  nav::PointMm low = map.boundary.front().outer.front(), high = low;
  for (const nav::PointMm& p : map.boundary.front().outer) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  boost::random::uniform_int_distribution<std::int64_t> x(low.x, high.x), y(low.y, high.y);
  std::vector<Vector3d> points;
  for (const auto& [name, region] : map.regions) {
    const nav::Polygons free = nav::offset(free_space(map, region), -20);
    for (int i = 0; i < tries; ++i) {
      const nav::PointMm p{x(random), y(random)};
      const Vector2d m = nav::to_m(p) + Vector2d(0.00037, 0.00041);
      if (nav::contains(free, p)) points.emplace_back(m.x(), m.y(), region.ground_z_m);
    }
  }
  return points;
}

TEST_P(EverySite, IsOpenWhereTheMapSaysFreeButForTheMissingBuilding) {
  const Columns columns(site_.model);
  const bool fort = std::string(GetParam().name) == "fort";
  const auto points = free_points(site_.map, 4000);
  EXPECT_GT(points.size(), 200u);
  int inside_missing = 0;
  for (const Vector3d& p : points) {
    const bool missing = fort && in_gun_sheds(p);
    const Above floor = columns.above(p - Vector3d(0, 0, 0.01));
    EXPECT_NEAR(floor.first_z, p.z(), 1e-6) << "no ground at " << p.transpose();
    const int winding = columns.above(p + Vector3d(0, 0, 0.5)).winding;
    if (missing && winding > 0) {
      ++inside_missing;
      continue;
    }
    EXPECT_EQ(winding, 0) << "something stands in the open at " << p.transpose();
  }
  EXPECT_EQ(inside_missing > 0, fort);
}

INSTANTIATE_TEST_SUITE_P(Shipped, EverySite,
                         testing::Values(Expected{"fort", {-150, -150, -4}, {150, 150, 22}},
                                         Expected{"tower", {-115.6, -115.6, 0}, {115.6, 115.6, 56}},
                                         Expected{"courtyard", {-60, -45, 0}, {60, 45, 50.4}},
                                         Expected{"church", {-1.6, -11.5, 0}, {48.1, 11.5, 14.8}},
                                         Expected{"museum", {-75, -65, 0}, {75, 65, 41}}),
                         [](const auto& site) { return std::string(site.param.name); });

// ---- What is special about each -----------------------------------------------------------------

// Does the segment meet any triangle? Möller and Trumbore, every triangle.
bool blocked(const Obj& model, const Vector3d& from, const Vector3d& to) {
  const Vector3d d = to - from;
  for (const Group& group : model.groups)
    for (const auto& t : group.triangles) {
      const Vector3d a = model.vertices[t[0]];
      const Vector3d e1 = model.vertices[t[1]] - a, e2 = model.vertices[t[2]] - a;
      const Vector3d h = d.cross(e2), s = from - a;
      const double det = e1.dot(h);
      if (std::abs(det) < 1e-12) continue;
      const double u = s.dot(h) / det, v = d.dot(s.cross(e1)) / det;
      const double at = e2.dot(s.cross(e1)) / det;
      if (u >= 0 && v >= 0 && u + v <= 1 && at > 1e-6 && at < 1 - 1e-6) return true;
    }
  return false;
}

TEST(Fort, HasThreeRegionsAndAMoatFourMetresDown) {
  const Footprint map = load("fort").map;
  ASSERT_EQ(map.regions.size(), 3u);
  EXPECT_EQ(map.regions.at("inner").ground_z_m, 0);
  EXPECT_EQ(map.regions.at("outer").ground_z_m, 0);
  EXPECT_EQ(map.regions.at("moat").ground_z_m, -4);
}

TEST(Fort, HasNothingButSkyTheBridgeAndTheGunShedsAboveItsMoat) {
  const Site fort = load("fort");
  Footprint moat = fort.map;
  moat.regions.erase("inner");
  moat.regions.erase("outer");
  const Columns columns(fort.model);
  int under_bridge = 0, in_shed = 0;
  for (const Vector3d& p : free_points(moat, 5000)) {
    const double over = columns.above(p + Vector3d(0, 0, 0.1)).first_z;
    if (std::isinf(over)) continue;
    const bool shed = in_gun_sheds(p);
    EXPECT_TRUE(shed || (std::abs(p.x()) < 2.6 && p.y() < 0)) << p.transpose();
    ++(shed ? in_shed : under_bridge);
  }
  EXPECT_GT(in_shed, 0);
  EXPECT_GT(under_bridge, 0);
}

TEST(Fort, HasTheFaultsOfADrawnMap) {
  const Footprint map = load("fort").map;
  EXPECT_EQ(map.rings_left_open, 1);
  EXPECT_EQ(map.vertices_repeated, 1);
  const auto overlap_m2 = [&](const char* a, const char* b) {
    return nav::area_m2(nav::intersect(map.named.at(a), map.named.at(b)));
  };
  EXPECT_GT(overlap_m2("stairs east", "rampart"), 0.3);
  EXPECT_EQ(overlap_m2("stairs south", "rampart"), 0);
  EXPECT_GT(overlap_m2("link wall north-east", "barracks north"), 0.001);
  EXPECT_GT(overlap_m2("barrier", "barracks west, north of the passage"), 0.01);
}

TEST(Fort, IsSurveyedOverItsBarrierButNotDrivenOver) {
  const Obj model = load("fort").model;
  EXPECT_FALSE(blocked(model, {-22, 0.137, 1.8}, {-40, 0.137, 1.8}));
  EXPECT_TRUE(blocked(model, {-22, 0.137, 0.6}, {-40, 0.137, 0.6}));
}

TEST(Tower, IsHiddenByItsBaseFromNearAndSeenFromAfar) {
  const Obj model = load("tower").model;
  const Vector3d on_front(1.9, -1.7, 20);  // 9 m above the roof of the base.
  EXPECT_TRUE(blocked(model, {14.2, -33, 1.8}, on_front));
  EXPECT_FALSE(blocked(model, {14.2, -58, 1.8}, on_front));
}

TEST(Courtyard, HasBalconiesThatHideTheWallAboveThem) {
  const Obj model = load("courtyard").model;
  const Vector3d above_balcony(-35.3, 16.5, 10.1);
  EXPECT_TRUE(blocked(model, {-35.3, 5, 1.8}, above_balcony));
  EXPECT_FALSE(blocked(model, {-35.3, -30, 30}, above_balcony));
}

TEST(Church, IsClosedOverhead) {
  const Site church = load("church");
  const Columns columns(church.model);
  for (const Vector3d& p : free_points(church.map, 4000)) {
    const double ceiling = columns.above(p + Vector3d(0, 0, 0.5)).first_z;
    EXPECT_LE(ceiling, 14.001) << p.transpose();
    EXPECT_GE(ceiling, 3.8) << p.transpose();
  }
}

// Rays from the middle of every room in all directions: a gap would let some of them out.
TEST(Church, LetsNoBeamOut) {
  const Site church = load("church");
  for (const Vector3d& eye :
       {Vector3d(9.3, 0.2, 1.8), Vector3d(9.3, 5.5, 1.8), Vector3d(26.4, 0.1, 1.8),
        Vector3d(26.4, -8.3, 1.8), Vector3d(41.9, 2.3, 1.8), Vector3d(32, 5.6, 1.8)})
    for (int i = 0; i < 400; ++i) {  // Fibonacci directions.
      const double z = 1 - (i + 0.5) / 200, angle = 2.399963 * i;
      const double r = std::sqrt(1 - z * z);
      const Vector3d direction(r * std::cos(angle), r * std::sin(angle), z);
      EXPECT_TRUE(blocked(church.model, eye, eye + 80 * direction))
          << eye.transpose() << " towards " << direction.transpose();
    }
}

TEST(Museum, HasRoofsThatReachOneToFourMetresBeyondItsWalls) {
  const Site museum = load("museum");
  const Columns columns(museum.model);
  const nav::Polygons within_1 = nav::offset(museum.map.obstacles, 1000);
  const nav::Polygons within_4 = nav::offset(museum.map.obstacles, 4100);
  int covered_beyond_1 = 0;
  for (const Vector3d& p : free_points(museum.map, 20000)) {
    if (std::isinf(columns.above(p + Vector3d(0, 0, 0.5)).first_z)) continue;
    const nav::PointMm mm = nav::to_mm(p.head<2>());
    covered_beyond_1 += !nav::contains(within_1, mm);
    EXPECT_TRUE(nav::contains(within_4, mm)) << p.transpose();
  }
  EXPECT_GT(covered_beyond_1, 50);
}

// ---- The program and the configs ----------------------------------------------------------------

int run_make_sites(const std::string& arguments) {
  const std::filesystem::path program = std::filesystem::path(VANTAGE_BINARY_DIR) / "make_sites";
  if (!std::filesystem::exists(program)) ADD_FAILURE() << "build the target make_sites first";
  const int status = std::system((program.string() + " " + arguments + " 2>/dev/null").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(MakeSites, MakesExactlyWhatIsCommitted) {
  EXPECT_EQ(run_make_sites("--check " + kSites.string()), 0);
}

TEST(MakeSites, NoticesAChangedFileAndAMissingOne) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("make_sites_" + std::to_string(getpid()));
  ASSERT_EQ(run_make_sites(folder.string()), 0);
  EXPECT_EQ(run_make_sites("--check " + folder.string()), 0);
  std::ofstream(folder / "fort/model.obj", std::ios::app) << "\n";
  EXPECT_EQ(run_make_sites("--check " + folder.string()), 1);
  ASSERT_EQ(run_make_sites(folder.string()), 0);
  std::filesystem::remove(folder / "README.md");
  EXPECT_EQ(run_make_sites("--check " + folder.string()), 1);
  std::filesystem::remove_all(folder);
}

TEST(MakeSites, RefusesACommandLineItDoesNotKnow) {
  for (const char* arguments : {"", "--check", "--chek x", "a b"})
    EXPECT_EQ(run_make_sites(arguments), 2) << arguments;
}

std::vector<std::filesystem::path> toml_files(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(kSourceTree / "configs" / folder))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Configs, HoldMissionsThatLoadAndFitOnAScreen) {
  const auto files = toml_files("missions");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) {
    const mission::LoadedMission loaded = mission::load_mission(file);
    for (const auto& error : loaded.errors) ADD_FAILURE() << error.text();
    EXPECT_TRUE(std::filesystem::exists(loaded.config.site_folder / "footprint.geojson")) << file;
    std::ifstream in(file);
    const auto lines = std::count(std::istreambuf_iterator<char>(in), {}, '\n');
    EXPECT_LE(lines, 20) << file;
  }
}

TEST(Configs, HoldMissionsForTheRegionsTheirMapsHave) {
  for (const auto& file : toml_files("missions")) {
    const mission::MissionConfig config = mission::load_mission(file).config;
    const Footprint map = read_footprint(config.site_folder / "footprint.geojson");
    for (const auto& [name, mode] : config.regions) EXPECT_TRUE(map.regions.contains(name)) << file;
  }
}

TEST(Configs, HoldRobotsThatLoad) {
  for (const auto& file : toml_files("robots")) {
    std::ifstream in(file);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto loaded = mission::parse_mission("", "m.toml", text, file.string());
    for (const auto& error : loaded.errors) ADD_FAILURE() << error.text();
    EXPECT_EQ(loaded.config.robot.name, file.stem().string());
  }
}

}  // namespace
