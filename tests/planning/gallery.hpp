// Art galleries: a polygon with holes, watched from its own vertices. Everything is decided exactly
// in whole numbers. Shares no code with planning/sight: there a point on a wall sees nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "nav/geometry.hpp"
#include "tests/support/random_site.hpp"
#include "tools/make_sites_triangulate.hpp"

namespace gallery {

__extension__ using Int128 = __int128;
using nav::PointMm;

// Coordinates up to this keep all that follows within 128 bits.
inline constexpr std::int64_t kGridMax = std::int64_t{1} << 26;

inline int sign(Int128 value) {
  return (value > 0) - (value < 0);
}

// a x + b y + c, positive on the left of p -> q.
struct Line {
  std::int64_t a{}, b{}, c{};

  static Line through(PointMm p, PointMm q) {
    const std::int64_t a = p.y - q.y, b = q.x - p.x;
    return {a, b, -(a * p.x + b * p.y)};
  }
  Line reversed() const { return {-a, -b, -c}; }
};

// A point (x / w, y / w), w > 0.
struct Point {
  Int128 x{}, y{}, w{1};
};

inline Point crossing(const Line& l, const Line& m) {
  const Int128 x = static_cast<Int128>(l.b) * m.c - static_cast<Int128>(m.b) * l.c;
  const Int128 y = static_cast<Int128>(l.c) * m.a - static_cast<Int128>(m.c) * l.a;
  const Int128 w = static_cast<Int128>(l.a) * m.b - static_cast<Int128>(m.a) * l.b;
  return w < 0 ? Point{-x, -y, -w} : Point{x, y, w};
}

inline int side(const Line& line, const Point& p) {
  return sign(line.a * p.x + line.b * p.y + line.c * p.w);
}

// A convex piece of floor with an inside: on the left of all its lines. Corner i is where line i
// ends and the next begins.
class Piece {
 public:
  static std::optional<Piece> of(std::vector<Line> lines) {
    Piece piece;
    piece.lines_ = std::move(lines);
    for (std::size_t i = 0; i < piece.lines_.size(); ++i)
      piece.corners_.push_back(
          crossing(piece.lines_[i], piece.lines_[(i + 1) % piece.lines_.size()]));
    if (piece.lines_.size() < 3) return std::nullopt;
    return piece;
  }

  const std::vector<Line>& lines() const { return lines_; }
  const std::vector<Point>& corners() const { return corners_; }

  // What of it lies on the left of the line, if that has an inside.
  std::optional<Piece> left_of(const Line& line) const {
    std::vector<int> sides;
    for (const Point& corner : corners_) sides.push_back(side(line, corner));
    if (std::ranges::none_of(sides, [](int s) { return s > 0; })) return std::nullopt;
    if (std::ranges::none_of(sides, [](int s) { return s < 0; })) return *this;
    std::vector<Line> kept;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const int from = sides[(i + lines_.size() - 1) % lines_.size()], to = sides[i];
      if (from > 0 || to > 0) kept.push_back(lines_[i]);
      if (from > 0 && to <= 0) kept.push_back(line);
    }
    return of(std::move(kept));
  }

  // A point well inside, on no line that matters (but by a miracle), in 1 / 2^30 of the grid.
  std::optional<Point> somewhere(support::Dice& dice) const {
    long double x = 0, y = 0, sum = 0;
    for (const Point& corner : corners_) {
      const long double weight = dice.uniform(0.5, 1.5);
      x += weight * static_cast<long double>(corner.x) / static_cast<long double>(corner.w);
      y += weight * static_cast<long double>(corner.y) / static_cast<long double>(corner.w);
      sum += weight;
    }
    constexpr std::int64_t kFine = std::int64_t{1} << 30;
    const Point point{std::llroundl(x / sum * kFine), std::llroundl(y / sum * kFine), kFine};
    for (const Line& line : lines_)
      if (side(line, point) <= 0) return std::nullopt;
    return point;
  }

  double area() const {
    long double sum = 0;
    const auto at = [&](std::size_t i) {
      const Point& p = corners_[i % corners_.size()];
      return std::pair(static_cast<long double>(p.x) / static_cast<long double>(p.w),
                       static_cast<long double>(p.y) / static_cast<long double>(p.w));
    };
    for (std::size_t i = 1; i + 1 < corners_.size(); ++i) {
      const auto [x0, y0] = at(0);
      const auto [x1, y1] = at(i);
      const auto [x2, y2] = at(i + 1);
      sum += ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2;
    }
    return static_cast<double>(sum);
  }

 private:
  std::vector<Line> lines_;
  std::vector<Point> corners_;
};

// What a vertex sees between two directions: a triangle, by its three lines.
using Triangle = std::array<Line, 3>;

inline bool holds(const Triangle& triangle, const Point& p) {
  return std::ranges::all_of(triangle, [&](const Line& line) { return side(line, p) > 0; });
}

inline bool is_apart(const Piece& piece, const Triangle& triangle) {
  return std::ranges::any_of(triangle, [&](const Line& line) {
    return std::ranges::all_of(piece.corners(), [&](const Point& p) { return side(line, p) <= 0; });
  });
}

// The parts of the piece outside the triangle.
inline void subtract(Piece piece, const Triangle& triangle, std::vector<Piece>& left) {
  if (is_apart(piece, triangle)) return left.push_back(std::move(piece));
  std::optional<Piece> rest = piece;
  std::vector<Piece> outside;
  for (const Line& line : triangle) {
    if (auto part = rest->left_of(line.reversed())) outside.push_back(*std::move(part));
    rest = rest->left_of(line);
    if (!rest) return left.push_back(std::move(piece));
  }
  left.insert(left.end(), outside.begin(), outside.end());
}

class Gallery {
 public:
  // Outer ring counter-clockwise, holes clockwise.
  explicit Gallery(const nav::Polygon& polygon) {
    add(polygon.outer);
    for (const nav::Ring& hole : polygon.holes) add(hole);
    for (std::size_t guard = 0; guard < corners_.size(); ++guard) sight_.push_back(look(guard));
    for (const auto& t : sites::triangulate(polygon)) {
      std::vector<Line> lines;
      for (std::size_t i = 0; i < 3; ++i)
        lines.push_back(Line::through(at(t[i]), at(t[(i + 1) % 3])));
      floor_.push_back(*Piece::of(std::move(lines)));
    }
  }

  std::size_t guards() const { return corners_.size(); }
  const std::vector<Piece>& floor() const { return floor_; }

  // The guards that see the point; exactly, but for points on the edge of what one sees.
  std::vector<int> watchers(const Point& point) const {
    std::vector<int> seen_by;
    for (std::size_t guard = 0; guard < sight_.size(); ++guard)
      if (std::ranges::any_of(sight_[guard], [&](const auto& t) { return holds(t, point); }))
        seen_by.push_back(static_cast<int>(guard));
    return seen_by;
  }

  // The floor that none of these sees: nothing if and only if they see all of it.
  std::vector<Piece> unseen(const std::vector<int>& chosen) const {
    std::vector<Piece> rest = floor_;
    for (const int guard : chosen) {
      for (const Triangle& triangle : sight_[static_cast<std::size_t>(guard)]) {
        std::vector<Piece> left;
        for (Piece& piece : rest) subtract(std::move(piece), triangle, left);
        rest = std::move(left);
      }
    }
    return rest;
  }

 private:
  struct Corner {
    PointMm at, before, after;
  };

  PointMm at(int vertex) const { return corners_[static_cast<std::size_t>(vertex)].at; }

  void add(const nav::Ring& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i)
      corners_.push_back(
          {ring[i], ring[(i + ring.size() - 1) % ring.size()], ring[(i + 1) % ring.size()]});
  }

  static bool opens(const Corner& corner, PointMm direction) {
    const PointMm before = corner.before - corner.at, after = corner.after - corner.at;
    if (nav::cross(after, before) >= 0)
      return nav::cross(after, direction) > 0 && nav::cross(direction, before) > 0;
    return !(nav::cross(before, direction) > 0 && nav::cross(direction, after) > 0);
  }

  // All directions to other corners, each once, counter-clockwise.
  std::vector<PointMm> directions(PointMm from) const {
    std::vector<PointMm> ways;
    for (const Corner& corner : corners_)
      if (corner.at != from) ways.push_back(corner.at - from);
    const auto upper = [](PointMm d) { return d.y > 0 || (d.y == 0 && d.x > 0); };
    std::ranges::sort(ways, [&](PointMm d, PointMm e) {
      return upper(d) != upper(e) ? upper(d) : nav::cross(d, e) > 0;
    });
    const auto same = [&](PointMm d, PointMm e) {
      return upper(d) == upper(e) && nav::cross(d, e) == 0;
    };
    ways.erase(std::unique(ways.begin(), ways.end(), same), ways.end());
    return ways;
  }

  // The first edge (by the corner it begins at) that a ray meets which passes no corner.
  std::size_t first_hit(PointMm from, PointMm way) const {
    std::size_t best = corners_.size();
    Int128 best_num = 0, best_den = 1;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const PointMm p = corners_[i].at - from, q = corners_[i].after - from;
      if (nav::cross(way, p) >= 0 || nav::cross(way, q) <= 0) continue;  // Seen from its inside.
      const Int128 num = nav::cross(p, q - p), den = nav::cross(way, q - p);
      if (num <= 0 || (best < corners_.size() && num * best_den >= best_num * den)) continue;
      best = i;
      best_num = num;
      best_den = den;
    }
    return best;
  }

  std::vector<Triangle> look(std::size_t guard) const {
    const Corner& corner = corners_[guard];
    const auto ways = directions(corner.at);
    std::vector<Triangle> triangles;
    std::size_t last = corners_.size();  // The edge of the triangle before, if this adjoins it.
    for (std::size_t i = 0; i < ways.size(); ++i) {
      const PointMm from = ways[i], to = ways[(i + 1) % ways.size()], way = from + to;
      if (nav::cross(from, to) <= 0 || !opens(corner, way)) {
        last = corners_.size();
        continue;
      }
      const std::size_t edge = first_hit(corner.at, way);
      const Line until = Line::through(corner.at, corner.at + to).reversed();
      if (edge == last) {
        triangles.back()[1] = until;
      } else {
        triangles.push_back({Line::through(corner.at, corner.at + from), until,
                             Line::through(corners_[edge].at, corners_[edge].after)});
      }
      last = edge;
    }
    return triangles;
  }

  std::vector<Corner> corners_;
  std::vector<std::vector<Triangle>> sight_;  // By guard.
  std::vector<Piece> floor_;
};

}  // namespace gallery
