#include "mission/sensor_log.hpp"

#include <utility>

namespace mission {
namespace {

std::string_view name_of(SensorLog::Sensor sensor) {
  return sensor == SensorLog::Sensor::imu ? "IMU" : "satellites";
}

}  // namespace

std::string_view name(SensorEvent::What what) {
  switch (what) {
    case SensorEvent::What::lost:
      return "lost";
    case SensorEvent::What::back:
      return "back";
    case SensorEvent::What::refused:
      return "refused";
    case SensorEvent::What::reset:
      break;
  }
  return "reset";
}

SensorLog::SensorLog(hal::Time now) : states_{State{now}, State{now}} {}

void SensorLog::add(const SensorEvent& event) {
  if (events_.size() < kEventsMax) events_.push_back(event);
}

void SensorLog::note_silence(Sensor sensor, hal::Time now) {
  State& state = of(sensor);
  if (state.lost || now - state.heard <= kSilence) return;
  state.lost = true;
  ++state.losses;
  add({state.heard + kSilence, name_of(sensor), SensorEvent::What::lost, 0, 0});
}

void SensorLog::heard(Sensor sensor, hal::Time now) {
  note_silence(sensor, now);
  State& state = of(sensor);
  if (state.lost) {
    const double away_s = hal::seconds(now - state.heard);
    state.silent_s += away_s;
    state.lost = false;
    add({now, name_of(sensor), SensorEvent::What::back, away_s, 0});
  }
  state.heard = now;
}

void SensorLog::end_streak(hal::Time now) {
  if (refused_in_row_ >= kStreak)
    add({now, name_of(Sensor::gnss), SensorEvent::What::refused, hal::seconds(now - refused_since_),
         refused_in_row_});
  refused_in_row_ = 0;
}

void SensorLog::judged(nav::Gate gate, hal::Time now) {
  ++gnss_.fixes;
  if (gate == nav::Gate::rejected) {
    ++gnss_.refused;
    if (refused_in_row_++ == 0) refused_since_ = now;
    return;
  }
  end_streak(now);
  if (gate != nav::Gate::reset) return;
  ++gnss_.resets;
  add({now, name_of(Sensor::gnss), SensorEvent::What::reset, 0, 0});
}

std::vector<SensorEvent> SensorLog::take(hal::Time now) {
  note_silence(Sensor::imu, now);
  note_silence(Sensor::gnss, now);
  return std::exchange(events_, {});
}

double SensorLog::silent_s(Sensor sensor, hal::Time now) const {
  const State& state = of(sensor);
  const bool silent = now - state.heard > kSilence;
  return state.silent_s + (silent ? hal::seconds(now - state.heard) : 0);
}

}  // namespace mission
