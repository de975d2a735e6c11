// Work in pieces that somebody else may run on threads. Results are kept by piece and put together
// in their order, so that they do not depend on who ran what.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace nav {

// Calls work(i) once for every i in [0, count), in any order, at once or one after the other, and
// returns when all are done. Empty: one after the other.
using RunPieces =
    std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;

inline constexpr std::size_t kPieceSize = 512;

// work(begin, end) for pieces of [0, count) whose borders do not depend on `run`.
template <class Work>
void in_pieces(const RunPieces& run, std::size_t count, const Work& work) {
  const std::size_t pieces = (count + kPieceSize - 1) / kPieceSize;
  const auto piece = [&](std::size_t i) {
    work(i * kPieceSize, std::min(count, (i + 1) * kPieceSize));
  };
  if (run && pieces > 1) return run(pieces, piece);
  for (std::size_t i = 0; i < pieces; ++i) piece(i);
}

// The sum of part(begin, end) over the pieces, added in their order.
template <class Sum, class Part>
Sum sum_pieces(const RunPieces& run, std::size_t count, const Part& part) {
  std::vector<Sum> parts((count + kPieceSize - 1) / kPieceSize);
  in_pieces(run, count, [&](std::size_t begin, std::size_t end) {
    parts[begin / kPieceSize] = part(begin, end);
  });
  Sum sum{};
  for (const Sum& one : parts) sum += one;
  return sum;
}

}  // namespace nav
