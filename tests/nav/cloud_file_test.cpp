// Clouds as other programs write them, and what is said of those that are not.
#include "nav/registration/cloud_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/support/scans.hpp"

namespace {

using nav::parse_cloud;
using nav::Points;

const Points kPoints{{1.5F, -2, 0.25F}, {3, 4, 5}};

template <class Number>
std::string raw(Number value, bool swap = false) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string error(std::string_view bytes) {
  const auto cloud = parse_cloud(bytes, "a.ply");
  return cloud ? "no error" : cloud.error().text();
}

TEST(CloudFile, PlyInAscii) {
  EXPECT_EQ(parse_cloud("ply\nformat ascii 1.0\ncomment c\nelement camera 1\nproperty float f\n"
                        "element vertex 2\nproperty uchar red\nproperty float x\nproperty float y\n"
                        "property double z\nend_header\n7\n255 1.5 -2 0.25\n0 3 4 5\n",
                        "a.ply")
                .value(),
            kPoints);
}

TEST(CloudFile, PlyInBinaryOfEitherByteOrderWithListsAndOtherNumbers) {
  for (const bool big : {false, true}) {
    std::string bytes = "ply\r\nformat ";
    bytes += big ? "binary_big_endian" : "binary_little_endian";
    bytes +=
        " 1.0\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\n"
        "element vertex 2\r\nproperty double x\r\nproperty float y\r\n"
        "property list uint8 float more\r\nproperty float z\r\nend_header\r\n";
    bytes += raw<std::uint8_t>(3) + raw(0, big) + raw(1, big) + raw(2, big);
    bytes +=
        raw(1.5, big) + raw(-2.F, big) + raw<std::uint8_t>(1) + raw(9.F, big) + raw(0.25F, big);
    bytes += raw(3., big) + raw(4.F, big) + raw<std::uint8_t>(0) + raw(5.F, big);
    EXPECT_EQ(parse_cloud(bytes, "a.ply").value(), kPoints) << big;
    bytes.pop_back();
    EXPECT_EQ(error(bytes), "a.ply: cut short: 1 of 2 points are there; copy the file again");
  }
}

const std::string kPcd =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS label x y z\nSIZE 2 4 4 8\nTYPE U F F F\nCOUNT 2 1 1 1\n"
    "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";

TEST(CloudFile, PcdInAsciiAndBinary) {
  EXPECT_EQ(parse_cloud(kPcd + "ascii\n7 8 1.5 -2 0.25\n7 8 3 4 5\n", "a.pcd").value(), kPoints);
  const std::string labels = raw<std::uint16_t>(7) + raw<std::uint16_t>(8);
  const std::string bytes = kPcd + "binary\n" + labels + raw(1.5F) + raw(-2.F) + raw(0.25) +
                            labels + raw(3.F) + raw(4.F) + raw(5.0);
  EXPECT_EQ(parse_cloud(bytes, "a.pcd").value(), kPoints);
  EXPECT_EQ(error(bytes.substr(0, bytes.size() - 1)),
            "a.ply: cut short: 1 of 2 points are there; copy the file again");
}

// LZF with nothing saved, and with a run that repeats what it has just written.
TEST(CloudFile, PcdCompressed) {
  const std::string fields = raw<std::uint32_t>(0) + raw<std::uint32_t>(0) + raw(1.5F) + raw(3.F) +
                             raw(-2.F) + raw(4.F) + raw(0.25) + raw(5.0);
  ASSERT_EQ(fields.size(), 40U);
  const auto file = [](const std::string& packed) {
    return kPcd + "binary_compressed\n" + raw(static_cast<std::uint32_t>(packed.size())) +
           raw<std::uint32_t>(40) + packed;
  };
  const std::string plain =
      std::string(1, 31) + fields.substr(0, 32) + std::string(1, 7) + fields.substr(32);
  EXPECT_EQ(parse_cloud(file(plain), "a.pcd").value(), kPoints);
  // One zero, then seven more from one back: 5 << 5 is seven bytes.
  const std::string repeats = std::string("\0\0\xa0\0", 4) + std::string(1, 31) + fields.substr(8);
  EXPECT_EQ(parse_cloud(file(repeats), "a.pcd").value(), kPoints);
  EXPECT_NE(error(file(plain.substr(0, 20))).find("damaged or cut short"), std::string::npos);
  EXPECT_NE(error(file(std::string("\xa0\x05", 2))).find("damaged"), std::string::npos);
}

TEST(CloudFile, TextWithAndWithoutAHeader) {
  for (const std::string text :
       {"1.5 -2 0.25\n3 4 5\n", "# by hand\r\n1.5,-2,0.25\r\n\r\n3,4,5",
        "x,y,z,nx\n1.5,-2,0.25,1\n3,4,5,1\n", "//X Y Z\n1.5;-2;0.25\n3;4;5\n",
        "i;Z;Y;X\n1;0.25;-2;1.5\n2;5;4;+3e0\n", "2\n1.5 -2 0.25\n3 4 5\n"})
    EXPECT_EQ(parse_cloud(text, "a.xyz").value(), kPoints) << text;
}

TEST(CloudFile, PointsThatAreNotANumberAreKeptForTheUserToCount) {
  const auto points = parse_cloud("nan nan nan\n1 2 3\n", "a.xyz").value();
  ASSERT_EQ(points.size(), 2U);
  EXPECT_TRUE(std::isnan(points[0].x()));
}

TEST(CloudFile, SaysWhichLineAndFieldIsWrongAndWhatToDo) {
  EXPECT_EQ(error("1 2 3\n1 2,x 3\n"),
            "a.ply:2: column 3 (z): 'x' is not a number; write metres with a decimal point");
  EXPECT_EQ(error("1 2 3\n1 2\n"),
            "a.ply:2: 2 columns where x, y and z need 3: complete or delete the line");
  EXPECT_EQ(error("lat,lon\n1,2\n"),
            "a.ply:1: the header 'lat,lon' names no columns x, y and z: "
            "name them so, or leave the header out");
  EXPECT_EQ(error(""), "a.ply: no points in it: expected lines of x y z in metres");
  EXPECT_EQ(error(std::string("LASF\0\0", 6)),
            "a.ply: binary, but neither PLY nor PCD: convert it to one of PLY, PCD, CSV, XYZ");
  EXPECT_EQ(error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                  "end_header\n1 2\n"),
            "a.ply: element vertex has no property z: export the points with x, y and z");
  EXPECT_EQ(error("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n"),
            "a.ply:4: no such type: 'half'; PLY knows char to double");
  EXPECT_EQ(error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                  "property float z\nend_header\n1 2 three\n"),
            "a.ply:8: property z: 'three' is not a number; repair or export again");
  EXPECT_NE(error("ply\nformat ascii 1.0\n").find("end_header is missing"), std::string::npos);
  EXPECT_EQ(error("VERSION 0.7\nFIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n"),
            "a.ply: FIELDS has no z: export the points with x, y and z");
  EXPECT_EQ(error("VERSION 0.7\nFIELDS x y z\nSIZE 4 4\n"),
            "a.ply:3: SIZE says 2 values for 3 fields");
  EXPECT_EQ(error("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n"),
            "a.ply:6: field z: no number has TYPE F and SIZE 3");
}

TEST(CloudFile, RealFilesHaveTheirNumberOfPoints) {
  SCANS_OR_SKIP("pair_small_gicp");
  const std::pair<const char*, std::size_t> files[] = {
      {"pair_small_gicp/source.ply", 69792},
      {"pair_libpointmatcher_car/car_cloud400.csv", 24989},
      {"pair_libpointmatcher_car/car_cloud401.csv", 25193},
      {"imm_stop_and_go_a/scan001.pcd", 39534}};
  for (const auto& [file, count] : files)
    EXPECT_EQ(parse_cloud(scans::bytes_of(scans::folder() / file), file).value().size(), count);
}

}  // namespace
