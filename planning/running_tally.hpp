// The tally of Phase II kept up to date from scan to scan: the same numbers as tally(), in every
// cell and every time, for a small part of the work.
//
// For every boundary voxel it keeps who sees it and which blocked voxels hid it from the others
// (the sweep names, for each candidate that it strikes off, one run of blocked voxels). As long as
// these stay blocked, nobody else comes to see it. So after a scan
//   - a voxel that became empty matters only to boundary voxels that have it on their list, and
//     there only to the rows of candidates behind it: these are swept again;
//   - a voxel that became blocked takes its exact shadow out of the sets it falls into;
//   - new boundary voxels, and those with other faces, are swept whole; gone ones are subtracted;
//   - new candidates are swept for alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planning/next_best_view.hpp"
#include "planning/tally_sweep.hpp"

namespace planning {

class RunningTally {
 public:
  struct Options {
    // Of what is kept from one update to the next. Beyond it the sets are dropped, and every
    // update from then on is a whole tally().
    std::size_t memory_max_bytes = std::size_t{512} << 20;
    // Compare every update with tally(), cell by cell; throws std::logic_error if they differ.
    bool self_check = false;
  };
  // What the last update did with the boundary voxels.
  struct Work {
    std::size_t swept{};         // New ones and ones with other faces.
    std::size_t partly_swept{};  // Something that hid them became empty.
    std::size_t kept{};          // All others.
    std::size_t bytes{};         // Held for the next update.
    bool whole{};                // memory_max_bytes was exceeded: tally() did it.
  };

  // Throws std::invalid_argument as tally() does, at update(). Without options, debug builds check
  // themselves.
  explicit RunningTally(const ViewLimits& limits, int threads = 1);
  RunningTally(const ViewLimits& limits, int threads, const Options& options);

  // What tally(map, boundary, candidates, limits) returns; valid until the next update. All three
  // may have changed in any way since the last one: a boundary in the order of boundary_unseen()
  // and few changes make it fast.
  const std::vector<std::uint32_t>& update(const VoxelMap& map,
                                           const std::vector<BoundaryVoxel>& boundary,
                                           const std::vector<Voxel>& candidates);

  // What visible_from() returns for the map and the boundary of the last update; looked up if p was
  // ever a candidate and is seen-empty, else walked. Throws std::invalid_argument outside the box
  // or before the first update.
  std::vector<std::uint32_t> visible(Voxel p) const;

  const Work& work() const { return work_; }

 private:
  static Options default_options();

  // Words and hidden_by as in SeenSet, each once; words ascending.
  struct Sight {
    BoundaryVoxel u;
    bool swept{};
    std::vector<SeenWord> words;
    std::vector<std::uint32_t> hidden_by;
  };
  // Everybody who was ever a candidate in layer z.
  struct Layer {
    int z{};
    std::size_t word_begin{};          // Of SeenWord::word.
    std::vector<std::uint64_t> known;  // A bit per voxel.
    std::vector<Voxel> fresh;          // Came with this update.
    std::optional<CandidateLayer> all, new_ones;
  };
  // From the last update's map to this one's.
  struct Changes {
    std::vector<std::uint8_t> emptied;  // A bit per voxel, bytes as in BlockedRows.
    std::vector<Voxel> filled;          // By z, y, x;
    std::vector<std::uint32_t>
        filled_rows;  // those of row y of level z: from [z ny + y] to the next.
  };
  struct Box {
    Interval x, y;
  };
  // What one thread works with.
  struct Worker {
    Sweep<SeenSet> sweep;
    std::vector<std::uint32_t> gains;  // To be added to counts_, modulo 2^32.
    std::vector<SeenWord> before;      // The sight's words before the first change, if saved.
    bool saved{};
    std::vector<Opening> openings;  // Hid the present boundary voxel from someone.
    std::size_t swept{}, partly_swept{};

    void save(const std::vector<SeenWord>& words) {
      if (!saved) before = words;
      saved = true;
    }
  };

  void forget();
  Changes note_changes(const VoxelMap& map);
  void note_candidates(const std::vector<Voxel>& candidates);
  void note_boundary(const std::vector<BoundaryVoxel>& boundary);
  void refresh(const Changes& changes);
  void refresh(Sight& sight, const Changes& changes, Worker& worker) const;
  void uncover(Sight& sight, const Changes& changes, std::vector<Opening>& openings) const;
  void shade(Sight& sight, const Changes& changes, Worker& worker) const;
  Box box_of(const Sight& sight, const Layer& layer) const;
  void shade(Sight& sight, const Layer& layer, Voxel filled, Worker& worker) const;
  void sweep(Sight& sight, Worker& worker) const;
  std::vector<std::uint32_t> answer(const std::vector<Voxel>& candidates) const;
  std::size_t bytes() const;

  Layer* layer_of(int z);
  const Layer* layer_of(int z) const;
  std::size_t layer_words() const;  // All layers have as many.
  std::size_t word_of(const Layer& layer, Voxel p) const;

  const ViewLimits limits_;
  const int threads_;
  const Options options_;
  std::optional<ViewRule> rule_;
  std::optional<VoxelMap> map_;          // As of the last update.
  std::vector<BoundaryVoxel> boundary_;  // Likewise, in the caller's order.
  std::vector<std::uint32_t> order_;     // sights_[i] is of boundary_[order_[i]].
  std::vector<Sight> sights_;            // By z, y, x.
  std::vector<Layer> layers_;            // In the order in which they came up.
  std::vector<std::uint32_t> counts_;    // Per voxel of each layer.
  std::vector<std::uint32_t> result_;
  Work work_;
};

}  // namespace planning
