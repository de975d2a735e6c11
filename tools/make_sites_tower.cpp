// After Uris Hall (paper 5.1): a thin tall tower set back on a wide base, in a campus.
#include "tools/make_sites_site.hpp"

namespace sites {
namespace {

using Eigen::Vector2d;

constexpr double kFence = 115;  // Half the side of the campus.

Path hall_outline() {
  return {{-31.2, -23.4}, {-7.2, -23.4}, {-7.2, -28.4}, {7.2, -28.4},
          {7.2, -23.4},   {31.2, -23.4}, {31.2, 23.4},  {-31.2, 23.4}};
}
// L-shaped, round three sides of a square, and so on.
Path east_outline() {
  return {{63.4, -38.6}, {85.4, -38.6}, {85.4, 44.4}, {52.6, 44.4}, {52.6, 27.4}, {63.4, 27.4}};
}
Path west_outline() {
  return {{-89.4, -44.6}, {-57.4, -44.6}, {-57.4, -30.4}, {-75.4, -30.4},
          {-75.4, 14.4},  {-57.4, 14.4},  {-57.4, 28.6},  {-89.4, 28.6}};
}
Path north_outline() {
  return rectangle(-49.6, 65.4, 44.4, 83.6);
}
Path pavilion_outline() {
  return rectangle(66.4, 62.6, 91.6, 87.4);
}
Path chapel_outline() {
  return regular({-78.4, 73.3}, 13.4, 8, 22.5);
}
Path library_outline() {
  return rectangle(-18.6, -95.4, 18.6, -64.4);
}
Path south_east_outline() {
  return rectangle(50.4, -94.6, 88.6, -62.4);
}
Path south_west_outline() {
  return rectangle(-87.6, -94.4, -48.4, -61.6);
}
Path library_column(int i) {
  return regular({-11.5 + 4.6 * i, -60.6}, 0.75, 12, 15);
}
Path terrace_wall(double side) {
  return rectangle(side < 0 ? -46.4 : 14.4, -44.6, side < 0 ? -14.4 : 46.4, -43.8);
}

// Flat roof with a parapet along its edge.
void add_flat_roofed(const Part& part, const Path& outline, double height) {
  part.prism({outline, {}}, 0, height);
  part.prism({outline, {moved_edges(outline, -0.5)}}, height, height + 0.9);
}

void add_hall(Model& model) {
  const Part base(model, "hall_base");
  base.box(-31.2, -23.4, 31.2, 23.4, 0, 10.6);
  const Path roof = rectangle(-31.2, -23.4, 31.2, 23.4);
  base.prism({roof, {moved_edges(roof, -0.5)}}, 10.6, 11.6);
  base.box(-7.2, -28.4, 7.2, -23.2, 0, 5.2);
  base.box(-8.7, -30.4, 8.7, -23.2, 5.2, 5.8);  // Canopy.
  base.box(-24, -17, -15, -9, 10.6, 13.4);      // Machine rooms on the roof.
  base.box(16, -16, 25, -10, 10.6, 13.0);

  const Part tower(model, "hall_tower");
  tower.box(-18.7, -1.6, 18.7, 9.2, 10.6, 51.6);
  for (int i = 0; i <= 8; ++i) {  // Fins on the long sides.
    const double x = -18.4 + 4.6 * i;
    tower.box(x - 0.3, -2.3, x + 0.3, -1.5, 10.6, 51.0);
    tower.box(x - 0.3, 9.1, x + 0.3, 9.9, 10.6, 51.0);
  }
  tower.box(-19.4, -2.6, 19.4, 10.2, 51.0, 52.2);  // Cornice.
  tower.box(-9.4, 0.8, 10.2, 7.0, 52.2, 56.0);
}

void add_library(Model& model) {
  const Part library(model, "library");
  add_flat_roofed(library, library_outline(), 13.6);
  library.column({0, -79.9}, 12.4, 16, 13.6, 18.8);
  library.dome({0, -79.9}, 11.8, 16, 18.8, 8.4);
  for (int i = 0; i < 6; ++i) library.prism({library_column(i), {}}, 0, 9.6);
  library.box(-13.4, -64.6, 13.4, -59.4, 9.6, 11.0);
  library.gable_y(-13.8, -64.6, 13.8, -59.2, 11.0, 14.6);
}

void add_campus(Model& model) {
  const Part east(model, "east_hall");
  east.prism({east_outline(), {}}, 0, 17.6);
  east.hip(62.9, -39.1, 85.9, 44.9, 17.6, 23.4);
  east.hip(52.1, 26.9, 74.4, 44.9, 17.6, 22.4);
  add_flat_roofed(Part(model, "west_hall"), west_outline(), 18.4);
  const Part north(model, "north_hall");
  north.prism({north_outline(), {}}, 0, 20.4);
  // Mansard: steep, then flat.
  north.taper({{{moved_edges(north_outline(), 0.6), {}}, 20.4},
               {{moved_edges(north_outline(), -2.4), {}}, 25.4},
               {{moved_edges(north_outline(), -7.4), {}}, 27.4}});
  const Part pavilion(model, "pavilion");
  pavilion.prism({pavilion_outline(), {}}, 0, 11.6);
  pavilion.hip(65.6, 61.8, 92.4, 88.2, 11.6, 17.8);
  const Part chapel(model, "chapel");
  chapel.prism({chapel_outline(), {}}, 0, 12.4);
  chapel.dome({-78.4, 73.3}, 13.4, 16, 12.4, 7.6);
  chapel.cone({-78.4, 73.3}, 2.2, 8, 19.0, 24.6);
  const Part south_east(model, "south_east_hall");
  south_east.prism({south_east_outline(), {}}, 0, 14.6);
  south_east.gable_x(49.8, -95.2, 89.2, -61.8, 14.6, 22.6);
  add_flat_roofed(Part(model, "south_west_hall"), south_west_outline(), 22.4);
  for (const double side : {-1.0, 1.0}) {
    Part(model, "terrace_walls").prism({terrace_wall(side), {}}, 0, 1.1);
  }
}

void add_ground(Model& model) {
  const double outside = kFence + 0.6;
  const Path fence = rectangle(-kFence, -kFence, kFence, kFence);
  const Path outer = rectangle(-outside, -outside, outside, outside);
  model.surface("ground", {outer, {}}, 0);
  Part(model, "campus_wall").prism({outer, {fence}}, 0, 3.2);
}

void map_obstacles(Site& site) {
  site.obstacle("hall", hall_outline());
  site.obstacle("east hall", east_outline());
  site.obstacle("west hall", west_outline());
  site.obstacle("north hall", north_outline());
  site.obstacle("pavilion", pavilion_outline());
  site.obstacle("chapel", chapel_outline());
  site.obstacle("library", library_outline());
  for (int i = 0; i < 6; ++i)
    site.obstacle("library column " + std::to_string(i + 1), library_column(i));
  site.obstacle("south-east hall", south_east_outline());
  site.obstacle("south-west hall", south_west_outline());
  site.obstacle("terrace wall west", terrace_wall(-1));
  site.obstacle("terrace wall east", terrace_wall(1));
  site.add("keep_out", "flower bed").rings = {regular({-44.3, 43.8}, 5.2, 12)};
}

// What the survey is for: the hall, and the fronts that look at it.
void map_targets(Site& site) {
  Path hall = hall_outline();
  hall.push_back(hall.front());
  site.target("hall", hall);
  site.target("library, north front", {{18.6, -64.4}, {-18.6, -64.4}});
  site.target("north hall, south front", {{-49.6, 65.4}, {44.4, 65.4}});
  site.target("east hall, west front", {{52.6, 44.4}, {52.6, 27.4}, {63.4, 27.4}, {63.4, -38.6}});
  site.target("west hall, court", {{-57.4, -44.6},
                                   {-57.4, -30.4},
                                   {-75.4, -30.4},
                                   {-75.4, 14.4},
                                   {-57.4, 14.4},
                                   {-57.4, 28.6}});
}

constexpr const char* kAbout =
    R"(A university hall of two parts: a base of 62 x 47 m, 11 m high, and on it, 22 m back from
the front, a slab of 37 x 11 m that rises to 52 m (56 m with its machine room). Around it
eight campus buildings of 11 to 27 m on 230 x 230 m.

- From near, the base and its parapet hide the tower: the plan from the map alone stands near the
  corners and misses much of the tower's front, which head-on views from farther off then fill in.
- `target` lines say what counts for coverage: the outline of the hall and the fronts that face
  it. The backs of the other buildings occlude, but do not count.
- The boundary is a wall (3.2 m): it occludes. A flower bed is `keep_out`: nothing to see, not to
  be driven on.
- Canopy, cornice and eaves hang over free ground by 0.5 to 2 m; the library has a portico of 5 m
  on six columns.
)";

}  // namespace

Site make_tower() {
  Site site{.name = "tower",
            .title = "a thin tower on a wide base in a campus, after Uris Hall",
            .about = kAbout};
  add_ground(site.model);
  add_hall(site.model);
  add_library(site.model);
  add_campus(site.model);
  site.boundary(rectangle(-kFence, -kFence, kFence, kFence), true);
  map_obstacles(site);
  map_targets(site);
  site.region("campus", {rectangle(-kFence, -kFence, kFence, kFence), {}}, 0);
  site.start({-40.5, -52.5}, 0);
  return site;
}

}  // namespace sites
