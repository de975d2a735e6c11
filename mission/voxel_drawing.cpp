#include "mission/voxel_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "mission/drawing.hpp"
#include "mission/progress.hpp"
#include "mission/report_html.hpp"

namespace mission {
namespace {

using drawing::Legend;
using drawing::View;
using html::escaped;

// Classes h1 ... h8 from few voxels to many (ColorBrewer's YlGnBu, fit for the colour-blind); h0
// is none.
constexpr int kSteps = 8;
constexpr std::string_view kRules = R"(
.cell { shape-rendering: crispEdges; }
.h0 { fill: #ebedf0; } .h1 { fill: #f4fac0; } .h2 { fill: #d5eeb3; } .h3 { fill: #a9ddb7; }
.h4 { fill: #73c9bd; } .h5 { fill: #45b4c2; } .h6 { fill: #2897bf; } .h7 { fill: #2166ac; }
.h8 { fill: #162f78; }
.never { fill: var(--missed); fill-opacity: 0.55; }
.unseen { fill: #b4bcc6; } .empty { fill: #e3f1fb; } .occupied { fill: #1b2430; }
.frontier { fill: #e8590c; }
.box { fill: none; stroke: var(--other); stroke-width: 1; }
.heat-wall { fill: none; stroke: var(--ink); stroke-width: 1; }
)";

constexpr int kNoClass = -1;

// The squares of a raster as one path per class, squares of a row that touch drawn as one.
class Squares {
 public:
  Squares(const View& view, const planning::VoxelGrid& grid, int classes)
      : view_(view), grid_(grid), paths_(static_cast<std::size_t>(classes)) {}

  void add_all(const std::function<int(int x, int y)>& class_at) {
    for (int y = 0; y < grid_.ny; ++y)
      for (int x = 0; x < grid_.nx;) {
        const int kind = class_at(x, y);
        int end = x + 1;
        while (end < grid_.nx && class_at(end, y) == kind) ++end;
        if (kind != kNoClass) add(x, end, y, paths_[static_cast<std::size_t>(kind)]);
        x = end;
      }
  }
  const std::string& path(int kind) const { return paths_[static_cast<std::size_t>(kind)]; }

 private:
  // Corners in absolute pixels, so that neighbours share theirs and no gaps show.
  void add(int begin, int end, int y, std::string& path) const {
    const Eigen::Vector2d low = corner_px(begin, y), high = corner_px(end, y + 1);
    fmt::format_to(std::back_inserter(path), "M{:.2f} {:.2f}H{:.2f}V{:.2f}H{:.2f}Z", low.x(),
                   low.y(), high.x(), high.y(), low.x());
  }
  Eigen::Vector2d corner_px(int x, int y) const {
    return view_.px(grid_.W_min_m.head<2>() + grid_.voxel_m * Eigen::Vector2d(x, y));
  }

  const View& view_;
  const planning::VoxelGrid& grid_;
  std::vector<std::string> paths_;
};

// The smallest step such that kSteps of them reach `most`.
std::uint32_t step_for(std::uint32_t most) {
  return std::max<std::uint32_t>(1, (most + kSteps - 1) / kSteps);
}

int class_of(std::uint32_t voxels, std::uint32_t step) {
  return voxels == 0 ? 0 : static_cast<int>((voxels - 1) / step) + 1;
}

// The highest count of each column that holds a cell, as classes; kNoClass elsewhere.
std::vector<int> column_classes(const HeatMap& heat, std::uint32_t step) {
  std::vector<int> classes(
      static_cast<std::size_t>(heat.grid.nx) * static_cast<std::size_t>(heat.grid.ny), kNoClass);
  for (const CellTally& cell : heat.cells) {
    const auto& v = cell.cell.voxel;
    int& kind = classes[static_cast<std::size_t>(v.y) * static_cast<std::size_t>(heat.grid.nx) +
                        static_cast<std::size_t>(v.x)];
    kind = std::max(kind, class_of(cell.voxels, step));
  }
  return classes;
}

std::string never_seen_columns(const HeatMap& heat, const View& view) {
  std::vector<std::uint8_t> any(static_cast<std::size_t>(heat.grid.nx) *
                                static_cast<std::size_t>(heat.grid.ny));
  const auto at = [&](int x, int y) -> std::uint8_t& {
    return any[static_cast<std::size_t>(y) * static_cast<std::size_t>(heat.grid.nx) +
               static_cast<std::size_t>(x)];
  };
  for (const planning::Voxel& v : heat.never_seen) at(v.x, v.y) = 1;
  Squares squares(view, heat.grid, 1);
  squares.add_all([&](int x, int y) { return at(x, y) ? 0 : kNoClass; });
  return drawing::drawn(squares.path(0), "cell never");
}

std::string diamond(const Eigen::Vector2d& px, std::size_t number, const std::string& tip) {
  return fmt::format(
      "<g>{}<path d=\"M{:.1f} {:.1f}l12 12l-12 12l-12 -12Z\" class=\"nbv\"/><text x=\"{:.1f}\" "
      "y=\"{:.1f}\" class=\"mark\">{}</text></g>\n",
      html::element("title", escaped(tip)), px.x(), px.y() - 12, px.x(), px.y() + 3.7, number);
}

Legend heat_legend(const HeatMap& heat, std::uint32_t most, std::uint32_t step) {
  Legend legend;
  legend.push_back(drawing::legend_area("h0", "nothing new"));
  for (int i = 1; i <= class_of(most, step); ++i) {
    const std::uint64_t low = static_cast<std::uint64_t>(i - 1) * step + 1;
    const std::uint64_t high = std::min<std::uint64_t>(most, static_cast<std::uint64_t>(i) * step);
    legend.push_back(drawing::legend_area(
        fmt::format("h{}", i),
        count_text(low) + " to " + count_text(high) + (i == 1 ? " boundary voxels" : "")));
  }
  if (!heat.views.empty())
    legend.push_back({"<path d=\"M15 1l8 8l-8 8l-8 -8Z\" class=\"nbv\"/>", heat.views_are});
  if (!heat.never_seen.empty())
    legend.push_back(drawing::legend_area("never", "boundary voxels that no cell sees"));
  legend.push_back(drawing::legend_area("solid", "obstacle of the map"));
  return legend;
}

View view_of(const planning::VoxelGrid& grid) {
  const Eigen::Vector2d low_m = grid.W_min_m.head<2>();
  return {low_m, low_m + grid.voxel_m * Eigen::Vector2d(grid.nx, grid.ny)};
}

enum Slice : int { kUnseen, kEmpty, kOccupied, kFrontier, kSliceClasses };

int slice_class(planning::VoxelState state) {
  if (state == planning::VoxelState::unseen) return kUnseen;
  return state == planning::VoxelState::seen_empty ? kEmpty : kOccupied;
}

}  // namespace

std::string heat_map_svg(const nav::SiteMap& map, const HeatMap& heat) {
  std::uint32_t most = 0;
  for (const CellTally& cell : heat.cells) most = std::max(most, cell.voxels);
  const std::uint32_t step = step_for(most);
  const std::vector<int> classes = column_classes(heat, step);
  const View view = view_of(heat.grid);
  Squares squares(view, heat.grid, kSteps + 1);
  squares.add_all([&](int x, int y) {
    return classes[static_cast<std::size_t>(y) * static_cast<std::size_t>(heat.grid.nx) +
                   static_cast<std::size_t>(x)];
  });
  std::string body;
  for (int i = 0; i <= kSteps; ++i)
    body += drawing::drawn(squares.path(i), fmt::format("cell h{}", i));
  body += drawing::outlines(map, view) + never_seen_columns(heat, view);
  for (std::size_t i = heat.views.size(); i-- > 0;)  // The first on top.
    body += diamond(view.px(heat.views[i].at_m), i + 1, heat.views[i].tip);
  return drawing::document(view, {.title = heat.title,
                                  .subtitle = heat.subtitle,
                                  .body = body,
                                  .legend = heat_legend(heat, most, step),
                                  .rules = std::string(kRules)});
}

std::string slice_svg(const planning::VoxelMap& map, int z, const std::string& title) {
  const planning::VoxelGrid& grid = map.grid();
  const auto columns = static_cast<std::size_t>(grid.nx);
  std::vector<int> classes(columns * static_cast<std::size_t>(grid.ny));
  std::array<std::uint64_t, kSliceClasses> count{};
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x)
      classes[static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x)] =
          slice_class(map.at({x, y, z}));
  for (const planning::BoundaryVoxel& u : planning::boundary_unseen(map))
    if (u.v.z == z)
      classes[static_cast<std::size_t>(u.v.y) * columns + static_cast<std::size_t>(u.v.x)] =
          kFrontier;
  for (const int kind : classes) ++count[static_cast<std::size_t>(kind)];

  const View view = view_of(grid);
  Squares squares(view, grid, kSliceClasses);
  squares.add_all([&](int x, int y) {
    return classes[static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x)];
  });
  constexpr std::string_view kClass[] = {"unseen", "empty", "occupied", "frontier"};
  constexpr std::string_view kWords[] = {"unseen", "seen empty", "seen occupied",
                                         "boundary: unseen, beside seen-empty"};
  std::string body;
  Legend legend;
  for (int i = 0; i < kSliceClasses; ++i) {
    const auto k = static_cast<std::size_t>(i);
    body += drawing::drawn(squares.path(i), fmt::format("cell {}", kClass[k]));
    legend.push_back(
        drawing::legend_area(kClass[k], fmt::format("{} ({})", kWords[k], count_text(count[k]))));
  }
  return drawing::document(
      view, {.title = title,
             .subtitle = fmt::format("layer {} of {}: {:.2f} to {:.2f} m, voxels of {} m", z,
                                     grid.nz, grid.W_min_m.z() + z * grid.voxel_m,
                                     grid.W_min_m.z() + (z + 1) * grid.voxel_m, grid.voxel_m),
             .body = body,
             .legend = legend,
             .rules = std::string(kRules)});
}

}  // namespace mission
