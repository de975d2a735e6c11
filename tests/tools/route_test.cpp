// `vantage route` as a person or a script runs it.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/xml_check.hpp"
#include "tests/tools/vantage_test.hpp"

namespace {

using test::Outcome;
using testing::HasSubstr;

// A yard of 40 x 20 m, cut in two by a wall with a gate of 3 m, and a yard beside it.
class RouteCommand : public test::VantageTest {
 protected:
  RouteCommand() {
    write("site/footprint.geojson", R"({"type":"FeatureCollection","features":[
      {"type":"Feature","properties":{"role":"boundary"},"geometry":{"type":"Polygon",
        "coordinates":[[[0,0],[60,0],[60,20],[0,20],[0,0]]]}},
      {"type":"Feature","properties":{},"geometry":{"type":"Polygon",
        "coordinates":[[[19,0],[21,0],[21,15],[19,15],[19,0]]]}},
      {"type":"Feature","properties":{},"geometry":{"type":"Polygon",
        "coordinates":[[[19,18],[21,18],[21,20],[19,20],[19,18]]]}},
      {"type":"Feature","properties":{},"geometry":{"type":"Polygon",
        "coordinates":[[[40,0],[41,0],[41,20],[40,20],[40,0]]]}}]})");
  }
  Outcome route(const std::string& from, const std::string& to, const std::string& more = "") {
    return run("route --site " + (folder_.path() / "site").string() + " '--from=" + from +
               "' '--to=" + to + "' " + more);
  }
};

TEST_F(RouteCommand, LeadsThroughTheGate) {
  const Outcome outcome = route("10,5", "30,5", "--json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto answer = outcome.json();
  const double length_m = answer.at("length_m").to_number<double>();
  const double shortest_m = 2 * std::hypot(9, 10) + 2;
  EXPECT_GT(length_m, shortest_m);
  EXPECT_LT(length_m, 1.1 * shortest_m);
  EXPECT_GE(answer.at("clearance_min_m").to_number<double>(), 0.475);
  EXPECT_LE(answer.at("clearance_min_m").to_number<double>(), 1.5);
  EXPECT_GT(answer.at("time_s").to_number<double>(), length_m);  // At 1 m/s at most.
  EXPECT_LT(answer.at("time_s").to_number<double>(), 2 * length_m + 20);
  EXPECT_NEAR(answer.at("straight_m").to_number<double>(), 20, 1e-9);
  const auto& points = answer.at("points_m").as_array();
  EXPECT_EQ(points.front().at(0).to_number<double>(), 10);
  EXPECT_EQ(points.back().at(0).to_number<double>(), 30);
  EXPECT_EQ(answer.at("clearance_m").as_array().size() + 1, points.size());
}

TEST_F(RouteCommand, TellsThePersonInOneLine) {
  const Outcome outcome = route("5,5", "15,5");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("10.0 m in "));
  EXPECT_THAT(outcome.out, HasSubstr("clear at the narrowest"));
}

TEST_F(RouteCommand, GoesNowhereFromAPlaceToItself) {
  const Outcome outcome = route("5,5", "5,5", "--json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.json().at("length_m").to_number<double>(), 0);
  EXPECT_NEAR(outcome.json().at("clearance_min_m").to_number<double>(), 5, 0.01);
}

TEST_F(RouteCommand, DrawsAPicture) {
  const auto svg = folder_.path() / "way.svg";
  const Outcome outcome = route("10,5", "30,5", "--svg " + svg.string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string text = test::read_text(svg);
  EXPECT_EQ(text.rfind("<svg", 0), 0U);
  EXPECT_THAT(text, HasSubstr("class=\"driven\""));
  EXPECT_THAT(text, HasSubstr("m clear at the narrowest"));
}

TEST_F(RouteCommand, SaysWhyThereIsNoneAndWhatToDo) {
  struct Case {
    const char *from, *to;
    std::vector<std::string> says;
  };
  const Case cases[] = {
      {"20,5",
       "30,5",
       {"--from 20,5", "outside the free space", "nearest place where it can stand"}},
      {"10,5", "18.8,5", {"--to 18.8,5", "radius of 0.5 m", "18.50,5.00"}},
      {"10,5", "50,5", {"--to 50,5", "no road for a robot of 0.5 m radius", "radius_m"}},
      {"10;5", "30,5", {"--from", "10;5"}},
      {"10,5", "100,5", {"--to 100,5", "outside the free space"}}};
  for (const Case& one : cases) {
    const Outcome outcome = route(one.from, one.to, "--json");
    EXPECT_EQ(outcome.code, 2) << one.to;
    for (const std::string& part : one.says) EXPECT_THAT(outcome.err, HasSubstr(part));
    EXPECT_FALSE(outcome.json().at("ok").as_bool());
  }
}

}  // namespace
