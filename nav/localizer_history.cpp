#include "nav/localizer_history.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace nav {
namespace {

constexpr double kAhead_s = 0.5;
// Entries of a block; late ones may make it twice as long.
constexpr std::size_t kBlockEntries = 16;

hal::Pose2 between(const FilterPose& from, const FilterPose& to, hal::Time stamp) {
  hal::Pose2 pose = from.pose();
  if (!from.moved_until) return pose;
  const double span_s = hal::seconds(*to.moved_until - *from.moved_until);
  const double share =
      std::clamp(hal::seconds(stamp - *from.moved_until) / std::max(1e-9, span_s), 0.0, 1.0);
  const hal::Pose2 next = to.pose();
  pose.position_m += share * (next.position_m - pose.position_m);
  pose.heading_rad +=
      share * std::remainder(next.heading_rad - pose.heading_rad, 2 * std::numbers::pi);
  return pose;
}

hal::Pose2 ahead(const FilterPose& from, hal::Time stamp) {
  hal::Pose2 pose = from.pose();
  if (!from.moved_until) return pose;
  const double span_s = std::clamp(hal::seconds(stamp - *from.moved_until), 0.0, kAhead_s);
  const double turn_rad = span_s * from.turn_radps;
  const double along = pose.heading_rad + turn_rad / 2;
  pose.position_m += span_s * from.speed_mps * Eigen::Vector2d(std::cos(along), std::sin(along));
  pose.heading_rad = std::remainder(pose.heading_rad + turn_rad, 2 * std::numbers::pi);
  return pose;
}

}  // namespace

LocalizerHistory::LocalizerHistory(const LocalizerConfig& config, const hal::Pose2& start,
                                   const Eigen::Matrix3d& covariance)
    : config_(config),
      blocks_{Block{LocalizerFilter(config, start, covariance), {}}},
      filters_{blocks_.front().before, blocks_.front().before} {}

Correction LocalizerHistory::add(const LocalizerEvent& event) {
  const hal::Time stamp = stamp_of(event);
  if (final_until_ && stamp < *final_until_) return {Gate::rejected, true, 0, 0};
  Place at = place_of(event);
  if (at.later > 0)
    go_back_to(at);
  else if (at.entry >= kBlockEntries)
    at = begin_block();
  if (at.later == 0) keep_before(event);
  Correction correction;
  correction.gate = filters_[now_].apply(config_, event);
  if (gated(event)) {
    correction.nis = filters_[now_].last_nis();
    correction.dimension = filters_[now_].last_dimension();
  }
  auto& entries = at.block->entries;
  entries.insert(entries.begin() + static_cast<std::ptrdiff_t>(at.entry),
                 Entry{stamp, event, filters_[now_].filter_pose()});
  ++known_;
  ++at.entry;
  if (at.later > 0) go_on_from(at);
  if (entries.size() > 2 * kBlockEntries) halve(at.block);
  forget(blocks_.back().entries.back().stamp);
  return correction;
}

// Most come in order: looks from the end.
LocalizerHistory::Place LocalizerHistory::place_of(const LocalizerEvent& event) {
  Place at{blocks_.end(), 0, 0};
  while (at.block != blocks_.begin()) {
    const auto block = std::prev(at.block);
    const std::size_t first = block == blocks_.begin() ? final_ : 0;
    std::size_t entry = block->entries.size();
    while (entry > first && goes_before(event, block->entries[entry - 1].event)) {
      --entry;
      ++at.later;
    }
    // After all of this block is before all of the next one.
    if (entry == block->entries.size() && at.block != blocks_.end()) return at;
    at = {block, entry, at.later};
    if (entry > 0) return at;
  }
  return at;
}

// With the filter as it is now.
LocalizerHistory::Place LocalizerHistory::begin_block() {
  if (spare_.empty()) {
    blocks_.push_back({filters_[now_], {}});
    blocks_.back().entries.reserve(2 * kBlockEntries + 1);
  } else {
    blocks_.splice(blocks_.end(), spare_, spare_.begin());
    blocks_.back().before = filters_[now_];
  }
  return {std::prev(blocks_.end()), 0, 0};
}

// Before a travel report, unless its inertial sample is there.
void LocalizerHistory::keep_before(const LocalizerEvent& event) {
  const auto& last = blocks_.back().entries;
  const bool travel = std::holds_alternative<hal::WheelTravel>(event);
  if (travel && !last.empty() && last.back().stamp == stamp_of(event)) {
    before_last_ = 0;
  } else if (travel) {
    filters_[1 - now_] = filters_[now_];
    before_last_ = 1;
  } else if (before_last_ > 0) {
    ++before_last_;
  }
}

void LocalizerHistory::go_back_to(const Place& place) {
  const std::size_t kept = std::exchange(before_last_, 0);
  std::size_t entry = 0;
  if (kept >= place.later && kept - place.later <= place.entry) {
    now_ = 1 - now_;
    entry = place.entry - (kept - place.later);
  } else {
    filters_[now_] = place.block->before;
  }
  for (; entry < place.entry; ++entry)
    filters_[now_].apply(config_, place.block->entries[entry].event);
}

void LocalizerHistory::go_on_from(const Place& place) {
  std::size_t entry = place.entry;
  for (auto block = place.block; block != blocks_.end(); ++block, entry = 0) {
    if (entry == 0) block->before = filters_[now_];
    for (; entry < block->entries.size(); ++entry) {
      filters_[now_].apply(config_, block->entries[entry].event);
      block->entries[entry].after = filters_[now_].filter_pose();
    }
  }
}

void LocalizerHistory::halve(std::list<Block>::iterator block) {
  Block half{block->before, {}};
  half.entries.reserve(2 * kBlockEntries + 1);
  const auto middle = block->entries.begin() + kBlockEntries;
  for (auto entry = block->entries.begin(); entry != middle; ++entry)
    half.before.apply(config_, entry->event);
  half.entries.assign(middle, block->entries.end());
  block->entries.erase(middle, block->entries.end());
  blocks_.insert(std::next(block), std::move(half));
  forget_blocks();
}

void LocalizerHistory::forget(hal::Time now) {
  const hal::Time oldest = now - hal::from_seconds(config_.history_s);
  for (;;) {
    const hal::Time first = blocks_.front().entries[final_].stamp;
    if (known_ <= 1 || (first >= oldest && known_ <= config_.history_max)) return;
    final_until_ = first;
    ++final_;
    --known_;
    forget_blocks();
  }
}

// Those of which all is final.
void LocalizerHistory::forget_blocks() {
  while (final_ >= blocks_.front().entries.size()) {
    final_ -= blocks_.front().entries.size();
    blocks_.front().entries.clear();
    spare_.splice(spare_.begin(), blocks_, blocks_.begin());
  }
}

// Poses stand where travel reports end: between two of them the way is cut in proportion.
hal::Pose2 LocalizerHistory::pose_at(hal::Time stamp) const {
  const FilterPose* to = nullptr;
  for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block) {
    const std::size_t first = std::next(block) == blocks_.rend() ? final_ : 0;
    for (std::size_t i = block->entries.size(); i-- > first;) {
      const Entry& entry = block->entries[i];
      if (entry.stamp <= stamp)
        return to ? between(entry.after, *to, stamp) : ahead(entry.after, stamp);
      if (std::holds_alternative<hal::WheelTravel>(entry.event)) to = &entry.after;
    }
  }
  const FilterPose from =
      final_ > 0 ? blocks_.front().entries[final_ - 1].after : blocks_.front().before.filter_pose();
  return to ? between(from, *to, stamp) : ahead(from, stamp);
}

}  // namespace nav
