// The localizer's filter with what it was told lately, so that what comes late takes effect where
// it belongs: what came after it is done again. A plain value.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <list>
#include <optional>
#include <vector>

#include "nav/localizer_filter.hpp"

namespace nav {

// What a localizer did with a measurement.
struct Correction {
  Gate gate = Gate::rejected;
  bool too_late{};  // Older than the history.
  double nis{};     // Squared normalised innovation; 0 where it was not computed.
  int dimension{};
};

// Of two events of one stamp, the kind that goes first; of one kind, what came first.
inline bool goes_before(const LocalizerEvent& event, const LocalizerEvent& other) {
  const hal::Time stamp = stamp_of(event), other_stamp = stamp_of(other);
  return stamp != other_stamp ? stamp < other_stamp : event.index() < other.index();
}

class LocalizerHistory {
 public:
  LocalizerHistory(const LocalizerConfig& config, const hal::Pose2& start,
                   const Eigen::Matrix3d& covariance);

  Correction add(const LocalizerEvent& event);
  const LocalizerFilter& filter() const { return filters_[now_]; }  // After the last event.
  // As nav::Localizer has it.
  hal::Pose2 pose_at(hal::Time stamp) const;

 private:
  struct Entry {
    hal::Time stamp;
    LocalizerEvent event;
    FilterPose after;
  };
  // Entries in a row, from a filter on. Filters are large, so that only some are kept: to a place
  // in between one goes forward from the block's.
  struct Block {
    LocalizerFilter before;
    std::vector<Entry> entries;
  };
  // Before the entry of that number, and so many that come later.
  struct Place {
    std::list<Block>::iterator block;
    std::size_t entry, later;
  };

  Place place_of(const LocalizerEvent& event);
  Place begin_block();
  void go_back_to(const Place& place);
  void keep_before(const LocalizerEvent& event);
  void go_on_from(const Place& place);
  void halve(std::list<Block>::iterator block);
  void forget(hal::Time now);
  void forget_blocks();

  LocalizerConfig config_;
  std::list<Block> blocks_;  // Never empty; nor is any of them where there are several.
  std::list<Block> spare_;   // Forgotten: blocks are large, and come and go all the time.
  std::size_t final_{};      // So many entries of the first block are final,
  std::size_t known_{};      // and so many of all are not.
  std::optional<hal::Time> final_until_;
  // After the last entry, and before so many of the last: inertial samples often come just after
  // the travel report that they belong before.
  std::array<LocalizerFilter, 2> filters_;
  std::size_t now_{}, before_last_{};
};

}  // namespace nav
