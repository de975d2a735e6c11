// Reading maps: the dialect, every way to break it, and the real maps at hand.
#include "mission/site_io.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "mission/files.hpp"
#include "mission/json_places.hpp"
#include "nav/free_space.hpp"
#include "nav/polygons.hpp"
#include "nav/rings.hpp"

namespace mission {
namespace {

namespace fs = std::filesystem;
using nav::Role;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kSquare =
    R"({"type":"Polygon","coordinates":[[[0,0],[9,0],[9,9],[0,9],[0,0]]]})";

std::string map_of(const std::string& features, const std::string& members = "") {
  return R"({"type":"FeatureCollection",)" + members + R"("features":[)" + features + "]}";
}

std::string feature(const std::string& properties, const std::string& geometry = kSquare) {
  return R"({"type":"Feature","properties":{)" + properties + R"(},"geometry":)" + geometry + "}";
}

LoadedSite parse(const std::string& text) {
  return parse_site(text, "map.geojson");
}

TEST(ParseSite, ReadsEveryRoleWithItsProperties) {
  const LoadedSite site = parse(map_of(
      feature(R"("role":"boundary","wall":true,"ground_z_m":-1.5)") + "," +
          feature(R"("role":"obstacle","name":"barracks","height_m":12,"anything":[1])") + "," +
          feature(R"("role":"keep_out","name":"pond")") + "," +
          feature(R"("role":"target")", R"({"type":"LineString","coordinates":[[0,0],[9,0]]})") +
          "," + feature(R"("role":"region","name":"moat","ground_z_m":-4)") + "," +
          feature(R"("role":"start","heading_deg":90)",
                  R"({"type":"Point","coordinates":[3,4,5]})"),
      R"("ground_z_m":2,)"));
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_THAT(site.notes, IsEmpty());
  const auto& f = site.raw.features;
  ASSERT_EQ(f.size(), 6u);
  EXPECT_EQ(site.raw.ground_z_m, 2);
  EXPECT_EQ(f[0].role, Role::boundary);
  EXPECT_TRUE(f[0].wall);
  EXPECT_EQ(f[0].ground_z_m, -1.5);
  EXPECT_EQ(f[1].role, Role::obstacle);
  EXPECT_EQ(f[1].name, "barracks");
  EXPECT_THAT(f[1].where, HasSubstr("(feature 1 'barracks')"));
  ASSERT_EQ(f[1].polygons_m.size(), 1u);
  ASSERT_EQ(f[1].polygons_m[0].size(), 1u);
  EXPECT_EQ(f[1].polygons_m[0][0].size(), 5u);
  EXPECT_EQ(f[1].polygons_m[0][0][2], Eigen::Vector2d(9, 9));
  EXPECT_EQ(f[2].role, Role::keep_out);
  EXPECT_EQ(f[3].role, Role::target);
  ASSERT_EQ(f[3].lines_m.size(), 1u);
  EXPECT_EQ(f[3].lines_m[0][1], Eigen::Vector2d(9, 0));
  EXPECT_EQ(f[4].role, Role::region);
  EXPECT_EQ(f[4].ground_z_m, -4);
  EXPECT_EQ(f[5].role, Role::start);
  EXPECT_EQ(f[5].point_m, Eigen::Vector2d(3, 4));
  EXPECT_EQ(f[5].heading_deg, 90);
}

TEST(ParseSite, FeatureAndBareGeometryAreMapsToo) {
  for (const std::string& text : {feature(""), std::string(kSquare)}) {
    const LoadedSite site = parse(text);
    EXPECT_THAT(site.errors, IsEmpty());
    ASSERT_EQ(site.raw.features.size(), 1u);
    EXPECT_EQ(site.raw.features[0].role, Role::obstacle);
  }
}

TEST(ParseSite, MultiGeometriesAndCollectionsAreOneFeature) {
  const LoadedSite site = parse(map_of(feature("", R"({"type":"GeometryCollection","geometries":[
      {"type":"MultiPolygon","coordinates":[[[[0,0],[1,0],[1,1]]],[[[5,0],[6,0],[6,1]],[[5.5,0.1],[5.6,0.1],[5.6,0.2]]]]},
      {"type":"MultiLineString","coordinates":[[[0,5],[9,5]],[[0,6],[9,6]]]},
      {"type":"GeometryCollection","geometries":[{"type":"LineString","coordinates":[[0,7],[9,7]]}]}]})")));
  EXPECT_THAT(site.errors, IsEmpty());
  ASSERT_EQ(site.raw.features.size(), 1u);
  ASSERT_EQ(site.raw.features[0].polygons_m.size(), 2u);
  EXPECT_EQ(site.raw.features[0].polygons_m[1].size(), 2u);
  EXPECT_EQ(site.raw.features[0].lines_m.size(), 3u);
}

TEST(ParseSite, ClosedLineIsAnOutlineWhereAnAreaIsNeeded) {
  const LoadedSite site = parse(map_of(feature(
      R"("role":"boundary")", R"({"type":"LineString","coordinates":[[0,0],[9,0],[9,9],[0,0]]})")));
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_THAT(site.notes, ElementsAre(HasSubstr("closed line; taken as the outline")));
  EXPECT_EQ(site.raw.features.at(0).polygons_m.size(), 1u);
}

TEST(ParseSite, WhatIsIgnoredIsSaid) {
  const LoadedSite site =
      parse(map_of(feature("", "null") + "," +
                   feature(R"("name":"door")", R"({"type":"Point","coordinates":[1,2]})") + "," +
                   feature(R"("ground_z":3,"rol":"region")") + "," + feature(R"("rol":"x")")));
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_EQ(site.raw.features.size(), 2u);
  EXPECT_THAT(
      site.notes,
      ElementsAre(HasSubstr("feature 0: has no shape to use; ignored"),
                  HasSubstr("feature 1 'door': is a point without a role; ignored"),
                  HasSubstr("feature 1 'door': has no shape to use; ignored"),
                  HasSubstr("feature 2: \"ground_z\" is not read; did you mean 'ground_z_m'?"),
                  HasSubstr("\"rol\" is not read; did you mean 'role'? (2 features have it)")));
}

TEST(ParseSite, PlacesNameLineAndColumn) {
  const LoadedSite site = parse("{\"type\": \"FeatureCollection\",\n \"features\": [\n  " +
                                feature("\"role\":\"obstacle\"") + ",\n   " +
                                feature("\"name\":\"été\", \"role\":\"obstakle\"") + "]}");
  EXPECT_THAT(site.raw.features.at(0).where, HasSubstr("map.geojson:3:3 (feature 0)"));
  EXPECT_THAT(site.errors,
              ElementsAre(AllOf(HasSubstr("map.geojson:4:57: feature 1 'été': role 'obstakle'"))));
}

// Each way to break a map, where that is and what is said.
struct Broken {
  std::string text;
  std::vector<std::string> said;
};

TEST(ParseSite, BrokenMapsAreRefusedWithPlaceAndRemedy) {
  const std::string ok = feature("");
  const std::vector<Broken> table{
      {"", {"map.geojson:1:1: this is not valid JSON: incomplete JSON"}},
      {"   \n ", {"map.geojson:2:2: this is not valid JSON"}},
      {"{\"type\": \"FeatureCollection\",\n \"features\": [}",
       {"map.geojson:2:15: ", "not valid JSON", "at '}'"}},
      {"{\"type\":\n\n\"Feature", {"map.geojson:3:9: ", "incomplete"}},
      {"{} {}", {"map.geojson:1:4: ", "extra"}},
      {"{\"a\": nul}", {"map.geojson:1:", "not valid JSON"}},
      {"{\"a\": 1,}", {"map.geojson:1:9: ", "not valid JSON"}},
      {"\xff\xfe{", {"map.geojson:1:1: ", "not valid JSON"}},
      {std::string(100, '['), {"map.geojson:1:", "not valid JSON"}},
      {"[]", {"map.geojson:1:1: the map must be an object {...}, not an array"}},
      {"7", {"not a number"}},
      {"{}", {"\"type\" is missing; this is no GeoJSON"}},
      {R"({"type":"FeatureColection"})", {"'FeatureColection'; did you mean 'FeatureCollection'?"}},
      {R"({"type":"Topology"})", {"a map is one of FeatureCollection, Feature, Polygon"}},
      {R"({"type":"FeatureCollection"})", {"\"features\" is missing"}},
      {R"({"type":"FeatureCollection","features":{}})",
       {":1:40: \"features\" must be an array [...], not an object"}},
      {map_of("3"), {"feature 0: a feature must be an object {...}, not a number"}},
      {map_of(ok + ",{}"), {"feature 1: \"type\" is missing"}},
      {map_of(kSquare),
       {"feature 0: \"type\" is 'Polygon', but every element of \"features\" is a 'Feature'"}},
      {map_of(R"({"type":"Feature","properties":[],"geometry":null})"),
       {"\"properties\" must be an object"}},
      {map_of(feature(R"("role":"keepout")")),
       {"role 'keepout' is unknown; did you mean 'keep_out'?",
        "a role is one of boundary, obstacle, keep_out, target, region, start"}},
      {map_of(feature(R"("role":"Boundary")")), {"did you mean 'boundary'?"}},
      {map_of(feature(R"("role":"xyzzy")")), {"role 'xyzzy' is unknown; a role is one of"}},
      {map_of(feature(R"("role":4)")), {"\"role\" must be one of", "not a number"}},
      {map_of(feature(R"("role":"boundary","wall":"yes")")),
       {"\"wall\" must be true or false, not a text"}},
      {map_of(feature(R"("role":"region","ground_z_m":"3 m")")),
       {"\"ground_z_m\" must be a number, not a text"}},
      {map_of(feature(R"("role":"region","ground_z_m":1e999)")),
       {"\"ground_z_m\" must be a number"}},
      {map_of(feature("", "[]")), {"\"geometry\" must be an object"}},
      {map_of(feature("", "{}")), {"\"type\" is missing"}},
      {map_of(feature("", R"({"type":"Poligon","coordinates":[]})")),
       {"geometry type 'Poligon' is unknown; did you mean 'Polygon'?"}},
      {map_of(feature("", R"({"type":"Polygon"})")), {"\"coordinates\" is missing"}},
      {map_of(feature("", R"({"type":"GeometryCollection","coordinates":[]})")),
       {"\"geometries\" is missing"}},
      {map_of(feature("", R"({"type":"Polygon","coordinates":5})")),
       {"coordinates must be an array [...], not a number"}},
      {map_of(feature("", R"({"type":"Polygon","coordinates":[[0,0],[1,0],[1,1]]})")),
       {"a position must be an array [...], not a number"}},
      {map_of(feature("", R"({"type":"LineString","coordinates":[[[0,0],[1,0]]]})")),
       {"a coordinate must be a number, not an array (one bracket too many?)"}},
      {map_of(feature("", R"({"type":"Polygon","coordinates":[[[0,0],[1],[1,1]]]})")),
       {"a position needs two numbers [x, y], this has 1"}},
      {map_of(feature("", R"({"type":"Polygon","coordinates":[[[0,0],[1,"2"],[1,1]]]})")),
       {"a coordinate must be a number, not a text"}},
      {map_of(
           feature(R"("role":"region")", R"({"type":"LineString","coordinates":[[0,0],[1,0]]})")),
       {"is an open line, but this role needs an area; draw a Polygon"}},
      {map_of(feature(R"("role":"start")")), {"a start is drawn as a polygon; draw a Point"}},
      {map_of(feature(R"("role":"start")", R"({"type":"LineString","coordinates":[[0,0],[1,0]]})")),
       {"a start is drawn as a line"}},
      {map_of(feature(R"("role":"start")", R"({"type":"MultiPoint","coordinates":[[0,0],[1,0]]})")),
       {"a start has one point"}},
      {map_of(feature(R"("role":"start","heading_deg":true)",
                      R"({"type":"Point","coordinates":[0,0]})")),
       {"\"heading_deg\" must be a number, not true or false"}},
      {map_of(feature(R"("role":"region")", R"({"type":"Point","coordinates":[0,0]})")),
       {"is a point, but only a start is one"}},
      {map_of(ok, R"("crs":"EPSG:25832",)"),
       {":1:35: \"crs\" EPSG:25832 is unknown; write \"local\"", "ogr2ogr"}},
      {map_of(ok, R"("crs":{"type":"name"},)"), {"\"crs\" {\"type\":\"name\"} is unknown"}},
      {map_of(ok, R"("crs":"WGS84","origin":{"lat":48},)"), {"\"origin\" needs \"lon\""}},
      {map_of(ok, R"("crs":"WGS84","origin":[8,48],)"), {"\"origin\" must be an object"}},
      {map_of(ok, R"("crs":"WGS84","origin":{"lon":8,"lat":148},)"), {"\"lat\" (-90 to 90)"}},
      {map_of(feature("", R"({"type":"Polygon","coordinates":[[[5,5],[500,5],[5,6]]]})"),
              R"("crs":"WGS84","origin":{"lon":8,"lat":48},)"),
       {"(feature 0): (500, 5) is no longitude and latitude"}},
      {map_of(ok, R"("ground_z_m":"low",)"), {"\"ground_z_m\" must be a number, not a text"}},
  };
  for (const Broken& broken : table) {
    SCOPED_TRACE(broken.text);
    const LoadedSite site = parse(broken.text);
    ASSERT_EQ(site.errors.size(), 1u) << ::testing::PrintToString(site.errors);
    for (const std::string& part : broken.said) EXPECT_THAT(site.errors[0], HasSubstr(part));
  }
}

TEST(ParseSite, EveryErrorIsReportedAtOnceUpToALimit) {
  const std::string bad = feature(R"("role":"nobody")");
  EXPECT_EQ(parse(map_of(bad + "," + bad)).errors.size(), 2u);
  std::string many = bad;
  for (int i = 0; i < 199; ++i) many += "," + bad;
  const LoadedSite site = parse(map_of(many));
  ASSERT_EQ(site.errors.size(), 51u);
  EXPECT_EQ(site.errors.back(), "... and 150 more like these");
}

TEST(ParseSite, NamesCannotSmuggleControlCharactersIntoMessages) {
  const LoadedSite site = parse(map_of(feature(R"("name":"a\u001b[2J\nb","role":"x")")));
  ASSERT_EQ(site.errors.size(), 1u);
  EXPECT_EQ(site.errors[0].find_first_of("\x1b\n"), std::string::npos);
}

// 0.001 degrees in each direction, around latitude 48.
constexpr const char* kDegrees =
    R"({"type":"Polygon","coordinates":[[[8,48],[8.001,48],[8.001,48.001],[8,48.001],[8,48]]]})";

void expect_metres(const LoadedSite& site, double x0, double y0) {
  const auto& ring = site.raw.features.at(0).polygons_m.at(0).at(0);
  EXPECT_NEAR(ring[0].x(), x0, 0.01);
  EXPECT_NEAR(ring[0].y(), y0, 0.01);
  // Radii of curvature of the WGS84 ellipsoid at latitude 48: meridian 6,370,741 m, normal
  // 6,389,940 m.
  constexpr double kRadians = 0.001 * 3.14159265358979 / 180;
  EXPECT_NEAR(ring[1].x() - ring[0].x(), 6389940 * std::cos(48 * 1000 * kRadians) * kRadians, 0.02);
  EXPECT_NEAR(ring[3].y() - ring[0].y(), 6370741 * kRadians, 0.02);
}

TEST(ParseSite, DegreesBecomeMetresAroundTheOrigin) {
  for (const char* crs :
       {R"("WGS84")", R"("EPSG:4326")", R"("OGC:CRS84")",
        R"({"type":"name","properties":{"name":"urn:ogc:def:crs:OGC:1.3:CRS84"}})",
        R"({"type":"name","properties":{"name":"urn:ogc:def:crs:EPSG::4326"}})"}) {
    SCOPED_TRACE(crs);
    const LoadedSite site =
        parse(map_of(feature("", kDegrees),
                     std::string(R"("crs":)") + crs + R"(,"origin":{"lon":8,"lat":48,"h":0},)"));
    EXPECT_THAT(site.errors, IsEmpty());
    EXPECT_THAT(site.notes, IsEmpty());
    expect_metres(site, 0, 0);
  }
}

TEST(ParseSite, OriginElsewhereMovesTheSite) {
  const LoadedSite site =
      parse(map_of(feature("", kDegrees), R"("crs":"WGS84","origin":{"lon":7.999,"lat":47.999},)"));
  expect_metres(site, 74.62, 111.19);
}

TEST(ParseSite, DegreesWithoutACrsAreRecognisedAndSaid) {
  const LoadedSite site = parse(map_of(feature("", kDegrees)));
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_THAT(site.notes,
              ElementsAre(HasSubstr("taken as WGS84"), HasSubstr("lon 8 lat 48, is (0, 0)")));
  expect_metres(site, 0, 0);
}

TEST(ParseSite, LocalMeansLocalEvenWhenSmall) {
  const LoadedSite site = parse(map_of(feature("", kDegrees), R"("crs":"local",)"));
  EXPECT_THAT(site.notes, IsEmpty());
  EXPECT_EQ(site.raw.features.at(0).polygons_m[0][0][0], Eigen::Vector2d(8, 48));
}

TEST(ParseSite, MetresAreTheDefault) {
  const LoadedSite site = parse(map_of(feature(""), R"("origin":{"lon":8,"lat":48},)"));
  EXPECT_THAT(site.notes, IsEmpty());
  EXPECT_EQ(site.raw.features.at(0).polygons_m[0][0][2], Eigen::Vector2d(9, 9));
}

TEST(ParseSite, ByteOrderMarkIsNoError) {
  EXPECT_THAT(parse("\xEF\xBB\xBF" + map_of(feature(""))).errors, IsEmpty());
}

TEST(JsonPlaces, FindsValuesAndTheLastOfEqualKeys) {
  const std::string text =
      R"({"a\"b": "x]}", "k": [1, [2, {"q": 3}]], "k": [10, [20, {"q": 30}]]})";
  const JsonPlaces places(text);
  const std::size_t at = places.find({"k", std::size_t{1}, std::size_t{1}, "q"});
  EXPECT_EQ(text.substr(at, 2), "30");
  EXPECT_EQ(text.substr(places.find({"k", std::size_t{7}}), 4), "[10,");
  EXPECT_EQ(places.elements(places.find({"k"})).size(), 2u);
}

class SiteFolder : public ::testing::Test {
 protected:
  SiteFolder() { fs::create_directories(folder_); }
  ~SiteFolder() override { fs::remove_all(folder_); }

  void put(const std::string& name, const std::string& text = "") {
    std::ofstream(folder_ / name) << text;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) /
                           (std::string("vantage_site_") +
                            ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(SiteFolder, HoldsMapAndModel) {
  put("footprint.geojson", map_of(feature("")));
  put("model.obj");
  put("other.obj");
  const LoadedSite site = load_site(folder_);
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_EQ(site.raw.name, folder_.filename().string());
  EXPECT_EQ(site.map_file, folder_ / "footprint.geojson");
  EXPECT_EQ(site.model_file, folder_ / "model.obj");
  EXPECT_THAT(site.raw.features.at(0).where, HasSubstr("footprint.geojson:1:"));
  EXPECT_EQ(load_site(folder_ / "").raw.name, site.raw.name);
}

TEST_F(SiteFolder, OnlyModelThereIsTaken) {
  put("footprint.geojson", map_of(feature("")));
  EXPECT_FALSE(load_site(folder_).model_file);
  put("Town Hall.OBJ");
  EXPECT_EQ(load_site(folder_).model_file, folder_ / "Town Hall.OBJ");
  put("b.obj");
  EXPECT_THAT(load_site(folder_).errors,
              ElementsAre(AllOf(HasSubstr("several models (Town Hall.OBJ, b.obj)"),
                                HasSubstr("rename the one to use to model.obj"))));
}

TEST_F(SiteFolder, MissingMapIsExplained) {
  EXPECT_THAT(load_site(folder_ / "nowhere").errors,
              ElementsAre(HasSubstr("nowhere: no such folder")));
  EXPECT_THAT(load_site(folder_).errors,
              ElementsAre(HasSubstr("footprint.geojson is missing; draw")));
  put("buildings.geojson");
  EXPECT_THAT(load_site(folder_).errors,
              ElementsAre(HasSubstr("rename the file that is the map (buildings.geojson)")));
}

TEST_F(SiteFolder, MapFileMayBeNamedInsteadOfTheFolder) {
  put("buildings.geojson", map_of(feature("")));
  put("model.obj");
  const LoadedSite site = load_site(folder_ / "buildings.geojson");
  EXPECT_THAT(site.errors, IsEmpty());
  EXPECT_EQ(site.raw.name, "buildings");
  EXPECT_EQ(site.model_file, folder_ / "model.obj");
}

TEST_F(SiteFolder, MapThatCannotBeReadIsAnError) {
  fs::create_directories(folder_ / "footprint.geojson");
  EXPECT_THAT(load_site(folder_).errors, ElementsAre(HasSubstr("cannot read")));
}

// The examples of the document are what it says they are.
TEST(MapFormat, ExamplesInTheDocumentAreCleanMaps) {
  const FileResult<std::string> document =
      read_file(fs::path(VANTAGE_SOURCE_DIR) / "configs/sites/FORMAT.md");
  ASSERT_TRUE(document.has_value());
  int examples = 0;
  const std::string open = "```json\n";
  for (std::size_t at = document->find(open); at != std::string::npos;
       at = document->find(open, at + 1)) {
    const std::size_t begin = at + open.size();
    const LoadedSite site = parse(document->substr(begin, document->find("```", begin) - begin));
    EXPECT_THAT(site.errors, IsEmpty());
    EXPECT_THAT(site.notes, IsEmpty());
    const nav::RepairedSite repaired = nav::repair_site(site.raw, 30);
    EXPECT_THAT(repaired.errors, IsEmpty());
    EXPECT_LE(repaired.repairs.size(), 1u);  // The first draws no boundary.
    ++examples;
  }
  EXPECT_EQ(examples, 2);
}

// Maps that nobody here drew.
TEST(RealMaps, AllAreReadRepairedAndHaveFreeSpace) {
  const fs::path data = fs::path(VANTAGE_SOURCE_DIR) / "../shared/data";
  if (!fs::exists(data)) GTEST_SKIP() << "the shared data are not here: " << data;
  int maps = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    if (entry.path().extension() != ".geojson") continue;
    SCOPED_TRACE(entry.path());
    const LoadedSite site = load_site(entry.path());
    EXPECT_THAT(site.errors, IsEmpty());
    const nav::RepairedSite repaired = nav::repair_site(site.raw, 30);
    EXPECT_THAT(repaired.errors, IsEmpty());
    EXPECT_GT(nav::area_m2(repaired.map.obstacles), 1);
    EXPECT_TRUE(nav::contacts(nav::edges(repaired.map.obstacles)).empty());
    const auto areas = nav::free_areas(repaired.map, 0.5, 4);
    ASSERT_FALSE(areas.empty());
    EXPECT_TRUE(nav::contacts(nav::edges(areas[0].standable)).empty());
    ++maps;
    std::cout << entry.path().parent_path().filename().string() << "/"
              << entry.path().filename().string() << ": " << site.raw.features.size()
              << " features, " << repaired.repairs.size() << " repairs, "
              << nav::edges(repaired.map.obstacles).size() << " obstacle edges, "
              << nav::area_m2(repaired.map.obstacles) << " m2 built, " << areas.size()
              << " free areas\n";
  }
  EXPECT_GE(maps, 20);
}

TEST(RealMaps, DegreesAndMetresOfTheSameCampusAgree) {
  const fs::path folder =
      fs::path(VANTAGE_SOURCE_DIR) / "../shared/data/maps/campus_colorado_college";
  if (!fs::exists(folder)) GTEST_SKIP() << "the shared data are not here: " << folder;
  const auto built_m2 = [&](const char* name) {
    const LoadedSite site = load_site(folder / name);
    return nav::area_m2(nav::repair_site(site.raw, 30).map.obstacles);
  };
  const double metres = built_m2("buildings_local.geojson");
  EXPECT_NEAR(built_m2("buildings_wgs84.geojson") / metres, 1, 0.005);
}

TEST(SiteIo, KeepsWhereTheMapLiesOnTheEarth) {
  const std::string origin = R"("origin":{"lon":11,"lat":48,"h":500},)";
  for (const char* crs : {R"("crs":"local",)", R"("crs":"WGS84",)"}) {
    const LoadedSite site = parse(map_of(feature(""), crs + origin));
    ASSERT_TRUE(site.origin) << crs;
    EXPECT_DOUBLE_EQ(site.origin->lon_deg, 11);
    EXPECT_DOUBLE_EQ(site.origin->lat_deg, 48);
    EXPECT_DOUBLE_EQ(site.origin->h_m, 500);
  }
  EXPECT_FALSE(parse(map_of(feature(""), R"("crs":"local",)")).origin);
}

}  // namespace
}  // namespace mission
