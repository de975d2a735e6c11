// How well sets of candidates hold together, asked often for similar sets.
#pragma once

#include <vector>

#include "planning/overlap_graph.hpp"

namespace planning {

// Wall that pairs of candidates share, worked out when first asked for and kept. Memory: for each
// candidate asked for, one number per candidate; at most kKeptMax numbers.
class CandidateLinks {
 public:
  // `views` must outlive this.
  CandidateLinks(const std::vector<std::vector<Span>>& views, double overlap_min);

  // Parts and bridges of the overlap graph of these stations.
  GraphParts parts(const std::vector<int>& stations);

  // How far these stations are from an order in which each shares overlap_min of what it sees with
  // one before it, in nm; 0 if there is one that begins with the station that sees most. Stations
  // are joined to that one as long as any shares enough; the sum of what the others lack of it.
  // (The rule asks less: sharing with all those before it together.)
  std::int64_t missing_nm(const std::vector<int>& stations);

 private:
  static constexpr std::size_t kKeptMax = 32'000'000;

  std::int64_t shared(int a, int b);
  std::int64_t sees(int a) const { return sees_nm_[static_cast<std::size_t>(a)]; }

  const std::vector<std::vector<Span>>& views_;
  double overlap_min_;
  std::vector<std::int64_t> sees_nm_;
  std::vector<std::vector<std::int64_t>>
      shared_nm_;  // Rows are empty until asked for; -1: unknown.
  std::size_t rows_ = 0;
};

}  // namespace planning
