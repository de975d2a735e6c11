#include "mission/heartbeat.hpp"

#include <cassert>

namespace mission {

Heartbeat::Task Heartbeat::add(std::string_view name, hal::Duration deadline) {
  assert(tasks_ < kTasksMax && deadline > hal::Duration{});
  entries_[tasks_].name = name;
  entries_[tasks_].deadline = deadline;
  return Task(tasks_++);
}

void Heartbeat::tick(Task task, hal::Time now) {
  expect(task, now, entries_[static_cast<std::size_t>(task)].deadline);
}

void Heartbeat::expect(Task task, hal::Time now, hal::Duration bound) {
  entries_[static_cast<std::size_t>(task)].due.store(now + bound, std::memory_order_relaxed);
}

void Heartbeat::rest(Task task) {
  entries_[static_cast<std::size_t>(task)].due.store(hal::Time::max(), std::memory_order_relaxed);
}

std::optional<Heartbeat::Late> Heartbeat::late(hal::Time now) const {
  std::optional<Late> latest;
  for (std::size_t i = 0; i < tasks_; ++i) {
    const hal::Time due = entries_[i].due.load(std::memory_order_relaxed);
    if (now <= due) continue;
    if (!latest || now - due > latest->by) latest = Late{entries_[i].name, now - due};
  }
  return latest;
}

}  // namespace mission
