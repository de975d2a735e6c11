#include "mission/main_realtime.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <climits>
#include <cstring>
#include <fstream>

namespace mission {
namespace {

std::string because(const char* what, const char* permitted_by) {
  const int error = errno;
  return fmt::format("{}: {}{}", what, std::strerror(error),
                     error == EPERM || error == ENOMEM || error == EAGAIN
                         ? fmt::format(" ({} permits it)", permitted_by)
                         : "");
}

}  // namespace

void keep_memory() {
  ::mallopt(M_MMAP_MAX, 0);  // Such blocks go back to the system at once.
  ::mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

// As it is first used: a survey reserves far more than it ever touches.
std::string lock_memory() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) return "";
  return because("memory is not locked", "LimitMEMLOCK=infinity");
}

std::string run_first() {
  sched_param priority{};
  priority.sched_priority = sched_get_priority_min(SCHED_FIFO);
  if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) == 0) return "";
  return because("the event loop has no real-time priority", "LimitRTPRIO=1");
}

std::optional<MemoryUse> memory_use(pid_t process) {
  std::ifstream status(fmt::format("/proc/{}/status", process));
  MemoryUse use;
  bool found = false;
  for (std::string key; status >> key; status.ignore(256, '\n')) {
    if (key == "VmRSS:") found = static_cast<bool>(status >> use.resident_kb);
    if (key == "VmHWM:") status >> use.peak_kb;
    if (key == "VmLck:") status >> use.locked_kb;
  }
  return found ? std::optional(use) : std::nullopt;
}

std::string text_of(const MemoryUse& use) {
  const auto mb = [](long kb) { return static_cast<double>(kb) / 1024; };
  return fmt::format("{:.1f} MB resident, {:.1f} MB at most, {:.1f} MB locked", mb(use.resident_kb),
                     mb(use.peak_kb), mb(use.locked_kb));
}

}  // namespace mission
