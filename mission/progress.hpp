// What a person at the terminal sees while a mission runs.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>

namespace mission {

struct Progress {
  std::string phase;  // "Phase I", "Phase II", "driving home"
  int station{};      // k of n; 0: not at a station yet
  int stations{};     // 0: how many is not known (Phase II)
  std::string area;
  std::optional<double> coverage;  // Of the coverable wall, 0 to 1.
  std::uint64_t seen_occupied{};   // Voxels; 0 is not shown.
  double mission_s{};
  std::optional<double> eta_s;  // Time left, on the mission's clock.
};

inline constexpr std::size_t kProgressColumns = 79;  // One short of 80: no terminal wraps it.

// "Phase I  12/26 inner  cover 63.2 %  occupied 45,231  3:12:40  left 4:02:10", at most
// kProgressColumns wide: where it would be longer the area's name is shortened.
std::string progress_line(const Progress& progress);

// 3:12:40, 12:40, 0:07; days as 2d 03:12:40.
std::string duration_text(double span_s);

// 45,231
std::string count_text(std::uint64_t count);

// The first `columns` characters of UTF-8 text, with ".." at the end where something was cut.
std::string shortened(std::string_view text, std::size_t columns);

// On a terminal one line that is written over and over; elsewhere one line per call. Messages
// always get lines of their own.
class ProgressPrinter {
 public:
  ProgressPrinter(std::ostream& out, bool is_terminal) : out_(out), is_terminal_(is_terminal) {}
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;
  virtual ~ProgressPrinter() { finish(); }

  virtual void show(const Progress& progress);
  virtual void message(std::string_view text);
  // Leaves the last line standing. Called again: nothing.
  void finish();

 private:
  std::ostream& out_;
  bool is_terminal_;
  std::string line_;  // What stands on the terminal's last line, or was printed last.
};

}  // namespace mission
