#include "tests/dst/rig/missions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <thread>

namespace dst {
namespace {

// Hands out seeds, and outcomes in the order of the seeds.
class Line {
 public:
  Line(std::uint64_t first, int count,
       const std::function<void(std::uint64_t, const Outcome&)>& each)
      : next_(first), end_(first + static_cast<std::uint64_t>(count)), due_(first), each_(each) {}

  void work() {
    for (;;) {
      const std::optional<std::uint64_t> seed = take();
      if (!seed) return;
      give(*seed, run_seed(*seed));
    }
  }
  const Sums& sums() const { return sums_; }

 private:
  std::optional<std::uint64_t> take() {
    const std::scoped_lock lock(mutex_);
    return next_ == end_ ? std::nullopt : std::optional(next_++);
  }
  void give(std::uint64_t seed, Outcome outcome) {
    const std::scoped_lock lock(mutex_);
    sums_.add(outcome);
    done_.emplace(seed, std::move(outcome));
    for (; !done_.empty() && done_.begin()->first == due_; ++due_) {
      each_(due_, done_.begin()->second);
      done_.erase(done_.begin());
    }
  }

  std::mutex mutex_;
  std::uint64_t next_;
  const std::uint64_t end_;
  std::uint64_t due_;
  std::map<std::uint64_t, Outcome> done_;  // At most as many as threads wait for an earlier seed.
  const std::function<void(std::uint64_t, const Outcome&)>& each_;
  Sums sums_;
};

}  // namespace

void Sums::add(const Outcome& outcome) {
  ++missions;
  completed += outcome.completed;
  resumed += outcome.resumed;
  stops += outcome.stops;
  violated += outcome.violation.has_value();
  scans += outcome.scans;
  virtual_s += hal::seconds(outcome.virtual_time);
  cpu_s += outcome.cpu_s;
  driven_m += outcome.driven_m;
  slowest_stop = std::max(slowest_stop, outcome.slowest_stop);
}

std::string Sums::text() const {
  return fmt::format(
      "{} missions, {} completed, {} gone on with, {} scans, {:.1f} km, {} stops, the slowest "
      "after {:.1f} ms; "
      "{:.1f} h of virtual time in {:.1f} s: {:.0f} times real time with {} at once, {:.0f} times "
      "on one core; {} violated\n",
      missions, completed, resumed, scans, driven_m / 1000, stops,
      1000 * hal::seconds(slowest_stop), virtual_s / 3600, wall_s, factor(), jobs, factor_of_core(),
      violated);
}

Sums run_seeds(std::uint64_t first, int count, int jobs,
               const std::function<void(std::uint64_t, const Outcome&)>& each) {
  const auto begin = std::chrono::steady_clock::now();
  Line line(first, count, each);
  std::vector<std::jthread> threads;
  for (int i = 1; i < jobs; ++i) threads.emplace_back([&line] { line.work(); });
  line.work();
  threads.clear();
  Sums sums = line.sums();
  sums.jobs = jobs;
  sums.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return sums;
}

}  // namespace dst
