// vantage slice: one layer of a run's voxel map as a picture.
#include <fmt/format.h>

#include <array>
#include <memory>

#include "mission/past_run.hpp"
#include "mission/voxel_drawing.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct SliceOptions {
  std::filesystem::path map, svg;
  double z_m{};
  bool json = false;
};

int layer_at(const planning::VoxelGrid& grid, double z_m) {
  const int z = grid.voxel_at({grid.W_min_m.x(), grid.W_min_m.y(), z_m}).z;
  if (z >= 0 && z < grid.nz) return z;
  throw Refusal(fmt::format("--z {} m is outside the map, which reaches from {:.2f} to {:.2f} m",
                            z_m, grid.W_min_m.z(), grid.W_min_m.z() + grid.nz * grid.voxel_m));
}

int slice(const SliceOptions& options) {
  const mission::PastRun past = past_run(options.map);
  const planning::VoxelGrid& grid = past.map.grid();
  const int z = layer_at(grid, options.z_m);
  write_product(options.svg,
                mission::slice_svg(past.map, z, fmt::format("Voxels at z = {} m", options.z_m)));
  std::array<std::uint64_t, 3> counts{};
  for (int y = 0; y < grid.ny; ++y)
    for (int x = 0; x < grid.nx; ++x) ++counts[static_cast<std::size_t>(past.map.at({x, y, z}))];
  if (options.json)
    print_json(boost::json::object{{"ok", true},
                                   {"svg", options.svg.generic_string()},
                                   {"layer", z},
                                   {"z_min_m", grid.W_min_m.z() + z * grid.voxel_m},
                                   {"z_max_m", grid.W_min_m.z() + (z + 1) * grid.voxel_m},
                                   {"unseen", counts[0]},
                                   {"seen_empty", counts[1]},
                                   {"seen_occupied", counts[2]}});
  else
    fmt::print("layer {}: {} unseen, {} seen empty, {} seen occupied: {}\n", z, counts[0],
               counts[1], counts[2], options.svg.string());
  return kFine;
}

}  // namespace

void add_slice_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<SliceOptions>();
  auto* command = app.add_subcommand("slice", "Draws one layer of a run's voxel map");
  command->footer(
      "Examples:\n"
      "  vantage slice --map runs/fort --z 1.5 --svg slice.svg\n"
      "Exit: 0 fine, 2 refused.");
  command->add_option("--map", options->map, "map.ot, or the folder of the run")->required();
  command->add_option("--z", options->z_m, "Height of the layer in metres")->required();
  command->add_option("--svg", options->svg, "Picture to write")->required();
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return slice(*options); }); };
  });
}

}  // namespace vantage
