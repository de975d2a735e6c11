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

ViewRates::ViewRates(std::vector<ViewOffer> offers, std::function<double(std::size_t)> takes_s,
                     std::function<std::uint32_t(std::size_t)> gains)
    : offers_(std::move(offers)), takes_s_(std::move(takes_s)), gains_(std::move(gains)) {
  for (std::size_t i = 0; i < offers_.size(); ++i) {
    const auto [gain_voxels, least_s] = offers_[i];
    if (!(least_s > 0) || !std::isfinite(least_s))
      throw std::invalid_argument("view rates: least_s must be positive and finite");
    heap_.push_back({per_minute(gain_voxels, least_s), i, gain_voxels, least_s, Known::bounds});
  }
  std::make_heap(heap_.begin(), heap_.end(), kWorse);
}

std::optional<RatedView> ViewRates::next() {
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), kWorse);
    const Entry top = heap_.back();
    heap_.pop_back();
    if (top.known == Known::all)
      return RatedView{top.offer, top.gain_voxels, top.takes_s, top.voxels_per_min};
    look_into(top);
  }
  return std::nullopt;
}

// Its time first, which is cheaper; then what it gains.
void ViewRates::look_into(Entry entry) {
  if (entry.known == Known::bounds) {
    ++asked_;
    entry.takes_s = std::max(takes_s_(entry.offer), entry.takes_s);
    if (!std::isfinite(entry.takes_s)) return;
    entry.known = gains_ ? Known::time : Known::all;
  } else {
    entry.gain_voxels = std::min(gains_(entry.offer), entry.gain_voxels);
    if (entry.gain_voxels == 0) return;
    entry.known = Known::all;
  }
  entry.voxels_per_min = per_minute(entry.gain_voxels, entry.takes_s);
  push(entry);
}

void ViewRates::push(const Entry& entry) {
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end(), kWorse);
}

}  // namespace planning
