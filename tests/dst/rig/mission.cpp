#include "tests/dst/rig/mission.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>

#include "sim/sim_clock.hpp"
#include "tests/support/temp_folder.hpp"

namespace dst {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration kPersonLooks = 500ms;
constexpr hal::Duration kPersonTriesAgain = 20s;
constexpr hal::Duration kButtonHeld = 300ms;
constexpr hal::Duration kEstopHeld = 1s;
constexpr hal::Duration kObserve = 50ms;

void rethrow(std::exception_ptr error) {
  if (error) std::rethrow_exception(error);
}

// Of this thread: what others do on the machine does not count.
double cpu_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::uint64_t hash_of(const std::filesystem::path& file) {
  std::uint64_t hash = 0xcbf29ce484222325;
  std::ifstream in(file, std::ios::binary);
  for (std::istreambuf_iterator<char> at(in), end; at != end; ++at)
    hash = (hash ^ static_cast<unsigned char>(*at)) * 0x100000001b3;
  return hash;
}

std::vector<std::string> last_lines(const std::filesystem::path& file) {
  constexpr std::size_t kLines = 5;
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line); lines.push_back(line))
    if (lines.size() == kLines) lines.erase(lines.begin());
  return lines;
}

// Something that happens at a time.
struct Happening {
  hal::Duration at{};
  std::function<void()> happens;
};

class Mission {
 public:
  Mission(const support::RandomYard& yard, const Scenario& scenario, const Options& options)
      : scenario_(scenario),
        options_(options),
        prepared_(prepared(yard)),
        rig_(yard, clock_),
        survey_(prepared_, 1, {}, {io_, clock_, rig_.drivers(), store_, progress_, compute_}),
        judge_(clock_, rig_, survey_) {}

  Outcome run();

 private:
  std::vector<Happening> happenings();
  void add_faults(std::vector<Happening>& all);
  void add_presses(std::vector<Happening>& all);
  hal::Task<void> fate();
  hal::Task<void> person();
  hal::Task<void> release();
  hal::Task<void> test_estop();
  hal::Task<void> observe();
  hal::Task<void> tell_minutes();
  void run_to_the_end();
  Outcome outcome();

  const Scenario& scenario_;
  const Options options_;
  boost::asio::io_context io_{1};
  sim::SimClock clock_{io_};
  hal::ComputeHere compute_;
  test::TempFolder folder_;
  mission::RunStore store_ = mission::RunStore::open(folder_.path() / "run").value();
  std::ostringstream told_;
  mission::ProgressPrinter progress_{told_, false};
  mission::Prepared prepared_;
  Rig rig_;
  mission::GuardedSurvey survey_;
  Judge judge_;
  Outcome outcome_;
  int releases_ = 0;  // Since the robot stopped.
};

void Mission::add_faults(std::vector<Happening>& all) {
  for (const DeviceFault& fault : scenario_.faults) {
    sim::UnitFaults& faults = rig_.faults(fault.role);
    all.push_back({fault.from, [&faults, &fault] { faults.set(fault.setting); }});
    if (fault.during < kForEver)
      all.push_back({fault.from + fault.during, [&faults] { faults.clear(); }});
  }
  for (const LinkCut& cut : scenario_.cuts) {
    all.push_back({cut.from, [this, &cut] { rig_.cut_after(cut.role, cut.after); }});
    if (cut.during < kForEver)
      all.push_back({cut.from + cut.during, [this, &cut] { rig_.mend(cut.role); }});
  }
}

void Mission::add_presses(std::vector<Happening>& all) {
  for (const Pressed& pressed : scenario_.presses) {
    all.push_back({pressed.from, [this, &pressed] {
                     rig_.press(pressed.what, true);
                     judge_.on_press(pressed.what);
                   }});
    all.push_back(
        {pressed.from + pressed.during, [this, &pressed] { rig_.press(pressed.what, false); }});
  }
  for (const DateJump& jump : scenario_.jumps)
    all.push_back({jump.from, [this, &jump] { rig_.world().shift_date(jump.days); }});
}

std::vector<Happening> Mission::happenings() {
  std::vector<Happening> all;
  add_faults(all);
  add_presses(all);
  // Power cuts, resumed missions and faults of the disk belong here as well.
  std::ranges::stable_sort(all, {}, &Happening::at);
  return all;
}

hal::Task<void> Mission::fate() {
  const std::vector<Happening> all = happenings();
  for (const Happening& happening : all) {
    co_await clock_.sleep_until(hal::Time(happening.at));
    happening.happens();
  }
}

// Releases the robot when it has been standing stopped for a while and nothing is pressed any more.
hal::Task<void> Mission::person() {
  hal::Time since = clock_.now();
  for (;;) {
    co_await clock_.sleep_for(kPersonLooks);
    const bool stopped = survey_.gate().mode() == mission::Mode::stopped;
    if (!stopped) releases_ = 0;
    if (!stopped || rig_.pressed()) since = clock_.now();
    if (clock_.now() - since < scenario_.releases_after) continue;
    co_await release();
    since = clock_.now() + kPersonTriesAgain - scenario_.releases_after;
  }
}

// By the button or from the console; what did not help once is done the other way. Contacts that
// have contradicted each other are trusted again when they were seen to work.
hal::Task<void> Mission::release() {
  const bool button = scenario_.by_button == (releases_ % 2 == 0);
  if (++releases_ % 3 == 0) co_await test_estop();
  if (button) {
    rig_.press_button(true);
    co_await clock_.sleep_for(kButtonHeld);
    rig_.press_button(false);
    judge_.on_release();
  } else {
    judge_.on_release();
    survey_.gate().ask_release();
  }
}

hal::Task<void> Mission::test_estop() {
  rig_.press(Press::board_estop, true);
  co_await clock_.sleep_for(kEstopHeld);
  rig_.press(Press::board_estop, false);
  co_await clock_.sleep_for(kEstopHeld);
}

hal::Task<void> Mission::observe() {
  co_await clock_.sleep_until(hal::Time(options_.observe_from));
  for (;;) {
    for (const mission::NamedDevice& named : rig_.drivers().devices())
      for (const drivers::Trouble& trouble : named.device->troubles())
        outcome_.named.insert(named.role + ": " + std::string(trouble.fault->name));
    if (const auto stopped = survey_.gate().stopped_by())
      outcome_.named.insert(std::string(mission::entry_of(*stopped).id));
    const auto held_by = survey_.gate().held_by();
    const bool holds = held_by && *held_by != mission::FaultCode::range_stale;
    if (holds) outcome_.named.insert(std::string(mission::entry_of(*held_by).id));
    outcome_.held |=
        holds || survey_.gate().mode() == mission::Mode::stopped || !survey_.watch().well();
    co_await clock_.sleep_for(kObserve);
  }
}

hal::Task<void> Mission::tell_minutes() {
  for (;;) {
    co_await clock_.sleep_for(1min);
    options_.each_minute();
  }
}

void Mission::run_to_the_end() {
  rig_.bus().set_watch(
      [this](const hal::CanFrame& frame, bool to_unit) { judge_.on_frame(frame, to_unit); });
  boost::asio::co_spawn(io_, fate(), rethrow);
  boost::asio::co_spawn(io_, rig_.units().run(), rethrow);
  survey_.start();
  boost::asio::co_spawn(io_, person(), rethrow);
  if (options_.observe) boost::asio::co_spawn(io_, observe(), rethrow);
  if (options_.each_minute) boost::asio::co_spawn(io_, tell_minutes(), rethrow);
  const hal::Time late(options_.ends_within);
  clock_.run([&] {
    judge_.look();
    return judge_.violation() || survey_.ended() || clock_.now() > late;
  });
  judge_.on_end(survey_.ended());
}

Outcome Mission::outcome() {
  (void)store_.finish();
  const mission::RunRecord& record = survey_.survey().record();
  outcome_.completed = record.completed;
  outcome_.end = record.end.empty() ? survey_.failure() : record.end;
  outcome_.notes = survey_.watch().notes();
  outcome_.scans = record.scans.size();
  outcome_.virtual_time = clock_.now().time_since_epoch();
  outcome_.driven_m = rig_.world().driven_m();
  outcome_.decisions_hash = hash_of(folder_.path() / "run" / "decisions.jsonl");
  outcome_.decisions = last_lines(folder_.path() / "run" / "decisions.jsonl");
  outcome_.frames_hash = judge_.frames_hash();
  outcome_.stops = judge_.stops();
  outcome_.slowest_stop = judge_.slowest_stop();
  if (!outcome_.violation) outcome_.violation = judge_.violation();
  return outcome_;
}

Outcome Mission::run() {
  const double began_s = cpu_s();
  try {
    run_to_the_end();
  } catch (const std::exception& error) {
    outcome_.violation = {clock_.now(), "no part of the program ends by itself", error.what()};
  }
  Outcome result = outcome();
  result.cpu_s = cpu_s() - began_s;
  return result;
}

}  // namespace

Outcome run_mission(const support::RandomYard& yard, const Scenario& scenario,
                    const Options& options) {
  return Mission(yard, scenario, options).run();
}

Outcome run_seed(std::uint64_t seed, const Options& options) {
  return run_mission(make_yard(seed), draw_scenario(seed), options);
}

std::string report(std::uint64_t seed, const Violation& violation) {
  return fmt::format(
      "seed {}, t = {:.3f} s: violated: {}\n  seen: {}\n  to see it again: vantage-dst --replay "
      "{}\n",
      seed, hal::seconds(violation.at), violation.invariant, violation.seen, seed);
}

}  // namespace dst
