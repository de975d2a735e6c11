// After the Guggenheim Museum Bilbao (paper 4.2): curved volumes under overhanging roofs.
#include <cmath>

#include "tools/make_sites_site.hpp"

namespace sites {
namespace {

using Eigen::Vector2d;

double radians(double degrees) {
  return degrees * std::acos(-1.0) / 180;
}

// A soft, irregular outline: an ellipse whose radius swings `petals` times round.
struct Blob {
  Vector2d center;
  double rx{}, ry{};
  int petals{};
  double swing{};  // Share of the radius.
  double phase_deg{};
  double turn_deg{};
};

Path outline(const Blob& blob, int corners) {
  Path path;
  for (int i = 0; i < corners; ++i) {
    const double deg = 360.0 * i / corners;
    const double factor = 1 + blob.swing * std::cos(radians(blob.petals * (deg - blob.phase_deg)));
    path.emplace_back(blob.rx * factor * std::cos(radians(deg)),
                      blob.ry * factor * std::sin(radians(deg)));
  }
  return placed(path, blob.turn_deg, blob.center);
}

Blob scaled(Blob blob, double factor, Vector2d shift = {0, 0}, double more_swing = 0) {
  blob.rx *= factor;
  blob.ry *= factor;
  blob.center += shift;
  blob.swing += more_swing;
  return blob;
}

// ---- Galleries: an elevation swept along an arc -------------------------------------------------

struct Gallery {
  const char* name;
  Vector2d center;  // Of the arc.
  double radius{}, from_deg{}, to_deg{};
  double half_width{};
  double overhang{};  // Of the roof, on both sides.
  double wall_z{}, crown_z{};
  int pieces{};
};

Path gallery_outline(const Gallery& g) {
  return joined({arc(g.center, g.radius + g.half_width, g.from_deg, g.to_deg, g.pieces),
                 arc(g.center, g.radius - g.half_width, g.to_deg, g.from_deg, g.pieces)});
}

Vector2d on_arc(const Gallery& g, double share, double radius) {
  const double deg = g.from_deg + (g.to_deg - g.from_deg) * share;
  return g.center + radius * Vector2d(std::cos(radians(deg)), std::sin(radians(deg)));
}

// Walls, and a roof like an upturned boat whose edges hang over them. It swells towards the middle.
void add_gallery(Model& model, const Gallery& g) {
  const Part part(model, g.name);
  part.prism({gallery_outline(g), {}}, 0, g.wall_z + 0.2);
  std::vector<Section> sections;
  for (int i = 0; i <= g.pieces; ++i) {
    const double share = static_cast<double>(i) / g.pieces;
    const double swell = std::sin(radians(180 * share));
    const double reach = g.half_width + g.overhang * (0.4 + 0.6 * swell);
    const double rise = (g.crown_z - g.wall_z) * (0.6 + 0.4 * swell);
    Path roof;
    for (int k = 0; k <= 10; ++k) {
      const double a = radians(18.0 * k);
      roof.emplace_back(g.radius + reach * std::cos(a), g.wall_z + 0.4 + rise * std::sin(a));
    }
    roof.emplace_back(g.radius - reach, g.wall_z);
    roof.emplace_back(g.radius + reach, g.wall_z);
    // Elevation frames run clockwise along their +z, so the sweep goes from the end to the start.
    sections.push_back({{roof, {}}, elevation_frame(g.center, on_arc(g, 1 - share, g.radius))});
  }
  part.sections(sections);
}

// The long gallery bends along the river, the short ones lie behind.
const Gallery kBoat{"boat_gallery", {24, -98}, 74, 61, 100, 7.6, 3.2, 8.6, 14.4, 20};
const Gallery kFish{"fish_gallery", {-16, 66}, 62, 232, 284, 6.4, 2.4, 7.4, 12.6, 14};
const Gallery kLeaf{"leaf_gallery", {55, 46}, 44, 178, 224, 5.6, 1.8, 9.6, 14.8, 14};

// ---- Towers -------------------------------------------------------------------------------------

// The atrium: petals that grow with the height, a waist, and a wide brim.
const Blob kAtrium{{9, -7}, 12.4, 11.2, 5, 0.06, 20, 0};

void add_atrium(Model& model) {
  const auto at = [](double factor, double dx, double more_swing) {
    return Shape{outline(scaled(kAtrium, factor, {dx, dx / 2}, more_swing), 40), {}};
  };
  Part(model, "atrium")
      .taper({{at(1, 0, 0), 0},
              {at(1, 0, 0), 3},
              {at(0.93, 0.2, 0.02), 12},
              {at(0.86, 0.6, 0.05), 20},
              {at(0.98, 1.1, 0.10), 27},
              {at(1.06, 1.5, 0.12), 32},
              {at(0.80, 1.6, 0.10), 37},
              {at(0.34, 1.2, 0.02), 41}});
}

// Walls that lean out from 1 m above the ground, then close in: a flower bud.
const Blob kBud{{-10.2, -14.0}, 10.2, 8.4, 3, 0.08, 50, 25};

void add_bud(Model& model) {
  const auto at = [](double factor) { return Shape{outline(scaled(kBud, factor), 32), {}}; };
  Part(model, "bud")
      .taper({{at(1), 0},
              {at(1), 1},
              {at(1.10), 6},
              {at(1.24), 12},
              {at(1.32), 16},
              {at(1.22), 19},
              {at(0.86), 22},
              {at(0.40), 23.5}});
}

struct Spire {
  const char* name;
  Blob foot;
  double top_z{};
  Vector2d lean;  // Of its top.
  double top_factor{};
};

const Spire kBridgeTower{
    "bridge_tower", {{57, -36}, 5.4, 3.4, 2, 0.05, 0, 30}, 36, {2.5, -1.5}, 0.45};
const Spire kNorthTower{"north_tower", {{-47, 24}, 4.6, 4.6, 3, 0.10, 15, 0}, 27, {-2.0, 1.2}, 0.5};

void add_spire(Model& model, const Spire& spire) {
  std::vector<Part::Level> levels{{{outline(spire.foot, 20), {}}, 0}};
  for (int i = 0; i <= 6; ++i) {
    const double share = i / 6.0;
    levels.push_back({{outline(scaled(spire.foot, 1 + (spire.top_factor - 1) * share,
                                      share * share * spire.lean),
                               20),
                       {}},
                      1 + (spire.top_z - 1) * share});
  }
  Part(model, spire.name).taper(levels);
}

// ---- Stone blocks -------------------------------------------------------------------------------

Path offices() {
  return placed(rectangle(-13, -8, 13, 8), 12, {-44.5, -2.4});
}
Path hall() {
  return placed(rectangle(-11, -9, 11, 9), -8, {22.6, 10.2});
}

void add_block(const Part& part, const Path& plan, double height, double cornice) {
  part.prism({plan, {}}, 0, height);
  part.prism({moved_edges(plan, cornice), {}}, height - 0.2, height + 1.0);
}

// A bent plate 4 m out from the atrium above the terrace, on one slender column.
Path canopy_column() {
  return regular({4.2, -19.9}, 0.8, 14);
}

void add_canopy(Model& model) {
  const Part canopy(model, "canopy");
  canopy.prism({canopy_column(), {}}, 0, 15.4);
  const Path plate{{0, 14.6}, {3, 15.0}, {6, 15.8}, {9, 17.0},
                   {9, 17.5}, {6, 16.3}, {3, 15.5}, {0, 15.1}};
  canopy.panel({plate, {}}, {-0.8, -21.2}, {-0.8, -12.2}, 10.0);
}

void map_obstacles(Site& site) {
  site.obstacle("atrium", outline(kAtrium, 40));
  site.obstacle("bud", outline(kBud, 32));
  for (const Gallery* g : {&kBoat, &kFish, &kLeaf}) site.obstacle(g->name, gallery_outline(*g));
  for (const Spire* spire : {&kBridgeTower, &kNorthTower})
    site.obstacle(spire->name, outline(spire->foot, 20));
  site.obstacle("offices", offices());
  site.obstacle("hall", hall());
  site.obstacle("canopy column", canopy_column());
}

constexpr const char* kAbout =
    R"(Curved and leaning volumes on 150 x 130 m, up to 41 m high. The map shows where the walls
stand; the roofs above reach farther.

- `boat_gallery`, `fish_gallery` and `leaf_gallery` are swept along arcs; their roofs, like
  upturned boats, hang over the walls by up to 3.2, 2.4 and 1.8 m and swell towards the middle.
- `atrium` (41 m): petals that grow with the height, a waist, a brim. `bud` leans out by up to 3.3
  m and closes again. `bridge_tower` (36 m) and `north_tower` (27 m) taper and lean.
- `canopy`: a bent plate at 15 to 17 m on one column. `offices` and `hall`: stone blocks with a
  cornice of 1 m.
- Volumes run into one another: in the map the outlines overlap by metres, and repair makes one of
  them.
)";

}  // namespace

Site make_museum() {
  Site site{.name = "museum",
            .title = "curved volumes under overhanging roofs, after Bilbao",
            .about = kAbout};
  site.model.surface("ground", {rectangle(-75, -65, 75, 65), {}}, 0);
  add_atrium(site.model);
  add_bud(site.model);
  for (const Gallery* g : {&kBoat, &kFish, &kLeaf}) add_gallery(site.model, *g);
  for (const Spire* spire : {&kBridgeTower, &kNorthTower}) add_spire(site.model, *spire);
  add_block(Part(site.model, "offices"), offices(), 15.6, 1.0);
  add_block(Part(site.model, "hall"), hall(), 18.4, 1.0);
  add_canopy(site.model);
  site.boundary(rectangle(-75, -65, 75, 65), false);
  map_obstacles(site);
  site.region("grounds", {rectangle(-75, -65, 75, 65), {}}, 0);
  site.start({-60.5, -45.5}, 30);
  return site;
}

}  // namespace sites
