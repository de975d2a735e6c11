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
  if (parts_.store.all_decided()) co_return;
  const std::function<void()> work = [this] { parts_.store.write_decisions().value(); };
  co_await until_written(work);
}

// Null: it works.
void Survey::note_disk(DiskWatch::Part part, const FileError* why) {
  const hal::Time now = parts_.clock.now();
  if (why != nullptr && disk_.failed(part, *why, now))
    say_disk(fmt::format("{}; the robot stands until the disk takes it", disk_.text()));
  if (why == nullptr && disk_.works(part))
    say_disk(fmt::format("the disk works again after {:.0f} s: the mission goes on",
                         hal::seconds(disk_.lasted(now))));
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
    if (disk_.given_up(parts_.clock.now())) throw CannotGoOn(disk_.text());
  }
}

}  // namespace mission
