// What keeps the gate on time on a busy machine, where the machine permits it. Like main.cpp it may
// know everything.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace mission {

// Memory that the program gives back stays with it for what it takes next, up to 2 GB, blocks of
// any size on the main thread: scans come and go by a hundred megabytes, and to fault their pages
// in anew takes longer than to fill them (a quarter of a simulated mission). At the start.
void keep_memory();

// No page that the program has used leaves memory again. Empty: done; else why not.
std::string lock_memory();

// The calling thread runs before every ordinary one (SCHED_FIFO, the lowest of its priorities);
// threads that it makes do not. Empty: done; else why not.
std::string run_first();

// Of a process, in kB. Nothing: there is none, or it cannot be seen.
struct MemoryUse {
  long resident_kb{}, peak_kb{}, locked_kb{};
};
std::optional<MemoryUse> memory_use(pid_t process);
std::string text_of(const MemoryUse& use);  // "23.4 MB resident, 30.1 MB at most, 0.0 MB locked"

}  // namespace mission
