#include "planning/spans.hpp"

namespace planning {
namespace {

// The first span that ends at or after the place.
template <class Spans>
auto first_reaching(Spans& spans, std::int64_t place_nm) {
  return std::partition_point(spans.begin(), spans.end(),
                              [=](const Span& s) { return s.to_nm < place_nm; });
}

// Of places at most kGapNm apart in a row, the first.
void keep_first_of_chains(std::vector<std::int64_t>& places_nm) {
  std::ranges::sort(places_nm);
  std::vector<std::int64_t> kept;
  for (std::size_t i = 0; i < places_nm.size(); ++i)
    if (i == 0 || places_nm[i] - places_nm[i - 1] > kGapNm) kept.push_back(places_nm[i]);
  places_nm = std::move(kept);
}

std::int64_t last_up_to(const std::vector<std::int64_t>& places_nm, std::int64_t place_nm) {
  return *std::prev(std::ranges::upper_bound(places_nm, place_nm));
}

}  // namespace

std::vector<Span> spans_of(const std::vector<WallPiece>& pieces) {
  std::vector<Span> spans;
  spans.reserve(pieces.size());
  for (const WallPiece& p : pieces) spans.push_back({p.wall, to_nm(p.from_m), to_nm(p.to_m)});
  return spans;
}

std::vector<WallPiece> pieces_of(const std::vector<Span>& spans) {
  std::vector<WallPiece> pieces;
  for (const Span& s : spans) pieces.push_back({s.wall, nm_to_m(s.from_nm), nm_to_m(s.to_nm)});
  return pieces;
}

std::int64_t length_nm(const std::vector<Span>& spans) {
  std::int64_t sum = 0;
  for (const Span& s : spans) sum += s.length_nm();
  return sum;
}

void join_ends(std::vector<std::vector<Span>>& views, std::size_t walls) {
  std::vector<std::vector<std::int64_t>> places(walls);
  for (const auto& view : views)
    for (const Span& s : view)
      for (const std::int64_t end_nm : {s.from_nm, s.to_nm})
        places[static_cast<std::size_t>(s.wall)].push_back(end_nm);
  for (auto& on_wall : places) keep_first_of_chains(on_wall);
  for (auto& view : views) {
    std::vector<Span> joined;
    for (const Span& s : view) {
      const auto& on_wall = places[static_cast<std::size_t>(s.wall)];
      const Span span{s.wall, last_up_to(on_wall, s.from_nm), last_up_to(on_wall, s.to_nm)};
      if (span.length_nm() == 0) continue;
      if (!joined.empty() && joined.back().wall == span.wall &&
          joined.back().to_nm == span.from_nm) {
        joined.back().to_nm = span.to_nm;
      } else {
        joined.push_back(span);
      }
    }
    view = std::move(joined);
  }
}

void SpanSet::add(const Span& span) {
  if (span.length_nm() <= 0) return;
  std::vector<Span>& spans = walls_[static_cast<std::size_t>(span.wall)];
  const auto first = first_reaching(spans, span.from_nm - kGapNm);
  auto last = first;
  Span merged = span;
  for (; last != spans.end() && last->from_nm <= span.to_nm + kGapNm; ++last) {
    merged.from_nm = std::min(merged.from_nm, last->from_nm);
    merged.to_nm = std::max(merged.to_nm, last->to_nm);
  }
  if (first == last) {
    spans.insert(first, merged);
  } else {
    *first = merged;
    spans.erase(first + 1, last);
  }
}

void SpanSet::add(const SpanSet& other) {
  for (const auto& spans : other.walls_) add(spans);
}

std::int64_t SpanSet::overlap_nm(const Span& span) const {
  const std::vector<Span>& spans = on(span.wall);
  std::int64_t sum = 0;
  for (auto it = first_reaching(spans, span.from_nm); it != spans.end() && it->from_nm < span.to_nm;
       ++it)
    sum += std::min(it->to_nm, span.to_nm) - std::max(it->from_nm, span.from_nm);
  return sum;
}

std::int64_t SpanSet::overlap_nm(const std::vector<Span>& spans) const {
  std::int64_t sum = 0;
  for (const Span& span : spans) sum += overlap_nm(span);
  return sum;
}

std::int64_t SpanSet::total_nm() const {
  std::int64_t sum = 0;
  for (const auto& spans : walls_) sum += length_nm(spans);
  return sum;
}

SpanSet SpanSet::minus(const SpanSet& other) const {
  SpanSet rest(walls_.size());
  for (const auto& spans : walls_) {
    for (const Span& span : spans) {
      std::int64_t from_nm = span.from_nm;
      const std::vector<Span>& gone = other.on(span.wall);
      for (auto it = first_reaching(gone, span.from_nm);
           it != gone.end() && it->from_nm < span.to_nm; ++it) {
        rest.add(Span{span.wall, from_nm, it->from_nm});
        from_nm = it->to_nm;
      }
      rest.add(Span{span.wall, from_nm, span.to_nm});
    }
  }
  return rest;
}

std::vector<Span> SpanSet::spans() const {
  std::vector<Span> all;
  for (const auto& spans : walls_) all.insert(all.end(), spans.begin(), spans.end());
  return all;
}

}  // namespace planning
