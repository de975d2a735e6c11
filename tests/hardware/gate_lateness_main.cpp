// gate_lateness: how late the gate wakes up on this machine while plans are made on all of its
// processors.
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

#include "drivers/real_clock.hpp"
#include "mission/gated_drive.hpp"
#include "mission/main_command_line.hpp"
#include "mission/main_realtime.hpp"
#include "mission/main_run.hpp"
#include "tests/hardware/away.hpp"
#include "tests/support/well_drive.hpp"

namespace {

using namespace std::chrono_literals;

constexpr int kInTime = 0, kLate = 1, kRefused = 2;
constexpr hal::Duration kSettles = 500ms;  // Before it counts.
constexpr hal::Duration kLooks = 1ms, kGap = 3ms;
constexpr std::size_t kGapsMax = 100'000;  // Of a processor.

struct Options {
  std::filesystem::path mission;
  int seconds = 60, planners = 0;
  double max_ms = 5;
};

struct Lateness {
  // What the machine refused; empty: the gate runs before everything else, as in a service.
  std::string refusal;
  std::vector<hal::Duration> late;  // Of each cycle, sorted, without what the machine took.
  int plans{};                      // That were finished meanwhile.
  std::size_t gaps{};               // How often the machine took a processor away,
  hal::Duration longest_gap{};      // and for how long at most.

  // So late, or less, was that share of all cycles.
  hal::Duration share(double share) const {
    if (late.empty()) return hal::Duration::max();
    const double last = std::ceil(share * static_cast<double>(late.size())) - 1;
    return late[static_cast<std::size_t>(std::max(0.0, last))];
  }
};

double ms(hal::Duration span) {
  return 1e3 * hal::seconds(span);
}

// Sees on each processor, before everything else there, when the machine takes it away.
class Sentinels {
 public:
  // Of all that there are, also where this program may not use them all: they go by their numbers.
  Sentinels() : gaps_(static_cast<std::size_t>(sysconf(_SC_NPROCESSORS_CONF))) {
    for (std::size_t cpu = 0; cpu < gaps_.size(); ++cpu)
      threads_.emplace_back([this, cpu](std::stop_token over) { watch(over, cpu); });
  }
  // Of each processor.
  std::vector<std::vector<test::Away>> finish() {
    threads_.clear();
    return std::move(gaps_);
  }

 private:
  void watch(const std::stop_token& over, std::size_t cpu) {
    cpu_set_t here;
    CPU_ZERO(&here);
    CPU_SET(cpu, &here);
    const sched_param first{.sched_priority = sched_get_priority_max(SCHED_FIFO)};
    if (pthread_setaffinity_np(pthread_self(), sizeof here, &here) != 0 ||
        pthread_setschedparam(pthread_self(), SCHED_FIFO, &first) != 0)
      return;  // Then nothing is excused.
    const drivers::RealClock clock;
    gaps_[cpu].reserve(kGapsMax);
    for (hal::Time last = clock.now(); !over.stop_requested();) {
      std::this_thread::sleep_for(kLooks);
      const hal::Time now = clock.now();
      if (now - last > kGap && gaps_[cpu].size() < kGapsMax) gaps_[cpu].push_back({last, now});
      last = now;
    }
  }

  std::vector<std::vector<test::Away>> gaps_;
  std::vector<std::jthread> threads_;
};

struct Cycle {
  hal::Time due, came;
  std::size_t cpu{};
};

// Its cycles, each against when it was due: a period after the one before.
void run_gate(hal::Duration during, std::vector<Cycle>& cycles, std::string& refused) {
  for (const std::string& refusal : {mission::lock_memory(), mission::run_first()})
    if (!refusal.empty()) refused += (refused.empty() ? "" : "; ") + refusal;
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  test::WellDrive drive(clock);
  const hal::Time from = clock.now() + kSettles, until = from + during;
  cycles.reserve(static_cast<std::size_t>(during / mission::kGatePeriod) + 10);
  hal::Time due{};
  mission::GatedDrive::Config config;
  config.alive = [&] {
    const hal::Time now = clock.now();
    if (due == hal::Time{} || now < due) due = now;  // It was due no later than it came.
    if (now >= from && cycles.size() < cycles.capacity())
      cycles.push_back({due, now, static_cast<std::size_t>(sched_getcpu())});
    due = std::max(due + mission::kGatePeriod, now);
    if (now >= until) io.stop();
  };
  mission::GatedDrive gate(config, clock, drive);
  boost::asio::co_spawn(io, gate.run(), [](std::exception_ptr problem) {
    if (problem) std::rethrow_exception(problem);
  });
  io.run();
}

// On an event loop of its own, beside threads that make the mission's plan over and over.
Lateness measure(const Options& options, const mission::Prepared& prepared) {
  Lateness found;
  std::atomic<bool> over = false;
  std::atomic<int> plans = 0;
  std::vector<std::jthread> planners;
  for (int i = 0; i < options.planners; ++i)
    planners.emplace_back([&] {
      for (; !over; ++plans)
        (void)mission::plan_areas(prepared.config, prepared.site.map, prepared.tasks, 1);
    });
  Sentinels sentinels;
  std::vector<Cycle> cycles;
  std::thread([&] {
    run_gate(std::chrono::seconds(options.seconds), cycles, found.refusal);
  }).join();
  const std::vector<std::vector<test::Away>> away = sentinels.finish();
  over = true;
  planners.clear();
  found.plans = plans;
  for (const Cycle& cycle : cycles)
    found.late.push_back(test::own_lateness(cycle.due, cycle.came, away.at(cycle.cpu)));
  std::ranges::sort(found.late);
  for (const std::vector<test::Away>& gaps : away)
    for (const test::Away& gap : gaps) {
      ++found.gaps;
      found.longest_gap = std::max(found.longest_gap, gap.until - gap.from);
    }
  return found;
}

int run(const Options& options) {
  const mission::Prepared prepared = mission::prepare(options.mission, {}, mission::WorldUse::none);
  for (const auto& error : prepared.errors) fmt::print(stderr, "{}\n", error.text());
  if (!prepared.errors.empty()) return kRefused;
  const Lateness found = measure(options, prepared);
  fmt::print(
      "the gate woke up late by: p50 {:.3f} ms, p99 {:.3f} ms, p99.9 {:.3f} ms, at most {:.3f} ms; "
      "{} cycles beside {} threads, which made {} plans\n",
      ms(found.share(0.5)), ms(found.share(0.99)), ms(found.share(0.999)), ms(found.share(1)),
      found.late.size(), options.planners, found.plans);
  if (found.gaps > 0)
    fmt::print("not counted: the machine took a processor away {} times, for {:.3f} ms at most\n",
               found.gaps, ms(found.longest_gap));
  if (!found.refusal.empty()) {
    fmt::print("nothing is asked of it here: {}\n", found.refusal);
    return kInTime;
  }
  return ms(found.share(0.999)) <= options.max_ms ? kInTime : kLate;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  mission::CommandLine line(
      "How late the gate wakes up on this machine while plans are made on all of its processors.",
      "Exit: 0 p99.9 is within --max-ms, or the machine permits no real-time priority, 1 it is "
      "not,\n2 refused to start.");
  line.add("mission", &options.mission, "Mission file (TOML) that is planned meanwhile",
           {.required = true});
  line.add("--seconds", &options.seconds, "How long",
           {.within = {{1, 86400}}, .shows_default = true});
  line.add("--planners", &options.planners, "Threads that plan (0: one for each processor)",
           {.within = {{0, 256}}});
  line.add("--max-ms", &options.max_ms, "What is asked of p99.9", {.shows_default = true});
  if (!line.parse(argc, argv)) return line.asked_for_help() ? kInTime : kRefused;
  options.planners = mission::threads_or_all(options.planners);
  return run(options);
}
