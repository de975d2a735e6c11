// After Fort Jay (paper 5.2): a square fort with four bastions in a dry moat.
#include <cmath>

#include "tools/make_sites_site.hpp"

namespace sites {
namespace {

using Eigen::Vector2d;

constexpr double kMoatZ = -4.0;       // Floor of the moat.
constexpr double kTerrepleinZ = 3.0;  // Walkway on the ramparts.
constexpr double kParapetZ = 5.2;
constexpr double kCrestZ = 1.0;       // Top of the counterscarp, where the glacis begins.
constexpr double kBatter = 1.0 / 8;   // Horizontal per vertical metre of the scarp.
constexpr double kMoatWidth = 20.0;   // Before the faces of the bastions.
constexpr double kCourt = 25.4;       // Half the side of the inner court.
constexpr double kBarracks = 33.8;    // The barracks reach from kCourt to here.
constexpr double kHalfLength = 21.5;  // Of a barracks building.
constexpr double kRampart = 52.4;  // Inner face of the rampart: half the side of the outer court.
constexpr double kDivide = 29.8;   // The line through the barracks that parts inner from outer.

// Foot of the scarp, counter-clockwise: curtains, flanks and faces.
Path scarp_foot() {
  const Path east{{60.3, 36}, {70.3, 37.2}, {78.3, 78.3}, {37.2, 70.3}, {36, 60.3}};
  return joined({east, placed(east, 90), placed(east, 180), placed(east, 270)});
}

// Foot of the counterscarp: parallel to the faces, round at the tips, re-entrant at the curtains.
Path counterscarp_foot() {
  const Vector2d tip(78.3, 78.3), shoulder(70.3, 37.2);
  const Vector2d along = (tip - shoulder).normalized();
  const Vector2d outward(along.y(), -along.x());
  const Vector2d on_line = tip + kMoatWidth * outward;
  const Vector2d reentrant = on_line - on_line.y() / along.y() * along;
  const double turn = std::atan2(outward.y(), outward.x()) * 180 / std::acos(-1.0);
  const Path quarter = joined({{reentrant}, arc(tip, kMoatWidth, turn, 90 - turn, 4)});
  return joined({quarter, placed(quarter, 90), placed(quarter, 180), placed(quarter, 270)});
}

Path square(double half) {
  return rectangle(-half, -half, half, half);
}

void add_earthworks(Model& model) {
  const Path foot = scarp_foot();
  const Path crest_foot = counterscarp_foot();
  const Path crest = moved_edges(crest_foot, 0.5);
  const Path glacis = moved_edges(crest_foot, 26);
  model.surface("ground_plain", {square(150), {glacis}}, 0);
  model.band_facing_inside("ground_glacis", at_height(crest, kCrestZ), at_height(glacis, 0));
  model.band_facing_inside("ground_counterscarp", at_height(crest_foot, kMoatZ),
                           at_height(crest, kCrestZ));
  // The floors reach 1 m under the walls, so that no beam slips through the seam.
  model.surface("ground_moat", {moved_edges(crest_foot, 1), {moved_edges(foot, -1)}}, kMoatZ);
  model.surface("ground_courts", {square(kRampart + 1), {}}, 0);

  const auto at = [&](double z) { return moved_edges(foot, -kBatter * (z - kMoatZ)); };
  const Path yard = square(kRampart);
  Part(model, "rampart")
      .taper({{{foot, {yard}}, kMoatZ}, {{at(kTerrepleinZ), {yard}}, kTerrepleinZ}});
  Part(model, "parapet")
      .taper({{{at(kTerrepleinZ), {moved_edges(foot, -4.2)}}, kTerrepleinZ},
              {{at(kParapetZ), {moved_edges(foot, -4.0)}}, kParapetZ}});
  Part(model, "banquette").prism({moved_edges(foot, -4.2), {moved_edges(foot, -5.6)}}, 3.0, 4.0);
}

void add_sentry_boxes(Model& model) {
  for (int i = 0; i < 4; ++i) {
    const Part box(model, "sentry_boxes", turned(90 * i));
    box.column({74.9, 74.9}, 1.1, 6, kTerrepleinZ, 7.4);
    box.cone({74.9, 74.9}, 1.3, 6, 7.4, 8.9);
  }
}

// Steps from the outer court up to the rampart, along the inner face of the south rampart.
Path stairs_outline(double overlap) {
  return rectangle(18, -kRampart - overlap, 27, -50.2);
}

void add_stairs(Model& model) {
  for (int i = 0; i < 4; ++i) {
    Path steps{{0, 0}, {9, 0}};
    for (int k = 6; k >= 1; --k) {
      steps.emplace_back(1.5 * k, 0.5 * k);
      steps.emplace_back(1.5 * (k - 1), 0.5 * k);
    }
    Part(model, "rampart_stairs", turned(90 * i)).panel({steps, {}}, {18, -50.2}, {27, -50.2}, 2.2);
  }
}

// A barracks building in its own frame: it lies north of the court.
constexpr double kFrontDepth = 0.25;  // The fronts with their windows stand before the core.
constexpr double kPorch = 3.4;        // How far the porches reach into the court.
constexpr double kPassage = 2.0;      // Half the width of the gate passage.

Path porch(double x) {
  return rectangle(x - 2.6, kCourt - kPorch, x + 2.6, kCourt + 0.3);
}

void add_porch(const Part& part, double x) {
  part.prism({porch(x), {}}, 0, 1.2);
  for (const double side : {-2.2, 2.2})
    part.column({x + side, kCourt - kPorch + 0.4}, 0.28, 12, 1.2, 4.3);
  part.box(x - 2.8, kCourt - kPorch - 0.2, x + 2.8, kCourt + 0.3, 4.3, 4.7);
  part.gable_y(x - 2.8, kCourt - kPorch - 0.2, x + 2.8, kCourt + 0.3, 4.7, 6.1);
}

void add_annex(const Part& part) {
  const double y0 = kBarracks - 0.3, y1 = kBarracks + 3;
  // Lean-to roof: the elevation runs along +y, the slab grows along +x.
  part.panel({{{0, 0}, {y1 - y0, 0}, {y1 - y0, 3.4}, {0, 4.8}}, {}}, {-3, y0}, {-3, y1}, 6);
}

// Both storeys, x0 to x1, from z0 to the eaves; windows in rows whose sill is above z0.
void add_block(const Part& part, double x0, double x1, double z0, double z1) {
  const double south = kCourt + kFrontDepth, north = kBarracks - kFrontDepth;
  part.box(x0, south, x1, north, z0, z1);
  Shape front{rectangle(0, z0, x1 - x0, z1), {}};
  for (const double sill : {1.5, 4.6}) {
    if (sill < z0 || sill + 1.7 > z1) continue;
    const int count = static_cast<int>((x1 - x0 - 1) / 3.4);
    const auto row = window_holes(x1 - x0, {count, 3.4, 1.1, sill, sill + 1.7});
    front.holes.insert(front.holes.end(), row.begin(), row.end());
  }
  part.panel(front, {x0, south}, {x1, south}, kFrontDepth);
  part.panel(front, {x1, north}, {x0, north}, kFrontDepth);
}

void add_roof(const Part& part) {
  part.gable_x(-kHalfLength - 0.3, kCourt - 0.4, kHalfLength + 0.3, kBarracks + 0.4, 7, 10.6);
  for (const double x : {-14.0, 0.5, 14.0}) part.box(x - 0.6, 29.2, x + 0.6, 30.1, 8, 12);
  for (const double x : {-17.5, -7.2, 7.2, 17.5}) {
    for (const double y : {kCourt + 0.6, kBarracks - 2.6}) {
      part.box(x - 0.7, y, x + 0.7, y + 2, 7.2, 8.7);
      part.gable_y(x - 0.8, y - 0.1, x + 0.8, y + 2.1, 8.7, 9.4);
    }
  }
}

void add_barracks(Model& model) {
  const char* names[] = {"barracks_north", "barracks_west", "barracks_south", "barracks_east"};
  for (int i = 0; i < 4; ++i) {
    const Part part(model, names[i], turned(90 * i));
    if (i == 1) {  // The gate passage runs under the upper floor.
      add_block(part, -kHalfLength, -kPassage, 0, 3.6);
      add_block(part, kPassage, kHalfLength, 0, 3.6);
      add_block(part, -kHalfLength, kHalfLength, 3.6, 7);
    } else {
      add_block(part, -kHalfLength, kHalfLength, 0, 7);
      add_annex(part);
    }
    for (const double x : {-11.0, 11.0}) add_porch(part, x);
    add_roof(part);
  }
}

// The wall across the gap between two barracks, 5 cm into both of them.
Path link_wall() {
  const Vector2d from(kHalfLength, kCourt), to(kCourt, kHalfLength);
  const Vector2d along = (to - from).normalized(), across(-along.y(), along.x());
  const Vector2d a = from - 0.45 * along, b = to + 0.45 * along;
  return {a - 0.4 * across, b - 0.4 * across, b + 0.4 * across, a + 0.4 * across};
}

// Low enough to look over, too high to drive over; 3 cm into the walls of the passage.
Path barrier() {
  return placed(rectangle(-kPassage - 0.03, 29.4, kPassage + 0.03, 30.2), 90);
}

Path flagstaff() {
  return regular({4.3, -3.2}, 1.3, 8, 22.5);
}
Path well() {
  return regular({-9.1, -8.4}, 1.2, 12);
}
Path kitchen() {
  return rectangle(-13.2, 5.6, -6.4, 10.8);
}
Path guardhouse() {
  return rectangle(38.6, -46.6, 46.8, -40.4);
}
Path cistern() {
  return regular({-43.3, 43.1}, 2.2, 12);
}

void add_yard(Model& model) {
  for (int i = 0; i < 4; ++i) {
    Part(model, "link_walls").prism({placed(link_wall(), 90 * i), {}}, 0, 3.4);
  }
  Part(model, "barrier").prism({barrier(), {}}, 0, 1.1);
  Part(model, "flagstaff").prism({flagstaff(), {}}, 0, 1.0);
  Part(model, "flagstaff").column({4.3, -3.2}, 0.15, 8, 1.0, 22);
  Part(model, "well").prism({well(), {}}, 0, 0.9);
  Part(model, "kitchen").prism({kitchen(), {}}, 0, 2.8);
  Part(model, "kitchen").gable_x(-13.5, 5.3, -6.1, 11.1, 2.8, 4.6);
  Part(model, "guardhouse").prism({guardhouse(), {}}, 0, 3.6);
  Part(model, "guardhouse").gable_x(38.3, -46.9, 47.1, -40.1, 3.6, 5.6);
  Part(model, "cistern").prism({cistern(), {}}, 0, 2.4);
  Part(model, "cistern").cone({-43.3, 43.1}, 2.4, 12, 2.4, 3.6);
}

// In the moat before the east curtain, and in no map: it hides much of the scarp, and its yard,
// which opens towards the scarp, from everywhere else.
void add_gun_sheds(Model& model) {
  const Part sheds(model, "gun_sheds");
  sheds.box(80.0, -17.2, 86.0, 17.2, kMoatZ, 1.6);
  sheds.gable_y(79.7, -17.5, 86.3, 17.5, 1.6, 4.0);
  for (const double y : {-14.0, 14.0}) {
    sheds.box(69.0, y - 3.2, 80.3, y + 3.2, kMoatZ, 1.6);
    sheds.gable_x(68.7, y - 3.5, 80.3, y + 3.5, 1.6, 4.0);
  }
}

Path bridge_pier() {
  return rectangle(-2.6, -72.6, 2.6, -70.8);
}

// A stone bridge of two arches from the counterscarp to the gate in the south curtain.
void add_bridge_and_gate(Model& model) {
  const double y0 = -counterscarp_foot().front().x() - 0.4, y1 = -59.4;  // The moat is symmetric.
  const auto s = [&](double y) { return y - y0; };
  Path side{{0, -1.5}};
  const auto opening = [&](double from, double to) {
    const double middle = (s(from) + s(to)) / 2, half = (s(to) - s(from)) / 2;
    for (int i = 0; i <= 8; ++i) {
      const double t = std::acos(-1.0) * i / 8;
      side.emplace_back(middle - half * std::cos(t), -1.5 + 1.7 * std::sin(t));
    }
  };
  opening(y0 + 0.8, -72.6);
  side.emplace_back(s(-72.6), kMoatZ);
  side.emplace_back(s(-70.8), kMoatZ);
  opening(-70.8, -60.6);
  for (const Vector2d& corner : {Vector2d(s(y1), -1.5), Vector2d(s(y1), 1.0), Vector2d(0, 1.0)}) {
    side.push_back(corner);
  }
  const Part bridge(model, "bridge");
  bridge.panel({side, {}}, {-2.6, y0}, {-2.6, y1}, 5.2);
  for (const double x : {-2.6, 2.3}) bridge.box(x, y0, x + 0.3, y1, 1.0, 2.0);

  const Part gate(model, "gatehouse");
  gate.box(-5.2, -59.2, 5.2, -53.2, kTerrepleinZ, 9.0);
  gate.gable_y(-5.6, -59.3, 5.6, -52.9, 9.0, 11.6);
}

// ---- The map ------------------------------------------------------------------------------------

Path barracks_outline(bool annexed) {
  const Path front{{-kHalfLength, kCourt},  {-13.6, kCourt},         {-13.6, kCourt - kPorch},
                   {-8.4, kCourt - kPorch}, {-8.4, kCourt},          {8.4, kCourt},
                   {8.4, kCourt - kPorch},  {13.6, kCourt - kPorch}, {13.6, kCourt},
                   {kHalfLength, kCourt},   {kHalfLength, kBarracks}};
  const Path back{{3, kBarracks}, {3, kBarracks + 3}, {-3, kBarracks + 3}, {-3, kBarracks}};
  return joined({front, annexed ? back : Path{}, {{-kHalfLength, kBarracks}}});
}

Path barracks_half() {
  return {{kPassage, kCourt},       {8.4, kCourt},        {8.4, kCourt - kPorch},
          {13.6, kCourt - kPorch},  {13.6, kCourt},       {kHalfLength, kCourt},
          {kHalfLength, kBarracks}, {kPassage, kBarracks}};
}

void map_barracks(Site& site) {
  site.obstacle("barracks north", barracks_outline(true));
  Path mirrored;
  for (const Vector2d& p : barracks_half()) mirrored.emplace_back(-p.x(), p.y());
  site.obstacle("barracks west, south of the passage", placed(mirrored, 90));
  site.obstacle("barracks west, north of the passage", placed(barracks_half(), 90));
  // Two faults of drawn maps: a ring left open, a vertex drawn twice.
  site.obstacle("barracks south", placed(barracks_outline(true), 180));
  site.features.back().left_open = true;
  Path twice = placed(barracks_outline(true), 270);
  twice.insert(twice.begin() + 5, twice[5]);
  site.obstacle("barracks east", twice);
}

void map_obstacles(Site& site) {
  site.add("obstacle", "glacis").rings = {square(150), counterscarp_foot()};
  site.add("obstacle", "rampart").rings = {scarp_foot(), square(kRampart)};
  map_barracks(site);
  const char* corners[] = {"north-east", "north-west", "south-west", "south-east"};
  const char* sides[] = {"south", "east", "north", "west"};
  for (int i = 0; i < 4; ++i) {
    site.obstacle(std::string("link wall ") + corners[i], placed(link_wall(), 90 * i));
    // The eastern stairs are drawn 4 cm into the rampart; the others touch it.
    site.obstacle(std::string("stairs ") + sides[i],
                  placed(stairs_outline(i == 1 ? 0.04 : 0), 90 * i));
  }
  site.obstacle("barrier", barrier());
  site.obstacle("flagstaff", flagstaff());
  site.obstacle("well", well());
  site.obstacle("kitchen", kitchen());
  site.obstacle("guardhouse", guardhouse());
  site.obstacle("cistern", cistern());
  site.obstacle("bridge pier", bridge_pier());
}

void map_regions(Site& site) {
  const double cut =
      kHalfLength + kCourt - kDivide;  // The link walls lie on x + y = cut + kDivide.
  const Path side{{kDivide, -cut}, {kDivide, cut}};
  const Path divide = joined({side, placed(side, 90), placed(side, 180), placed(side, 270)});
  site.region("inner", {divide, {}}, 0);
  site.region("outer", {square(kRampart + 3), {divide}}, 0);
  site.region("moat", {moved_edges(counterscarp_foot(), 1), {moved_edges(scarp_foot(), -2)}},
              kMoatZ);
}

constexpr const char* kAbout =
    R"(A square fort with four bastions: barracks round an inner court, an outer court between
barracks and rampart, a dry moat, a glacis. 300 x 300 m in all, nothing above 22 m.

- Three regions that no robot can change between: `inner` (51 x 51 m, ground 0 m), `outer` (105 x
  105 m round the barracks, 0 m) and `moat` (floor -4 m; 20 m wide before the bastions, more
  before the curtains). Walls of 3.4 m close the corners of the inner court; a barrier of 1.1 m,
  which the scanner looks over, closes the passage under the west barracks.
- Ramparts in steps that the map does not show: walkway at 3 m, firing step at 4 m, parapet at 5.2
  m, scarp leaning back 1 in 8; the counterscarp stands up to 1 m, and the glacis falls to 0 m.
- `gun_sheds` (three wings, 8 m high, round a yard of 22 x 11 m in the moat before the east curtain,
  built against the counterscarp) stand in the model and not in the map. They hide the walls on
  both sides, and their yard, which opens towards the scarp, is hidden from nearly everywhere.
- Porch roofs, eaves, the passage under the west barracks and the bridge hang over free ground.
- Faults of drawn maps: the ring of `barracks south` is left open; `barracks east` repeats a
  vertex; the southern half of `barracks west` runs clockwise; the link walls reach 5 cm into the
  barracks; the barrier reaches 3 cm, `stairs east` 4 cm into its neighbour; the other stairs
  touch the rampart edge to edge; the glacis reaches beyond the boundary
  of the survey, which runs 8 m outside the counterscarp.
)";

}  // namespace

Site make_fort() {
  Site site{.name = "fort", .title = "a star-shaped fort, after Fort Jay", .about = kAbout};
  add_earthworks(site.model);
  add_sentry_boxes(site.model);
  add_stairs(site.model);
  add_barracks(site.model);
  add_yard(site.model);
  add_gun_sheds(site.model);
  add_bridge_and_gate(site.model);
  // The survey ends just beyond the moat: the air over the glacis is nobody's concern.
  site.boundary(moved_edges(counterscarp_foot(), 8), false);
  map_obstacles(site);
  map_regions(site);
  site.start({-6.5, -11.0}, 90);
  return site;
}

}  // namespace sites
