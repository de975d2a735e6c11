// Which parts of the program must go on, and whether they do: who feeds a watchdog asks here first.
// Pure: time is handed in.
#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <string_view>

#include "hal/values.hpp"

namespace mission {

// Tasks are added before anybody else has it; the rest may be called from any thread, and neither
// allocates nor waits.
class Heartbeat {
 public:
  static constexpr std::size_t kTasksMax = 16;
  enum class Task : std::size_t {};
  struct Late {
    std::string_view name;
    hal::Duration by{};  // Since it was due.
  };

  // Rests until its first tick. `name` must outlive it, `deadline` is positive. At most kTasksMax.
  Task add(std::string_view name, hal::Duration deadline);
  // It goes on, and will be heard again within its deadline.
  void tick(Task task, hal::Time now);
  // It begins something that takes longer, but no longer than `bound`.
  void expect(Task task, hal::Time now, hal::Duration bound);
  // It waits for what may never come, such as a person: not due until its next tick.
  void rest(Task task);

  // Who has been due for the longest time; nothing: all go on.
  std::optional<Late> late(hal::Time now) const;

 private:
  struct Entry {
    std::string_view name;
    hal::Duration deadline{};
    std::atomic<hal::Time> due{hal::Time::max()};
  };
  std::array<Entry, kTasksMax> entries_;
  std::size_t tasks_ = 0;
};

}  // namespace mission
