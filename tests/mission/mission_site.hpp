// A site of one small house in a yard, and a robot with few beams: a whole mission through drivers
// and units in about a second.
#pragma once

#include <array>
#include <fstream>
#include <string>

#include "mission/main_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace mission_test {

// Stands in for the shipped robot file where a test does not care.
inline const std::string kQuickRobot =
    "[scanner]\nazimuth_step_deg = 1.0\nelevation_step_deg = 0.5\nrange_max_m = 40\n"
    "[pan]\nangle_max_deg = 360\n";

class SmallSite {
 public:
  explicit SmallSite(const std::string& robot = kQuickRobot, int views_max = 0) {
    write("footprint.geojson",
          R"({"type":"Polygon","coordinates":[[[0,0],[6,0],[6,6],[0,6],[0,0]]]})");
    write("model.obj",
          "v -40 -40 0\nv 40 -40 0\nv 40 40 0\nv -40 40 0\n"
          "v 0 0 0\nv 6 0 0\nv 6 6 0\nv 0 6 0\nv 0 0 5\nv 6 0 5\nv 6 6 5\nv 0 6 5\n"
          "f 1 2 3\nf 1 3 4\nf 5 6 10\nf 5 10 9\nf 6 7 11\nf 6 11 10\nf 7 8 12\nf 7 12 11\n"
          "f 8 5 9\nf 8 9 12\nf 9 10 11\nf 9 11 12\n");
    write("robot.toml", robot);
    write("mission.toml",
          "robot = \"robot.toml\"\nsite = \".\"\nmargin_m = 10.0\n[phase1]\ncandidates = 100\n"
          "[phase2]\nheight_m = 10.0\nheight_max_m = 10.0\ngain_min_voxels = 10\n"
          "views_max = " +
              std::to_string(views_max) + "\n");
  }

  // A robot file in place of the site's own; empty: that.
  std::filesystem::path robot_file;

  mission::Prepared prepared() const {
    return mission::prepare(
        folder_.path() / "mission.toml",
        {.site_folder = {}, .robot_file = robot_file, .has_seed = false, .seed = 0},
        mission::WorldUse::world);
  }
  // Runs the mission; `watch` may break something as time goes on.
  mission::RunOutcome run(const std::function<void(mission::SimBackend&)>& watch = {},
                          bool resume = false) const {
    mission::Prepared ready = prepared();
    for (const auto& error : ready.errors) ADD_FAILURE() << error.text();
    return mission::run_in_simulation(ready, {.out = out(),
                                              .resume = resume,
                                              .judge_cells = {},
                                              .threads = 1,
                                              .progress = nullptr,
                                              .terminal = false,
                                              .watch = watch});
  }
  mission::RunOutcome go_on() const { return run({}, true); }  // With a run that was cut.
  std::filesystem::path out() const { return folder_.path() / "run"; }
  std::filesystem::path folder() const { return folder_.path(); }
  std::string summary() const {
    std::ifstream file(out() / "summary.json");
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
  }
  test::TempFolder folder_;
};

// Four houses at a crossing, in place of the one.
inline mission::Prepared crossing(const SmallSite& site) {
  struct Box {
    double x_m, y_m, width_m, depth_m;
  };
  std::string map, model = "v -60 -60 0\nv 80 -60 0\nv 80 80 0\nv -60 80 0\nf 1 2 3\nf 1 3 4\n";
  int corner = 5;
  for (const auto& [x, y, w, d] :
       {Box{0, 0, 6, 6}, Box{14, 0, 6, 5}, Box{0, 13, 7, 6}, Box{13, 12, 7, 8}}) {
    const double xs[] = {x, x + w, x + w, x}, ys[] = {y, y, y + d, y + d};
    map += map.empty() ? "[[" : ",[[";
    for (const int i : {0, 1, 2, 3, 0}) {
      if (i != 0 || !map.ends_with("[[")) map += ",";
      map += "[" + std::to_string(xs[i]) + "," + std::to_string(ys[i]) + "]";
    }
    map += "]]";
    for (const double z : {0.0, 5.0})
      for (int i = 0; i < 4; ++i)
        model += "v " + std::to_string(xs[i]) + " " + std::to_string(ys[i]) + " " +
                 std::to_string(z) + "\n";
    for (int i = 0; i < 4; ++i) {
      const int a = corner + i, b = corner + (i + 1) % 4;
      for (const auto& face : {std::array{a, b, b + 4}, std::array{a, b + 4, a + 4}})
        model += "f " + std::to_string(face[0]) + " " + std::to_string(face[1]) + " " +
                 std::to_string(face[2]) + "\n";
    }
    corner += 8;
  }
  std::ofstream(site.folder() / "footprint.geojson")
      << R"({"type":"MultiPolygon","coordinates":[)" << map << "]}";
  std::ofstream(site.folder() / "model.obj") << model;
  return site.prepared();
}

}  // namespace mission_test
