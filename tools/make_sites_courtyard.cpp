// After East Campus (paper 4.3): a low block in front, a high block behind, and between them a
// courtyard into which enclosed stairwells jut.
#include <string>

#include "tools/make_sites_site.hpp"

namespace sites {
namespace {

using Eigen::Vector2d;

constexpr double kEnd = 50.4;                          // Both blocks reach from -kEnd to kEnd.
constexpr double kLowFront = -33.6, kLowBack = -17.4;  // The low block, south.
constexpr double kHighFront = 16.6, kHighBack = 34.4;  // The high block, north.
constexpr double kHighTop = 46.4;
constexpr double kEastLink = 44.4;  // West face of the building that closes the east end.

Path low_block() {
  return rectangle(-kEnd, kLowFront, kEnd, kLowBack);
}
Path high_block() {
  return rectangle(-kEnd, kHighFront, kEnd, kHighBack);
}
Path east_link() {
  return rectangle(kEastLink, kLowBack, kEnd, kHighFront);
}
// Two pieces of wall and the gate between them close the west end.
Path west_wall(double side) {
  return side < 0 ? rectangle(-kEnd, kLowBack, -kEnd + 0.8, -2.6)
                  : rectangle(-kEnd, 2.6, -kEnd + 0.8, kHighFront);
}
Path gate() {
  return rectangle(-kEnd + 0.2, -2.6, -kEnd + 0.6, 2.6);
}

struct Stairwell {
  std::string name;
  Path outline;
  double top_z;
};

std::vector<Stairwell> stairwells() {
  const auto round = [](double x, double y, double from_deg) {
    return arc({x, y}, 3.2, from_deg, from_deg + 180, 8);
  };
  return {{"stairwell low west", rectangle(-32.6, kLowBack, -27.4, -11.6), 21.4},
          {"stairwell low middle", rectangle(-6.4, kLowBack, -1.2, -11.0), 21.4},
          {"stairwell low east", round(22.3, kLowBack, 0), 22.4},
          {"stairwell high west", rectangle(-20.6, 10.4, -14.4, kHighFront), 31.4},
          {"stairwell high middle", round(9.7, kHighFront, 180), 49.4},
          {"stairwell high east", rectangle(29.4, 9.6, 35.6, kHighFront), 31.4}};
}

std::vector<Path> planters() {
  return {rectangle(-13.4, -3.3, -4.6, -0.3), rectangle(13.6, 0.6, 22.4, 3.4)};
}

void add_low_block(Model& model) {
  const Part block(model, "low_block");
  block.prism({low_block(), {}}, 0, 17.2);
  block.prism({low_block(), {moved_edges(low_block(), -0.4)}}, 17.2, 18.2);
  block.box(-kEnd + 2.6, kLowFront + 2.6, kEnd - 2.6, kLowBack - 3.4, 17.2, 20.8);
}

// Balconies on the court side hide the walls above them from the ground.
void add_balconies(const Part& part) {
  const double spans[][2] = {{-47, -23}, {-11, 5}, {16, 27}, {38, 43.5}};
  for (const double z : {9.2, 18.4, 27.6, 36.8}) {
    for (const auto& span : spans) {
      part.box(span[0], kHighFront - 1.4, span[1], kHighFront + 0.2, z, z + 0.3);
      part.box(span[0], kHighFront - 1.4, span[1], kHighFront - 1.2, z + 0.3, z + 1.3);
    }
  }
}

void add_high_block(Model& model) {
  const Part block(model, "high_block");
  block.prism({high_block(), {}}, 0, kHighTop);
  block.prism({high_block(), {moved_edges(high_block(), -0.4)}}, kHighTop, kHighTop + 1);
  block.box(-21, 21, 17, 29, kHighTop, 50.4);
  add_balconies(Part(model, "balconies"));
}

void add_court(Model& model) {
  for (const Stairwell& well : stairwells()) {
    const Part part(model, "stairwells");
    part.prism({well.outline, {}}, 0, well.top_z);
  }
  for (const Path& outline : planters()) Part(model, "planters").prism({outline, {}}, 0, 0.9);
  Part(model, "east_link").prism({east_link(), {}}, 0, 9.6);
  for (const double side : {-1.0, 1.0})
    Part(model, "west_wall").prism({west_wall(side), {}}, 0, 3.6);
  Part(model, "west_gate").prism({gate(), {}}, 0, 2.8);
  // A covered bridge from block to block, above the court.
  const Part bridge(model, "bridge");
  bridge.box(-41.6, kLowBack - 0.2, -38.4, kHighFront + 0.2, 6.8, 7.2);
  bridge.box(-41.6, kLowBack - 0.2, -41.3, kHighFront + 0.2, 7.2, 8.4);
  bridge.box(-38.7, kLowBack - 0.2, -38.4, kHighFront + 0.2, 7.2, 8.4);
  for (const double y : {-9.0, -0.5, 8.0}) {
    bridge.box(-41.6, y, -41.3, y + 0.3, 8.4, 10.0);
    bridge.box(-38.7, y, -38.4, y + 0.3, 8.4, 10.0);
  }
  bridge.gable_y(-42.0, kLowBack - 0.2, -38.0, kHighFront + 0.2, 10.0, 10.9);
}

void map_obstacles(Site& site) {
  site.obstacle("low block", low_block());
  site.obstacle("high block", high_block());
  site.obstacle("east link", east_link());
  site.obstacle("west wall south", west_wall(-1));
  site.obstacle("west wall north", west_wall(1));
  site.obstacle("gate", gate());
  for (const Stairwell& well : stairwells()) site.obstacle(well.name, well.outline);
  for (const Path& outline : planters()) site.obstacle("planter", outline);
}

constexpr const char* kAbout =
    R"(Two parallel blocks of 101 m: the low one in front (16 m deep, 18 m high, top floor set back
to 21 m), the high one behind (18 m deep, 47 m high). Between them a courtyard of 94 x 34 m,
closed at the east by a building of 10 m and at the west by a wall of 3.6 m with a shut
gate. 120 x 90 m in all.

- Six enclosed stairwells jut 3 to 6 m into the courtyard (two of them half-round) and rise to 21
  to 49 m: they hide the corners behind them from one another.
- Balconies on the high block, a covered bridge across the courtyard at 7 to 11 m and the set-back
  top floor are in no map; each hides walls above it from the ground.
- The stairwells, walls and the link touch the blocks edge to edge in the map, as drawn plans do.
- The robot works in the region `courtyard`; the world outside is drawn, not surveyed.
)";

}  // namespace

Site make_courtyard() {
  Site site{
      .name = "courtyard",
      .title = "a courtyard with stairwells between a low and a high block, after East Campus",
      .about = kAbout};
  site.model.surface("ground", {rectangle(-60, -45, 60, 45), {}}, 0);
  add_low_block(site.model);
  add_high_block(site.model);
  add_court(site.model);
  site.boundary(rectangle(-60, -45, 60, 45), false);
  map_obstacles(site);
  site.region("courtyard", {rectangle(-kEnd + 0.4, kLowBack - 1, kEnd - 1, kHighFront + 1), {}}, 0);
  site.start({-45.5, -6.5}, 0);
  return site;
}

}  // namespace sites
