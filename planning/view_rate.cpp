#include "planning/view_rate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace planning {
namespace {

double per_minute(std::uint32_t voxels, double takes_s) {
  return 60.0 * voxels / takes_s;
}

// Of equals the lower index first; a bound before the real rate it turns out to be.
constexpr auto kWorse = [](const auto& a, const auto& b) {
  return a.voxels_per_min < b.voxels_per_min ||
         (a.voxels_per_min == b.voxels_per_min && a.offer > b.offer);
};

}  // namespace

ViewRates::ViewRates(std::vector<ViewOffer> offers, std::function<double(std::size_t)> takes_s)
    : offers_(std::move(offers)), takes_s_(std::move(takes_s)) {
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    const ViewOffer& offer = offers_[i];
    if (!(offer.least_s > 0) || !std::isfinite(offer.least_s))
      throw std::invalid_argument("view rates: least_s must be positive and finite");
    heap_.push_back({per_minute(offer.gain_voxels, offer.least_s), i, offer.least_s, false});
  }
  std::make_heap(heap_.begin(), heap_.end(), kWorse);
}

std::optional<RatedView> ViewRates::next() {
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), kWorse);
    const Entry top = heap_.back();
    heap_.pop_back();
    if (top.is_real) return RatedView{top.offer, top.takes_s, top.voxels_per_min};
    ++asked_;
    const ViewOffer& offer = offers_[top.offer];
    const double takes_s = std::max(takes_s_(top.offer), offer.least_s);
    if (std::isfinite(takes_s))
      push({per_minute(offer.gain_voxels, takes_s), top.offer, takes_s, true});
  }
  return std::nullopt;
}

void ViewRates::push(const Entry& entry) {
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end(), kWorse);
}

}  // namespace planning
