#include "mission/leftover.hpp"

#include <fmt/format.h>

#include "mission/json_text.hpp"
#include "mission/progress.hpp"

namespace mission {
namespace {

namespace json = boost::json;

constexpr auto kReasons = static_cast<std::size_t>(planning::ViewVerdict::visible);

// What keeps the cell that comes furthest from seeing such a voxel.
constexpr std::string_view kMeaning[kReasons] = {
    "out of range of every cell",           "nearer to every cell than the scanner measures",
    "facing away from every cell",          "seen too flatly from every cell",
    "too sparsely sampled from every cell", "hidden from every cell",
};

std::optional<double> share(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

json::value number(const std::optional<double>& value) {
  return value ? json::value(rounded(*value, 5)) : json::value(nullptr);
}

std::string never_visible_text(const Leftover& left, const VoxelCounts& counts) {
  const std::uint64_t never = left.never_visible_voxels();
  std::string text = fmt::format(
      "No cell can see {} of the {} boundary unseen voxels: work for a mast or a drone.",
      count_text(never), count_text(counts.boundary_unseen));
  std::string reasons;
  for (std::size_t i = 0; i < kReasons; ++i)
    if (left.never_visible[i] > 0)
      reasons += fmt::format("{}{} are {}", reasons.empty() ? " Of these " : ", ",
                             count_text(left.never_visible[i]), kMeaning[i]);
  if (!reasons.empty()) text += reasons + ".";
  if (const auto seen = seen_of_visible(counts, left))
    text += fmt::format(" Without them, {:.1f} % of the known surface and frontier is seen.",
                        100 * *seen);
  return text;
}

}  // namespace

std::string in_words(const Leftover& left) {
  const planning::StopCertificate& certificate = left.certificate;
  if (left.proven())
    return fmt::format(
        "proven: even if everything unseen were air, no view would see more than {} unseen voxels "
        "of the box",
        certificate.optimistic_voxels());
  if (certificate.proven()) return "not proven: what hides voxels now may turn out to be foliage";
  const Eigen::Vector2d at_m = left.optimistic_at_m.value_or(Eigen::Vector2d::Zero());
  return fmt::format(
      "not proven: if everything unseen were air, {} unseen voxels would be seen from "
      "({:.1f}, {:.1f})",
      certificate.optimistic_voxels(), at_m.x(), at_m.y());
}

std::optional<double> seen_of_visible(const VoxelCounts& counts, const Leftover& left) {
  const std::uint64_t visible = counts.boundary_unseen - left.never_visible_voxels();
  return share(counts.seen_occupied, counts.seen_occupied + visible);
}

json::value leftover_json(const RunRecord& record) {
  if (!record.leftover || record.scans.empty()) return nullptr;
  const Leftover& left = *record.leftover;
  const VoxelCounts& counts = record.scans.back().after;
  json::object reasons;
  for (std::size_t i = 0; i < kReasons; ++i)
    reasons[planning::name(static_cast<planning::ViewVerdict>(i))] = left.never_visible[i];
  const planning::StopCertificate& certificate = left.certificate;
  return {{"pessimistic_max_voxels", certificate.pessimistic_max()},
          {"optimistic_voxels", certificate.optimistic_voxels()},
          {"threshold_voxels", certificate.threshold_voxels},
          {"proven", left.proven()},
          {"never_visible_voxels", left.never_visible_voxels()},
          {"never_visible_by_reason", std::move(reasons)},
          {"boundary_unseen_visible_voxels", counts.boundary_unseen - left.never_visible_voxels()},
          {"seen_of_frontier",
           number(share(counts.seen_occupied, counts.seen_occupied + counts.boundary_unseen))},
          {"seen_of_visible_frontier", number(seen_of_visible(counts, left))}};
}

json::value density_json(const DensityFacts& density) {
  if (density.goal_ppm2 <= 0) return nullptr;
  return {{"goal_points_per_m2", density.goal_ppm2},
          {"surface_voxels", density.surface_voxels},
          {"reached_voxels", density.reached_voxels},
          {"reached_of_surface", number(share(density.reached_voxels, density.surface_voxels))}};
}

std::string leftover_text(const RunRecord& record) {
  if (!record.leftover || record.scans.empty()) return "";
  std::string text = never_visible_text(*record.leftover, record.scans.back().after);
  text += " Stop, " + in_words(*record.leftover) + ".";
  const DensityFacts& density = record.density;
  if (density.goal_ppm2 > 0)
    text += fmt::format(" {} of {} surface voxels have the {} points per m2 asked for ({:.1f} %).",
                        count_text(density.reached_voxels), count_text(density.surface_voxels),
                        density.goal_ppm2,
                        100 * share(density.reached_voxels, density.surface_voxels).value_or(0));
  return text;
}

}  // namespace mission
