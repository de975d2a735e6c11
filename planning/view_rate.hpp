// Which view is worth its time: voxels per minute, road and scan included.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace planning {

// A view that may be chosen.
struct ViewOffer {
  std::uint32_t gain_voxels{};  // At most.
  // No way there and scan take less, in seconds, > 0: scan time plus the straight line's.
  double least_s{};
};

struct RatedView {
  std::size_t offer{};
  std::uint32_t gain_voxels{};
  double takes_s{};  // Way and scan.
  double voxels_per_min{};

  bool operator==(const RatedView&) const = default;
};

// Offers from the highest rate down, ties to the lowest index, asking for as few real times and
// gains as possible: a rate with least_s, and then one with the most that may be gained, bounds the
// rate from above, so an offer is only looked into when no other's real rate is higher than its
// bound.
class ViewRates {
 public:
  // takes_s: what an offer really takes, called at most once for each; infinite where one cannot
  // go, such offers are left out; below least_s counts as least_s.
  // gains: what it really gains, called at most once for each whose time is known; more than
  // gain_voxels counts as these, and offers of 0 are left out. Empty: gain_voxels is exact.
  // Throws std::invalid_argument unless every least_s is positive and finite.
  ViewRates(std::vector<ViewOffer> offers, std::function<double(std::size_t)> takes_s,
            std::function<std::uint32_t(std::size_t)> gains = {});

  // The best of those not yet given; nothing when there is none left.
  std::optional<RatedView> next();
  std::size_t asked() const { return asked_; }  // Calls of takes_s so far.

 private:
  enum class Known { bounds, time, all };
  struct Entry {
    double voxels_per_min;
    std::size_t offer;
    std::uint32_t gain_voxels;
    double takes_s;
    Known known;
  };
  void look_into(Entry entry);
  void push(const Entry& entry);

  std::vector<ViewOffer> offers_;
  std::function<double(std::size_t)> takes_s_;
  std::function<std::uint32_t(std::size_t)> gains_;
  std::vector<Entry> heap_;
  std::size_t asked_{};
};

}  // namespace planning
