// How a survey waits for a disk that does not take what it has to keep: nothing counts that is not
// durable, and the robot stands until it is.
#include <fmt/format.h>

#include "mission/survey.hpp"

namespace mission {
namespace {

constexpr hal::Duration kTryAgain = std::chrono::seconds(2);
constexpr hal::Duration kLook = std::chrono::milliseconds(500);

}  // namespace

// Does the work, again and again while the disk is what fails it. What is damaged stays so.
hal::Task<void> Survey::until_written(std::function<void()> work) {
  for (;;) {
    std::optional<FileError> why;
    const std::function<void()> attempt = [&] {
      try {
        work();
      } catch (const FileFailure& failure) {
        why = failure.error();
      }
    };
    co_await parts_.compute.run(attempt);
    if (!why) break;
    if (why->code == boost::system::errc::bad_message) throw FileFailure(*why);
    note_disk(DiskWatch::Part::files, &*why);
    co_await parts_.clock.sleep_for(kTryAgain);
  }
  note_disk(DiskWatch::Part::files, nullptr);
}

// Before whatever comes next.
hal::Task<void> Survey::until_decided() {
  if (parts_.store.all_decided() || goes_home_for_disk()) co_return;
  const std::function<void()> work = [this] { parts_.store.write_decisions().value(); };
  co_await until_written(work);
}

// Null: it works.
void Survey::note_disk(DiskWatch::Part part, const FileError* why) {
  const hal::Time now = parts_.clock.now();
  if (why != nullptr && disk_.failed(part, *why, now))
    say_disk(disk_.text() + (goes_home_for_disk() ? "; the robot goes home for its disk"
                                                  : "; the robot stands until the disk takes it"));
  if (why == nullptr && disk_.works(part))
    say_disk(fmt::format("the disk works again after {:.0f} s: {}", hal::seconds(disk_.lasted(now)),
                         goes_home_for_disk() ? "the robot goes home anyway; the run can be resumed"
                                              : "the mission goes on"));
}

void Survey::say_disk(const std::string& what) {
  tell(what);
  record_.notes.push_back(what);
}

// The journal tries again by itself. Ends only by cancellation, or when nobody waits any more.
hal::Task<void> Survey::watch_disk() {
  for (;;) {
    co_await parts_.clock.sleep_for(kLook);
    if (parts_.journal != nullptr)
      note_disk(DiskWatch::Part::journal,
                parts_.journal->trouble() ? &*parts_.journal->trouble() : nullptr);
    heed_disk();
  }
}

void Survey::heed_disk() {
  switch (disk_.answer(parts_.clock.now())) {
    case DiskWatch::Answer::goes_on:
    case DiskWatch::Answer::stands:
      return;
    case DiskWatch::Answer::ends:
      throw CannotGoOn(disk_.text());
    case DiskWatch::Answer::goes_home:
      break;
  }
  if (goes_home_for_disk()) return;
  disk_why_ = fmt::format("{}: for more than patience_s = {:.0f} s {}",
                          entry_of(FaultCode::disk_given_up).id, hal::seconds(disk_.patience()),
                          disk_.text());
  disk_.go_home();
  say_disk(disk_why_ + "; the robot goes home");
  sent_home_.notify();
}

hal::Task<void> Survey::until_sent_home() {
  while (!goes_home_for_disk()) co_await sent_home_.wait();
}

// Nothing on the way needs the disk: decisions and events wait in memory for it.
hal::Task<void> Survey::home_without_disk() {
  orders_.goes_home("sent home by its disk");
  co_await pilot_.abandon();
  decide({{"t_s", now_s()}, {"decision", "home"}, {"reason", disk_why_}});
  std::string why_not_there;
  co_await hal::first_of(wait_at_home(why_not_there), try_disk());
  const double before_m = parts_.past != nullptr ? parts_.past->so_far.driven_m : 0;
  record_.driven_total_m = before_m + pilot_.travelled_m();  // With the way that was broken off.
  throw CannotGoOn(fmt::format("{}; the robot {}; {}", disk_why_,
                               why_not_there.empty() ? "went home and is at its start"
                                                     : "did not come home: " + why_not_there,
                               disk_.well()
                                   ? "the disk works again, and the run can be resumed"
                                   : "the disk still fails: what it did not take is not counted"));
}

// A disk that works again meanwhile, as when a person makes room on it, takes what waits.
hal::Task<void> Survey::wait_at_home(std::string& why_not_there) {
  try {
    const bool there = co_await go_home(true);
    if (!there) why_not_there = record_.dropped.back().reason;
  } catch (const CannotGoOn& why) {
    why_not_there = why.what();
  }
  const hal::Time until = parts_.clock.now() + disk_.patience();
  while (!disk_.well() && parts_.clock.now() < until) co_await parts_.clock.sleep_for(kLook);
}

// Not by `compute`: the way home decides meanwhile. Ends only by cancellation.
hal::Task<void> Survey::try_disk() {
  for (;;) {
    std::optional<FileError> why;
    try {
      parts_.store.write_decisions().value();
      look_for_room();
    } catch (const FileFailure& failure) {
      why = failure.error();
    }
    note_disk(DiskWatch::Part::files, why ? &*why : nullptr);
    co_await parts_.clock.sleep_for(kTryAgain);
  }
}

// The one that was being kept when the disk sent the robot home. Resumed, the run takes it again.
void Survey::uncount_last_scan(bool journal_is_whole) {
  if (!goes_home_for_disk() || !keeps_scan_ || (told_scan_ && journal_is_whole)) return;
  record_.notes.push_back(fmt::format("scan {} ({}) is not counted: the journal did not take it",
                                      record_.scans.back().number, record_.scans.back().name));
  record_.scans.pop_back();
  beams_checksums_.pop_back();
}

}  // namespace mission
