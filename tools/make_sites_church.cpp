// After Saint Menoux (paper 3.1.2): the inside of a Romanesque church.
#include <cmath>

#include "tools/make_sites_site.hpp"

namespace sites {
namespace {

using Eigen::Vector2d;

constexpr double kAisle = 7.3;      // Aisle walls at y = -kAisle and kAisle.
constexpr double kArcade = 3.7;     // Axis of the rows of columns.
constexpr double kNaveInner = 3.3;  // Inner faces of the walls above the columns.
constexpr double kNaveOuter = 4.1;
constexpr double kTransept = 9.9;  // End walls of the transept.
constexpr double kWestCrossing = 23.0, kEastCrossing = 30.0;
constexpr double kApseX = 37.0;      // Centre of the round east end.
constexpr double kCapitalZ = 4.2;    // Top of the columns.
constexpr double kAisleZ = 6.8;      // Ceiling of aisles and ambulatory.
constexpr double kSpringZ = 9.8;     // Where the barrel vaults begin.
constexpr double kTranseptZ = 14.0;  // Its timber ceiling.
constexpr double kWallTop = 14.4;

const std::vector<double> kNaveColumnX{3.8, 7.6, 11.4, 15.2, 19.0};
const std::vector<double> kChoirColumnX{33.5, 37.0};

double radians(double degrees) {
  return degrees * std::acos(-1.0) / 180;
}
Vector2d around_apse(double radius, double deg) {
  return {kApseX + radius * std::cos(radians(deg)), radius * std::sin(radians(deg))};
}

// A chapel of 3.2 m in the ambulatory wall: straight in, then half round.
Path chapel(double at_deg) {
  const double half = 1.6, neck = kAisle + 0.5;
  const double opening_deg = std::asin(half / kAisle) * 180 / std::acos(-1.0);
  const Path round = placed(arc({neck, 0}, half, -90, 90, 8), at_deg, {kApseX, 0});
  return joined({{around_apse(kAisle, at_deg - opening_deg)},
                 round,
                 {around_apse(kAisle, at_deg + opening_deg)}});
}

// The free space inside, counter-clockwise from the south-west corner.
Path interior() {
  Path path{{0, -kAisle},
            {kWestCrossing, -kAisle},
            {kWestCrossing, -kTransept},
            {kEastCrossing, -kTransept},
            {kEastCrossing, -kAisle},
            {kApseX, -kAisle}};
  for (const double deg : {-66.0, -33.0, 0.0, 33.0, 66.0}) path = joined({path, chapel(deg)});
  return joined({path,
                 {{kApseX, kAisle},
                  {kEastCrossing, kAisle},
                  {kEastCrossing, kTransept},
                  {kWestCrossing, kTransept},
                  {kWestCrossing, kAisle},
                  {0, kAisle}}});
}

Path exterior() {
  const double wall = 1.1, end = 10.6;
  return joined({{{-wall, -kAisle - wall},
                  {21.9, -kAisle - wall},
                  {21.9, -kTransept - wall},
                  {31.1, -kTransept - wall},
                  {31.1, -end}},
                 arc({kApseX, 0}, end, -90, 90, 16),
                 {{31.1, end},
                  {31.1, kTransept + wall},
                  {21.9, kTransept + wall},
                  {21.9, kAisle + wall},
                  {-wall, kAisle + wall}}});
}

std::vector<Path> columns() {
  std::vector<Path> all;
  const auto pair = [&](double x, double radius) {
    for (const double y : {-kArcade, kArcade}) all.push_back(regular({x, y}, radius, 12, 15));
  };
  for (const double x : kNaveColumnX) pair(x, 0.48);
  for (const double x : kChoirColumnX) pair(x, 0.45);
  for (const double deg : {-54.0, -18.0, 18.0, 54.0}) {
    all.push_back(regular(around_apse(kArcade, deg), 0.42, 12, 15));
  }
  return all;
}

// A shaft under a square capital that carries the corners of the wall above.
void add_column(const Part& part, const Path& shaft) {
  Vector2d center{0, 0};
  for (const Vector2d& corner : shaft) center += corner / static_cast<double>(shaft.size());
  part.prism({shaft, {}}, 0, kCapitalZ - 0.3);
  part.prism({placed(rectangle(-0.55, -0.55, 0.55, 0.55), 0, center), {}}, kCapitalZ - 0.3,
             kCapitalZ + 0.1);
}

std::vector<Path> piers() {
  std::vector<Path> all;
  for (const double x : {kWestCrossing, kEastCrossing}) {
    for (const double y : {-kArcade, kArcade})
      all.push_back(rectangle(x - 0.75, y - 0.75, x + 0.75, y + 0.75));
  }
  return all;
}

Path altar() {
  return rectangle(38.2, -1.2, 39.4, 1.2);
}
Path font() {
  return regular({1.9, -1.2}, 0.6, 8, 22.5);
}

// Points of an arch from right to left when counter-clockwise.
Path arch(double center, double radius, double spring_z, bool leftwards, int pieces = 10) {
  const Path half = arc({center, spring_z}, radius, 0, 180, pieces);
  return leftwards ? half : reversed(half);
}

// The wall on a row of columns: arches between them, flat on top.
void add_arcade(const Part& part, const std::vector<double>& supports_x, double radius) {
  Path wall{{0, kCapitalZ}};
  const double x0 = supports_x.front();
  for (std::size_t i = 1; i < supports_x.size(); ++i) {
    const double middle = (supports_x[i - 1] + supports_x[i]) / 2 - x0;
    wall = joined({wall, arch(middle, radius, kCapitalZ, false)});
  }
  const double length = supports_x.back() - x0;
  wall = joined({wall, {{length, kCapitalZ}, {length, kSpringZ + 0.8}, {0, kSpringZ + 0.8}}});
  part.panel({wall, {}}, {x0, -kNaveInner}, {x0 + length, -kNaveInner}, kNaveOuter - kNaveInner);
  part.panel({wall, {}}, {x0, kNaveOuter}, {x0 + length, kNaveOuter}, kNaveOuter - kNaveInner);
}

// A half-round vault over the nave from x0 to x1; the elevation runs along +y, the slab along +x.
void add_barrel(const Part& part, double x0, double x1, double inner, double outer) {
  const Path ring =
      joined({arc({0, kSpringZ}, outer, 0, 180, 16), arc({0, kSpringZ}, inner, 180, 0, 16)});
  part.panel({ring, {}}, {x0, 0}, {x0, 1}, x1 - x0);
}

void add_nave_and_choir(Model& model) {
  const Part arcade(model, "arcades");
  const double west = kWestCrossing - 0.3, east = kEastCrossing + 0.3;
  add_arcade(arcade, {0, 3.8, 7.6, 11.4, 15.2, 19.0, west}, 1.42);
  add_arcade(arcade, {east, 33.5, 37.0}, 1.18);
  const Part vault(model, "vaults");
  add_barrel(vault, -0.2, west, kNaveInner, kNaveInner + 0.6);
  add_barrel(vault, east, kApseX, kNaveInner, kNaveInner + 0.6);
  const Part ribs(model, "ribs");
  for (const double x : kNaveColumnX)
    add_barrel(ribs, x - 0.3, x + 0.3, kNaveInner - 0.3, kNaveInner + 0.1);
  add_barrel(ribs, 33.2, 33.8, kNaveInner - 0.3, kNaveInner + 0.1);
  // Arches across the aisles, from the columns to the outer wall.
  const auto across = [&](double x, double y0) {
    const Path wall = joined({{{0, kCapitalZ}},
                              arch(1.8, 1.55, kCapitalZ, false),
                              {{3.6, kCapitalZ}, {3.6, kAisleZ + 0.1}, {0, kAisleZ + 0.1}}});
    ribs.panel({wall, {}}, {x - 0.25, y0}, {x - 0.25, y0 + 3.6}, 0.5);
  };
  for (const std::vector<double>* row : {&kNaveColumnX, &kChoirColumnX}) {
    for (const double x : *row) {
      across(x, kArcade);
      across(x, -kArcade - 3.6);
    }
  }
}

// The walls across nave and aisles at the crossing, with one arch for each.
void add_crossing(Model& model) {
  const Part part(model, "crossing");
  const double low = kCapitalZ + 0.6, half = kAisle + 0.3;
  const Path wall = joined({{{-half, low}},
                            arch(-5.75, 1.3, low, false, 8),
                            {{-kNaveInner, low}},
                            arch(0, kNaveInner, kSpringZ, false, 16),
                            {{kNaveInner, low}},
                            arch(5.75, 1.3, low, false, 8),
                            {{half, low}, {half, kTranseptZ + 0.2}, {-half, kTranseptZ + 0.2}}});
  for (const double x : {kWestCrossing, kEastCrossing}) {
    part.panel({wall, {}}, {x - 0.3, 0}, {x - 0.3, 1}, 0.6);
  }
  for (const Path& pier : piers()) part.prism({pier, {}}, 0, low + 0.2);
}

// The round end: a wall on the columns of the hemicycle, and half a dome.
void add_apse(Model& model) {
  const Part part(model, "apse");
  const Path wall = joined(
      {arc({kApseX, 0}, kNaveOuter, -90, 90, 20), arc({kApseX, 0}, kNaveInner, 90, -90, 20)});
  part.prism({wall, {}}, kCapitalZ, kSpringZ + 0.8);
  const Path shell = joined(
      {arc({0, kSpringZ}, kNaveInner + 0.6, 0, 90, 8), arc({0, kSpringZ}, kNaveInner, 90, 0, 8)});
  std::vector<Section> sections;
  for (int i = 0; i <= 16; ++i) {  // An elevation frame's +z runs clockwise round the axis.
    const Vector2d axis(kApseX, 0);
    sections.push_back({{shell, {}}, elevation_frame(axis, around_apse(1, 90 - 11.25 * i))});
  }
  part.sections(sections);
}

void add_ceilings(Model& model) {
  const Part part(model, "ceilings");
  for (const double side : {-1.0, 1.0}) {
    const double y0 = side < 0 ? -kAisle - 0.4 : kNaveInner + 0.2;
    part.box(-0.3, y0, kWestCrossing, y0 + kAisle + 0.2 - kNaveInner, kAisleZ, kAisleZ + 0.4);
  }
  const double outer = 9.9;
  const Path ambulatory = joined({{{kEastCrossing, -outer}},
                                  arc({kApseX, 0}, outer, -90, 90, 16),
                                  {{kEastCrossing, outer}, {kEastCrossing, kNaveInner + 0.2}},
                                  arc({kApseX, 0}, kNaveInner + 0.2, 90, -90, 16),
                                  {{kEastCrossing, -kNaveInner - 0.2}}});
  part.prism({ambulatory, {}}, kAisleZ, kAisleZ + 0.4);
  part.box(kWestCrossing - 0.3, -kTransept - 0.3, kEastCrossing + 0.3, kTransept + 0.3, kTranseptZ,
           kTranseptZ + 0.3);
  for (int i = 0; i < 8; ++i) {  // Beams.
    const double y = -8.75 + 2.5 * i;
    part.box(kWestCrossing - 0.2, y - 0.2, kEastCrossing + 0.2, y + 0.2, kTranseptZ - 0.4,
             kTranseptZ + 0.1);
  }
  part.prism({exterior(), {}}, kWallTop, kWallTop + 0.4);
}

constexpr const char* kAbout =
    R"(The inside of a church of 49 x 22 m: a nave of 23 m with two aisles, a transept of 7 x 20 m,
a choir, and a round apse with an ambulatory and five chapels. Everything is closed: what a
scan cannot see inside, it cannot see at all.

- Columns of twelve sides (0.84 to 0.96 m thick, 18 of them) and four crossing piers of 1.5 m
  stand 3.7 m from the axis; the gaps between them let a robot of 0.5 m radius through.
- Nave and choir: barrel vault from 9.8 to 13.1 m with ribs. Aisles and ambulatory: 6.8 m with an
  arch at every column. Transept: timber ceiling at 14 m with beams. Apse: half a dome.
- The outer wall is one obstacle with a hole: its hole is the free space. Altar (1.1 m) and font
  (1 m) are obstacles in the map and low in truth.
)";

}  // namespace

Site make_church() {
  Site site{
      .name = "church", .title = "the inside of a church, after Saint Menoux", .about = kAbout};
  Model& model = site.model;
  model.surface("ground", {rectangle(-1.6, -11.5, 48.1, 11.5), {}}, 0);
  Part(model, "walls").prism({exterior(), {interior()}}, 0, kWallTop);
  for (const Path& column : columns()) add_column(Part(model, "columns"), column);
  add_nave_and_choir(model);
  add_crossing(model);
  add_apse(model);
  add_ceilings(model);
  Part(model, "furniture").prism({altar(), {}}, 0, 1.1);
  Part(model, "furniture").prism({font(), {}}, 0, 1.0);

  site.boundary(rectangle(-1.6, -11.5, 48.1, 11.5), false);
  site.add("obstacle", "walls").rings = {exterior(), interior()};
  for (std::size_t i = 0; i < columns().size(); ++i) {
    site.obstacle("column " + std::to_string(i + 1), columns()[i]);
  }
  for (const Path& pier : piers()) site.obstacle("crossing pier", pier);
  site.obstacle("altar", altar());
  site.obstacle("font", font());
  site.region("interior", {interior(), {}}, 0);
  site.start({5.6, 0.4}, 0);
  return site;
}

}  // namespace sites
