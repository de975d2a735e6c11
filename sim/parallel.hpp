// Splits independent work over a few threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace sim {

// work(chunk) once for every chunk below `chunks`, begun on threads beside this one and finished
// with it. Chunks must not depend on each other.
template <class Work>
class ChunkWork {
 public:
  ChunkWork(std::size_t chunks, int helpers, Work work) : chunks_(chunks), work_(std::move(work)) {
    for (int i = 0; i < helpers; ++i) helpers_.emplace_back([this] { run(); });
  }
  // What nobody has begun is left out.
  ~ChunkWork() { next_ = chunks_; }
  ChunkWork(const ChunkWork&) = delete;
  ChunkWork& operator=(const ChunkWork&) = delete;

  // The first exception of any is thrown again here.
  void finish() {
    run();
    helpers_.clear();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run() {
    try {
      for (std::size_t chunk; (chunk = next_++) < chunks_;) work_(chunk);
    } catch (...) {
      const std::lock_guard lock(failing_);
      if (!failure_) failure_ = std::current_exception();
      next_ = chunks_;
    }
  }

  const std::size_t chunks_;
  Work work_;
  std::atomic<std::size_t> next_{0};
  std::exception_ptr failure_;
  std::mutex failing_;
  std::vector<std::jthread> helpers_;  // Last: they use the rest.
};

// Calls work(chunk) once for every chunk below `chunks`, on `threads` threads, this one included.
// Chunks must not depend on each other. The first exception of any is thrown again here.
template <class Work>
void for_each_chunk(std::size_t chunks, int threads, const Work& work) {
  ChunkWork<const Work&>(chunks, threads - 1, work).finish();
}

}  // namespace sim
