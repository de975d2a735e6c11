#include "sim/mesh.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Triangle = std::array<std::uint32_t, 3>;

constexpr std::string_view kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

sim::ParsedMesh parse(const std::string& text) {
  return sim::parse_obj(text, "site.obj");
}
sim::ParsedMesh parse_on_square(const std::string& text) {
  return parse(std::string(kSquare) + text);
}

TEST(ParseObj, ReadsEveryWayToNameACorner) {
  for (const std::string face :
       {"f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//2 3//3", "f 1/9/1 2/9/1 3/9/1", "f -4 -3 -2",
        "f -4/-1/-1 -3/-1/-1 -2/-1/-1", "  f\t1  2 3  ", "f 1 2 3 # a comment", "f +1 +2 +3",
        "f 1 \\\n 2 \\\n3", "f 1 2 3\r"}) {
    const auto parsed = parse_on_square(face + "\n");
    EXPECT_THAT(parsed.errors, IsEmpty()) << face;
    EXPECT_THAT(parsed.mesh.triangles, ElementsAre(Triangle{0, 1, 2})) << face;
  }
}

TEST(ParseObj, FansPolygonsFromTheirFirstCorner) {
  const auto parsed = parse_on_square("f 1 2 3 4\n");
  EXPECT_THAT(parsed.mesh.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
}

TEST(ParseObj, ReadsCoordinatesInAnyNotation) {
  const auto parsed = parse("v +1.5 -2e1 .25 1.0\nv 0 0 0\nv 1 1 1 0.5 0.5 0.5\nf 1 2 3");
  ASSERT_THAT(parsed.errors, IsEmpty());
  EXPECT_EQ(parsed.mesh.W_vertices_m[0], Eigen::Vector3d(1.5, -20, 0.25));
}

TEST(ParseObj, SkipsWhatIsNotASurface) {
  const auto parsed = parse_on_square(
      "# made by hand\nmtllib a.mtl\no thing\ng wall\ns off\nusemtl red\nvn 0 0 1\nvt 0 0\nl 1 "
      "2\n\nf 1 2 3\n");
  EXPECT_THAT(parsed.errors, IsEmpty());
  EXPECT_THAT(parsed.mesh.triangles, SizeIs(1));
}

TEST(ParseObj, LetsAVertexFollowTheFaceThatUsesIt) {
  const auto parsed = parse("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_THAT(parsed.errors, IsEmpty());
  EXPECT_THAT(parsed.mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
}

TEST(ParseObj, DropsTrianglesThatUseAVertexTwice) {
  const auto parsed = parse_on_square("f 1 1 2 3\n");
  EXPECT_THAT(parsed.mesh.triangles, ElementsAre(Triangle{0, 1, 2}));
}

struct Broken {
  const char* text;  // After the four vertices of kSquare.
  const char* message;
};

TEST(ParseObj, NamesFileLineAndReasonForEveryBrokenFile) {
  const Broken table[] = {
      {"f 1 2\n", "site.obj:5: a face needs three corners, found 2"},
      {"f\n", "site.obj:5: a face needs three corners, found 0"},
      {"\n\nf 1 2 5\n", "site.obj:7: a face names vertex 5; the file has only 4"},
      {"f 1 2 -5\n", "site.obj:5: corner '-5' names a vertex that does not exist (4 so far)"},
      {"f 0 1 2\n", "site.obj:5: corner '0' is not"},
      {"f 1 2 x\n", "site.obj:5: corner 'x' is not"},
      {"f 1 2 3/\n", "site.obj:5: corner '3/' is not"},
      {"f 1 2 /3\n", "site.obj:5: corner '/3' is not"},
      {"f 1 2 3/1/1/1\n", "site.obj:5: corner '3/1/1/1' is not"},
      {"f 1 2 3//\n", "site.obj:5: corner '3//' is not"},
      {"f 1 2 3.5\n", "site.obj:5: corner '3.5' is not"},
      {"f 1 2 99999999999999999999\n", "site.obj:5: corner '99999999999999999999' is not"},
      {"f 1 2 4000000000\n", "names a vertex that does not exist"},
      {"v 1 2\nf 1 2 3\n", "site.obj:5: a vertex needs three coordinates, found 2"},
      {"v 1 2 z\nf 1 2 3\n", "site.obj:5: coordinate 'z' is not a number"},
      {"v 1 2 nan\nf 1 2 3\n", "site.obj:5: coordinate 'nan' is not within 1e8 m"},
      {"v 1 2 1e300\nf 1 2 3\n", "site.obj:5: coordinate '1e300' is not within 1e8 m"},
      {"v 1 2 1e999\nf 1 2 3\n", "site.obj:5: coordinate '1e999' is not a number"},
      {"v 1,5 2 3\nf 1 2 3\n", "site.obj:5: coordinate '1,5' is not a number"},
      {"solid cube\n", "site.obj:5: unknown keyword 'solid'; is this a Wavefront OBJ file?"},
      {"\x01\x02\x7f\n",
       "site.obj:5: unknown keyword '"
       "??"
       "?'"},
      {"", "site.obj:4: no faces: nothing to scan"},
      {"f 1 1 2\n", "no faces: nothing to scan"},
  };
  for (const Broken& broken : table) {
    const auto parsed = parse_on_square(broken.text);
    ASSERT_THAT(parsed.errors, testing::Not(IsEmpty())) << broken.text;
    EXPECT_THAT(parsed.errors[0], HasSubstr(broken.message));
    EXPECT_THAT(parsed.mesh.triangles, IsEmpty()) << broken.text;
  }
}

TEST(ParseObj, ReportsAllErrorsOfOneRunUpToTwenty) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += "f 1 2\n";
  EXPECT_THAT(parse_on_square(text).errors, SizeIs(3));
  for (int i = 0; i < 100; ++i) text += "f 1 2\n";
  const auto many = parse_on_square(text).errors;
  EXPECT_THAT(many, SizeIs(20));
  EXPECT_THAT(many.back(), HasSubstr("perhaps more"));
}

TEST(ParseObj, CountsLinesThroughContinuations) {
  const auto parsed = parse("v 0 \\\n 0 \\\n 0\nfoo\n");
  ASSERT_THAT(parsed.errors, SizeIs(1));
  EXPECT_THAT(parsed.errors[0], HasSubstr("site.obj:4: unknown keyword"));
}

TEST(LoadObj, NamesAFileThatDoesNotExist) {
  const auto parsed = sim::load_obj("/nonexistent/model.obj");
  ASSERT_THAT(parsed.errors, SizeIs(1));
  EXPECT_THAT(parsed.errors[0], HasSubstr("/nonexistent/model.obj: cannot be read"));
}

TEST(LoadObj, ReadsWhatParseReads) {
  const auto file = std::filesystem::temp_directory_path() / "vantage_mesh_test.obj";
  std::ofstream(file) << kSquare << "f 1 2 3 4\n";
  const auto parsed = sim::load_obj(file);
  std::filesystem::remove(file);
  EXPECT_THAT(parsed.errors, IsEmpty());
  EXPECT_THAT(parsed.mesh.triangles, SizeIs(2));
}

}  // namespace
