#include "planning/candidate_links.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planning {

CandidateLinks::CandidateLinks(const std::vector<std::vector<Span>>& views, double overlap_min)
    : views_(views), overlap_min_(overlap_min), shared_nm_(views.size()) {
  for (const auto& view : views) sees_nm_.push_back(length_nm(view));
}

std::int64_t CandidateLinks::shared(int a, int b) {
  if (a > b) std::swap(a, b);
  auto& row = shared_nm_[static_cast<std::size_t>(a)];
  if (row.empty()) {
    if ((rows_ + 1) * views_.size() > std::max(kKeptMax, views_.size())) {
      for (auto& other : shared_nm_) other.clear();
      rows_ = 0;
    }
    row.assign(views_.size(), -1);
    ++rows_;
  }
  auto& known = row[static_cast<std::size_t>(b)];
  if (known < 0)
    known = shared_nm(views_[static_cast<std::size_t>(a)], views_[static_cast<std::size_t>(b)]);
  return known;
}

GraphParts CandidateLinks::parts(const std::vector<int>& stations) {
  std::vector<std::pair<int, int>> edges;
  for (std::size_t a = 0; a < stations.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (linked(sees(stations[a]), sees(stations[b]), shared(stations[a], stations[b]),
                 overlap_min_))
        edges.emplace_back(b, a);
  return parts_of(static_cast<int>(stations.size()), edges);
}

std::int64_t CandidateLinks::missing_nm(const std::vector<int>& stations) {
  std::vector<int> rest = stations;
  std::vector<std::int64_t> most(rest.size());  // That each shares with one that is joined.
  const auto lacks = [&](std::size_t i) {
    return std::ceil(overlap_min_ * static_cast<double>(sees(rest[i])) -
                     static_cast<double>(most[i]));
  };
  std::size_t next = 0;
  for (std::size_t i = 1; i < rest.size(); ++i)
    if (sees(rest[i]) > sees(rest[next])) next = i;
  while (next < rest.size()) {
    const int joined = std::exchange(rest[next], rest.back());
    most[next] = most.back();
    rest.pop_back();
    most.pop_back();
    next = rest.size();
    for (std::size_t i = 0; i < rest.size(); ++i) {
      most[i] = std::max(most[i], shared(joined, rest[i]));
      if (lacks(i) <= 0) next = i;
    }
  }
  double missing = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) missing += lacks(i);
  return static_cast<std::int64_t>(missing);
}

}  // namespace planning
