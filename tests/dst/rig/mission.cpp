#include "tests/dst/rig/mission.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

#include "mission/resume.hpp"
#include "sim/sim_clock.hpp"
#include "tests/dst/rig/disk.hpp"
#include "tests/dst/rig/operator.hpp"
#include "tests/dst/rig/wall_clock.hpp"
#include "tests/support/temp_folder.hpp"

namespace dst {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

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

// FNV-1a of 64 bits.
std::uint64_t hashed(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325) {
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
  return hash;
}

std::uint64_t hash_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  return hashed(bytes);
}

std::uint64_t hash_of(const std::vector<mission::JournalEvent>& events) {
  std::uint64_t hash = hashed("");
  for (const mission::JournalEvent& event : events)
    hash = hashed(fmt::format("{} {} {} {}\n", event.number, event.at.time_since_epoch().count(),
                              event.kind, event.text),
                  hash);
  return hash;
}

// Of a run that nobody has open. Throws what says why it cannot be read.
std::vector<mission::JournalEvent> events_in(const fs::path& run) {
  return mission::JournalFile::open(run / mission::RunStore::kJournalName).value().read().value();
}

mission::RunHistory history_in(const fs::path& run) {
  return mission::read_history(events_in(run), run / mission::RunStore::kJournalName).value();
}

// By their checksums: these very measurements.
std::vector<std::uint64_t> scans_in(const fs::path& run) {
  std::vector<std::uint64_t> all;
  if (!fs::exists(run / mission::RunStore::kJournalName)) return all;
  for (const mission::ScanDone* scan : history_in(run).scans()) all.push_back(scan->beams_checksum);
  return all;
}

bool begins_with(const std::vector<std::uint64_t>& all, const std::vector<std::uint64_t>& first) {
  return all.size() >= first.size() && std::equal(first.begin(), first.end(), all.begin());
}

std::vector<std::string> last_lines(const fs::path& file) {
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

// A run's folder and what is known of it.
struct Run {
  mission::RunStore store;
  mission::JournalFile journal;
  std::optional<mission::RunHistory> past;
};

void write_event(mission::JournalFile& journal, mission::EventText event) {
  std::vector<mission::JournalEvent> one{{0, {}, std::move(event.kind), std::move(event.text)}};
  journal.append(one).value();
}

Run begin_run(const fs::path& folder) {
  Run run{mission::RunStore::open(folder).value(),
          mission::JournalFile::open(folder / mission::RunStore::kJournalName).value(),
          {}};
  write_event(run.journal, mission::event_of(mission::RunBegun{"random", "dst", {}}));
  return run;
}

// As the program does it on a robot.
Run take_up_run(const fs::path& folder, bool at_start) {
  mission::RunHistory history = history_in(folder);
  if (at_start) history.stands_at_start();
  const std::optional<int> lost = mission::verify_scans(history, folder).value();
  Run run{mission::RunStore::go_on(folder).value(),
          mission::JournalFile::open(folder / mission::RunStore::kJournalName).value(),
          {}};
  write_event(run.journal, mission::event_of(mission::RunResumed{history.why_ended(), lost}));
  ++history.resumed;
  run.past = std::move(history);
  return run;
}

mission::Prepared prepared_for(const support::RandomYard& yard, const Scenario& scenario) {
  mission::Prepared ready = prepared(yard);
  if (scenario.disk && scenario.disk->sends_home) ready.config.disk.then = "home";
  return ready;
}

// Where the robot stands, and in which folder its run is.
struct Begin {
  hal::Pose2 stands;
  fs::path folder;
  bool after_cut = false;  // Of the power, or of a run that ended with its disk.
  bool goes_on = false;
  bool at_start = false;             // And the person who goes on with it sees the robot there.
  fs::path flushed = {}, next = {};  // Where the disk's states after a cut are made.
};

class Mission {
 public:
  Mission(const support::RandomYard& yard, const Scenario& scenario, const Options& options,
          const Begin& begin)
      : scenario_(scenario),
        options_(options),
        begin_(begin),
        disk_(begin.folder),
        run_(begin.goes_on ? take_up_run(begin.folder, begin.at_start) : begin_run(begin.folder)),
        journal_(std::move(run_.journal), clock_, compute_),
        prepared_(prepared_for(yard, scenario)),
        rig_(yard, clock_, begin.stands),
        survey_(prepared_, 1, config(begin),
                {loop_.get_executor(), clock_, rig_.drivers(), run_.store, progress_, compute_,
                 &journal_, run_.past ? &*run_.past : nullptr}),
        judge_(clock_, rig_, survey_, begin.after_cut) {
    if (scenario.at_console)
      operator_ = std::make_unique<OperatorAtConsole>(
          *scenario.at_console,
          OperatorAtConsole::Parts{loop_.get_executor(), clock_, compute_, survey_, rig_.drivers(),
                                   judge_},
          begin.folder.parent_path());
  }

  Outcome run();
  const Disk& disk() const { return disk_; }
  hal::Pose2 stands() { return rig_.world().robot().pose; }

 private:
  mission::GuardedSurvey::Config config(const Begin& begin);
  bool stands_for_a_person();
  std::vector<Happening> happenings();
  void add_computer(std::vector<Happening>& all);
  bool loses_power();
  void lose_power();
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
  const Begin begin_;
  sim::EventLoop loop_;
  sim::SimClock clock_{loop_};
  WallClock wall_clock_;
  Disk disk_;
  ComputeOnDisk compute_{disk_, clock_};
  Run run_;
  mission::Journal journal_;
  std::ostringstream told_;
  mission::ProgressPrinter progress_{told_, false};
  mission::Prepared prepared_;
  Rig rig_;
  mission::GuardedSurvey survey_;
  Judge judge_;
  std::unique_ptr<OperatorAtConsole> operator_;  // Null: nobody is there.
  Outcome outcome_;
  int releases_ = 0;  // Since the robot stopped.
  int steps_ = 0;     // Since the time of the power cut.
  bool cut_ = false;
};

mission::GuardedSurvey::Config Mission::config(const Begin& begin) {
  mission::GuardedSurvey::Config config;
  if (begin.after_cut) config.boot = mission::Boot::power_cut;
  config.watch.tell = [this](const std::string& what) {
    if (operator_) operator_->tell(what);
  };
  return config;
}

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

void Mission::add_computer(std::vector<Happening>& all) {
  for (const ClockJump& jump : scenario_.clock_jumps)
    all.push_back({jump.from, [this, &jump] { wall_clock_.jump(jump.by); }});
  if (!scenario_.disk) return;
  const DiskTrouble& trouble = *scenario_.disk;
  all.push_back({trouble.from, [this, &trouble] { disk_.set(trouble.fault); }});
  all.push_back({trouble.from + trouble.during, [this] { disk_.mend(); }});
}

// Counted in steps, so that it comes in the middle of anything.
bool Mission::loses_power() {
  if (!scenario_.power_cut || clock_.now() < hal::Time(scenario_.power_cut->from)) return false;
  return cut_ = steps_++ >= scenario_.power_cut->steps;
}

std::vector<Happening> Mission::happenings() {
  std::vector<Happening> all;
  add_faults(all);
  add_presses(all);
  add_computer(all);
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

// Stopped, or told to stand by somebody at the console.
bool Mission::stands_for_a_person() {
  const mission::GatedDrive& gate = survey_.gate();
  return gate.mode() == mission::Mode::stopped || (operator_ && gate.begun() && !gate.released());
}

// Releases the robot when it has been standing stopped for a while and nothing is pressed any more.
hal::Task<void> Mission::person() {
  hal::Time since = clock_.now();
  for (;;) {
    co_await clock_.sleep_for(kPersonLooks);
    const bool stopped = stands_for_a_person();
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
    if (survey_.survey().goes_home_for_disk() && survey_.gate().mode() == mission::Mode::returning)
      outcome_.named.insert(std::string(mission::entry_of(mission::FaultCode::disk_given_up).id));
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
  boost::asio::co_spawn(loop_.get_executor(), fate(), rethrow);
  boost::asio::co_spawn(loop_.get_executor(), rig_.units().run(), rethrow);
  survey_.start();
  boost::asio::co_spawn(loop_.get_executor(), person(), rethrow);
  if (operator_) operator_->begin();
  if (options_.observe) boost::asio::co_spawn(loop_.get_executor(), observe(), rethrow);
  if (options_.each_minute) boost::asio::co_spawn(loop_.get_executor(), tell_minutes(), rethrow);
  const hal::Time late(options_.ends_within);
  clock_.run([&] {
    judge_.look();
    return judge_.violation() || survey_.ended() || clock_.now() > late || loses_power();
  });
  if (!cut_) judge_.on_end(survey_.ended());
}

Outcome Mission::outcome() {
  if (!cut_) (void)run_.store.finish();
  const mission::RunRecord& record = survey_.survey().record();
  outcome_.completed = record.completed;
  outcome_.end = record.end.empty() ? survey_.failure() : record.end;
  outcome_.notes = survey_.watch().notes();
  outcome_.scans = record.scans.size();
  outcome_.virtual_time = clock_.now().time_since_epoch();
  outcome_.driven_m = rig_.world().driven_m();
  outcome_.from_start_m = (stands().position_m - begin_.stands.position_m).norm();
  outcome_.decisions_hash = hash_of(begin_.folder / "decisions.jsonl");
  outcome_.decisions = last_lines(begin_.folder / "decisions.jsonl");
  outcome_.frames_hash = judge_.frames_hash();
  if (operator_) outcome_.console_hash = operator_->hash();
  if (operator_) outcome_.password_set = operator_->password_set();
  outcome_.stops = judge_.stops();
  outcome_.slowest_stop = judge_.slowest_stop();
  if (!outcome_.violation) outcome_.violation = judge_.violation();
  return outcome_;
}

Outcome Mission::run() {
  const double began_s = cpu_s();
  Outcome result;
  try {
    run_to_the_end();
    result = outcome();
    if (cut_) lose_power();
  } catch (const std::exception& error) {
    outcome_.violation = {clock_.now(), "no part of the program ends by itself", error.what()};
    result = outcome();
  }
  result.cpu_s = cpu_s() - began_s;
  return result;
}

// What the disk has now is all that the next start finds. The program then ends in its own way, so
// that everything that waits in it lets go; nobody sees that any more.
void Mission::lose_power() {
  disk_.copy_flushed(begin_.flushed);
  disk_.copy_cut(scenario_.seed, begin_.next);
  disk_.mend();
  survey_.stop("the power was cut");
  clock_.run([&] { return survey_.ended(); });
}

// What one leg of a run left.
struct Left {
  Outcome outcome;
  hal::Pose2 stands;
};

// Scans that count, and would be gone with the power.
std::optional<Violation> not_durable(std::size_t safe, const Outcome& outcome) {
  if (safe == outcome.scans) return std::nullopt;
  return Violation{hal::Time(outcome.virtual_time), "no scan counts that is not durable",
                   fmt::format("{} count, {} are flushed", outcome.scans, safe)};
}

Left run_leg(const support::RandomYard& yard, const Scenario& scenario, const Options& options,
             const Begin& begin) {
  Mission mission(yard, scenario, options, begin);
  Outcome outcome = mission.run();
  if (!begin.after_cut && outcome.end.starts_with("F70")) {  // The disk ended it.
    mission.disk().copy_flushed(begin.flushed);
    mission.disk().copy(begin.next);
  }
  if (outcome.completed && scenario.disk && !outcome.violation) {
    mission.disk().copy_flushed(begin.flushed);
    outcome.violation = not_durable(scans_in(begin.flushed).size(), outcome);
  }
  return {outcome, mission.stands()};
}

void add(Outcome& sum, const Outcome& next) {
  const Outcome first = std::exchange(sum, next);
  sum.virtual_time += first.virtual_time;
  sum.cpu_s += first.cpu_s;
  sum.driven_m += first.driven_m;
  sum.stops += first.stops;
  sum.slowest_stop = std::max(sum.slowest_stop, first.slowest_stop);
  sum.decisions_hash ^= first.decisions_hash * 3;
  sum.frames_hash ^= first.frames_hash * 3;
  sum.journal_hash ^= first.journal_hash * 3;
  sum.console_hash ^= first.console_hash * 3;
  sum.named.insert(first.named.begin(), first.named.end());
  sum.held |= first.held;
  sum.password_set |= first.password_set;
  sum.resumed = first.resumed + 1;
}

// What going on must keep; empty: it did.
std::string lost_or_repeated(const fs::path& run, const std::vector<std::uint64_t>& safe) {
  std::multiset<std::string> names;
  std::vector<std::uint64_t> scans;
  for (const mission::ScanDone* scan : history_in(run).scans()) {
    scans.push_back(scan->beams_checksum);
    names.insert(scan->scan.area + "/" + scan->scan.name);
  }
  if (!begins_with(scans, safe))
    return fmt::format("{} scans were safe; of the run's {} not all are those", safe.size(),
                       scans.size());
  for (const std::string& name : names)
    if (names.count(name) > 1) return name + " has two scans";
  return "";
}

// A person goes on where power or disk ended it, with devices that are well and a disk that is. The
// power may be cut once more.
void go_on(const support::RandomYard& yard, const Scenario& scenario, const Options& options,
           const Begin& before, const Left& left, Outcome& outcome) {
  const std::vector<std::uint64_t> safe = scans_in(before.flushed), there = scans_in(before.next);
  if (!begins_with(there, safe)) {
    outcome.violation = {hal::Time(outcome.virtual_time), "every acknowledged scan is kept",
                         fmt::format("{} of {} are there", there.size(), safe.size())};
    return;
  }
  if (left.outcome.end.starts_with("F704"))  // Until its end it knew what was saved.
    outcome.violation = not_durable(safe.size(), left.outcome);
  if (outcome.violation) return;
  Scenario well;
  well.seed = scenario.seed;
  well.releases_after = scenario.releases_after;
  well.by_button = scenario.by_button;
  well.power_cut = scenario.cut_again;
  const auto again = [](fs::path path) { return path += "+"; };
  const Begin begin{left.stands,
                    there.empty() ? again(before.folder) : before.next,
                    true,
                    !there.empty(),
                    left.outcome.end.find("is at its start") != std::string::npos,
                    again(before.flushed),
                    again(before.next)};
  const Left second = run_leg(yard, well, options, begin);
  add(outcome, second.outcome);
  outcome.journal_hash ^= hash_of(events_in(begin.folder));
  if (const std::string wrong = lost_or_repeated(begin.folder, safe);
      !wrong.empty() && !outcome.violation)
    outcome.violation = {hal::Time(outcome.virtual_time),
                         "every acknowledged scan is kept, and none is taken again", wrong};
  if (!outcome.violation && fs::exists(begin.next))
    go_on(yard, well, options, begin, second, outcome);
}

}  // namespace

Outcome run_mission(const support::RandomYard& yard, const Scenario& scenario,
                    const Options& options) {
  const test::TempFolder folder;
  const Begin begin{.stands = yard.tasks.start,
                    .folder = folder.path() / "run",
                    .flushed = folder.path() / "flushed",
                    .next = folder.path() / "next"};
  const Left left = run_leg(yard, scenario, options, begin);
  Outcome outcome = left.outcome;
  outcome.journal_hash = hash_of(events_in(begin.folder));
  if (outcome.violation || !fs::exists(begin.next)) return outcome;
  try {
    go_on(yard, scenario, options, begin, left, outcome);
  } catch (const std::exception& error) {
    outcome.violation = {hal::Time(outcome.virtual_time), "a run that was cut can be gone on with",
                         error.what()};
  }
  return outcome;
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
