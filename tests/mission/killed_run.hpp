// Runs that are cut off: in a process of their own, killed when a file is opened.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <functional>
#include <string>

#include "mission/files.hpp"
#include "mission/main_run.hpp"

namespace mission_test {

// Kills the program when it first opens a file whose name ends so.
class Killer final : public mission::FileCalls {
 public:
  explicit Killer(std::string name) : name_(std::move(name)) {}
  int open(const char* path, int flags, unsigned mode) override {
    if (std::string_view(path).ends_with(name_)) raise(SIGKILL);
    return FileCalls::open(path, flags, mode);
  }

 private:
  const std::string name_;
};

// False: it ended before.
inline bool killed_at_file(const std::string& name,
                           const std::function<mission::RunOutcome()>& run) {
  const pid_t child = fork();
  if (child == 0) {
    static Killer killer(name);
    mission::set_file_calls(&killer);
    try {
      _exit(run().failure.empty() ? 0 : 1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      _exit(2);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0) << WEXITSTATUS(status);
  return WIFSIGNALED(status);
}

}  // namespace mission_test
