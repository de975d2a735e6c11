// What became of the robot's position sensors on the way: when one fell silent and when it came
// back, and which satellite fixes the localizer would not follow. Values only.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "hal/values.hpp"
#include "mission/record.hpp"
#include "nav/localizer.hpp"

namespace mission {

struct SensorEvent {
  enum class What { lost, back, refused, reset };
  hal::Time at{};
  std::string_view sensor;  // "IMU", "satellites"
  What what{};
  double for_s{};         // How long it was away, or fixes were refused.
  std::uint64_t count{};  // Fixes refused in a row.
};
std::string_view name(SensorEvent::What what);

class SensorLog {
 public:
  enum class Sensor { imu, gnss };
  static constexpr hal::Duration kSilence = std::chrono::seconds(3);  // Longer is a loss.
  static constexpr int kStreak = 10;               // Refused fixes in a row that are worth a word.
  static constexpr std::size_t kEventsMax = 1000;  // Between two take(); then the newest are lost.

  explicit SensorLog(hal::Time now);

  void heard(Sensor sensor, hal::Time now);
  void judged(nav::Gate gate, hal::Time now);  // Of a fix.
  // What happened since it was last asked, in order; a sensor that is silent now is lost.
  std::vector<SensorEvent> take(hal::Time now);

  const GnssCounts& gnss() const { return gnss_; }
  // So far, losses that last included.
  double silent_s(Sensor sensor, hal::Time now) const;
  int losses(Sensor sensor) const { return of(sensor).losses; }

 private:
  struct State {
    hal::Time heard{};
    bool lost{};
    int losses{};
    double silent_s{};
  };
  State& of(Sensor sensor) { return states_[static_cast<std::size_t>(sensor)]; }
  const State& of(Sensor sensor) const { return states_[static_cast<std::size_t>(sensor)]; }
  void note_silence(Sensor sensor, hal::Time now);
  void end_streak(hal::Time now);
  void add(const SensorEvent& event);

  std::array<State, 2> states_;
  GnssCounts gnss_;
  std::uint64_t refused_in_row_{};
  hal::Time refused_since_{};
  std::vector<SensorEvent> events_;
};

}  // namespace mission
