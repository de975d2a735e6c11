#include "nav/smoother.hpp"

#include <algorithm>
#include <numeric>
#include <variant>

namespace nav {
namespace {

// Between two filters that are kept; in between it is worked out again on the way back.
constexpr std::size_t kBlock = 256;

// Stamps first, then kinds, as the localizer takes them.
std::vector<std::size_t> in_order(std::span<const LocalizerEvent> events) {
  std::vector<std::size_t> order(events.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const hal::Time one = stamp_of(events[a]), other = stamp_of(events[b]);
    return one != other ? one < other : events[a].index() < events[b].index();
  });
  return order;
}

SmoothedPose pose_of(const LocalizerFilter& filter) {
  return {*filter.moved_until(), filter.pose(), filter.covariance(), filter.T_W_B()};
}

}  // namespace

SmoothedLog smooth(const LocalizerConfig& config, const hal::Pose2& start,
                   const Eigen::Matrix3d& covariance, std::span<const LocalizerEvent> events) {
  const auto order = in_order(events);
  SmoothedLog log{{}, std::vector<Taken>(events.size()), {config, start, covariance}};
  std::vector<LocalizerFilter> kept;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i % kBlock == 0) kept.push_back(log.last);
    Taken& taken = log.taken[order[i]];
    taken.gate = log.last.apply(config, events[order[i]]);
    if (!gated(events[order[i]])) continue;
    taken.nis = log.last.last_nis();
    taken.dimension = log.last.last_dimension();
  }
  Hindsight later;
  std::vector<LocalizerFilter> filters;
  std::vector<ErrorTape> tapes(std::min(kBlock, order.size()));
  for (std::size_t block = kept.size(); block-- > 0;) {
    const std::size_t first = block * kBlock, count = std::min(kBlock, order.size() - first);
    filters.clear();
    LocalizerFilter filter = kept[block];
    for (std::size_t i = 0; i < count; ++i) {
      tapes[i].clear();
      filter.apply(config, events[order[first + i]], &tapes[i]);
      filters.push_back(filter);
    }
    for (std::size_t i = count; i-- > 0;) {
      const std::size_t event = order[first + i];
      const bool travel = std::holds_alternative<hal::WheelTravel>(events[event]);
      if (travel && log.taken[event].gate == Gate::accepted)
        log.poses.push_back(pose_of(filters[i].with(later)));
      later.before(tapes[i]);
    }
  }
  std::reverse(log.poses.begin(), log.poses.end());
  return log;
}

}  // namespace nav
