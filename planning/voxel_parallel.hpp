// Threads for loops over independent pieces.
#pragma once

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace planning {

// Calls work(thread, begin, end) for pieces of [0, count) of at most `piece` each, `thread` in
// [0, threads). Which thread gets which piece is left to chance, so the sum of what they do must
// not depend on it. work must not throw.
template <class Work>
void for_pieces(int threads, std::size_t count, std::size_t piece, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&](int thread) {
    for (std::size_t begin; (begin = next.fetch_add(piece)) < count;)
      work(thread, begin, begin + piece < count ? begin + piece : count);
  };
  std::vector<std::jthread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(run, thread);
  run(0);
}

}  // namespace planning
