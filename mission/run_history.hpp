// What a run's journal says, event by event and as a whole: all that going on after a cut needs.
// Values only. The same run writes the same text.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "mission/energy.hpp"
#include "mission/journal.hpp"
#include "mission/record.hpp"
#include "mission/scan_registrar.hpp"
#include "mission/site_model.hpp"

namespace mission {

// What a run was made from: to be the same when it goes on.
struct RunInput {
  std::string what;  // "robot file robot.toml", "seed"
  std::uint64_t checksum{};
};

struct RunBegun {
  std::string mission;
  std::string backend;  // "sim", "hardware"
  std::vector<RunInput> inputs;
};

struct RunPlanned {
  std::vector<std::pair<std::string, std::string>> stations;  // Area and name, as toured.
  std::uint64_t checksum{};                                   // Of where they stand.
};

// Where the robot is.
struct Whereabouts {
  hal::Pose2 believed;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  std::optional<hal::Pose2> truth;  // In simulation.
  double ground_z_m{};              // Of the truth.
};

// What a run has come to at an event.
struct SoFar {
  double mission_s{};
  EnergyTimes spent;
  int energy_scans{};
  double driven_m{};
  MovingFacts moving;
  RegistrationCounts registration;
};

struct LegDone {
  std::string to;
  bool arrived{};
  std::vector<Eigen::Vector2d> track_m, touched_m;  // As LegEnd.
  SoFar so_far;
  Whereabouts where;
};

struct ScanDone {
  ScanRecord scan;  // Its truth too.
  std::uint64_t beams_checksum{};
  std::optional<NextView> view;    // Phase II.
  std::uint64_t visible_before{};  // visible_to_next of the scan before it.
  std::optional<RegistrarChange> registered;
  SoFar so_far;
  Whereabouts where;
};

struct TourClosed {
  struct Scan {
    int number{};
    hal::Pose2 believed;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  int scans{};              // That were there.
  bool moved{};             // The map was filled anew from these poses.
  std::vector<Scan> poses;  // Where it moved.
  std::optional<RegistrarState> registrar;
  SoFar so_far;
};

struct StationDropped {
  DroppedStation station;
  std::optional<NextView> view;  // Phase II.
};

// Next best views to which no road led.
struct ViewsLeftOut {
  std::vector<NextView> views;
  bool closed_for_now{};  // Roads were, and are open when the run goes on.
};

// Stations in place of one that was dropped; they are then stations of the plan as all others.
struct StationReplaced {
  struct Station {
    std::string name;
    hal::Pose2 at;  // On the 1 mm grid.
    double adds_m{}, overlaps_m{};
  };
  std::string area, name;  // Of the one that was dropped.
  double lost_m{}, left_m{};
  std::vector<Station> stations;
};

struct RunEnded {
  bool completed{};
  std::string reason;
};

// Somebody went on with the run.
struct RunResumed {
  std::string after;             // Why it had ended.
  std::optional<int> scan_lost;  // Damaged: taken again. Always the last.
};

using RunStep =
    std::variant<LegDone, ScanDone, TourClosed, StationDropped, StationReplaced, ViewsLeftOut>;

struct RunHistory {
  std::optional<RunBegun> begun;
  std::optional<RunPlanned> planned;
  std::vector<RunStep> steps;
  SoFar so_far;
  std::optional<Whereabouts> where;  // Last known,
  bool left{};                       // and since then it has been driving.
  std::optional<RunEnded> ended;     // Since it last went on.
  bool products{};                   // Report, map and cloud were written after that.
  std::string last_stop;             // What last stopped the robot.
  int resumed{};

  std::vector<const ScanDone*> scans() const;
  // Drops the last scan, and what rests on it.
  void lose_last_scan();
  // A person saw the robot at its start, wherever it was last known.
  void stands_at_start();
  bool finished() const { return ended && ended->completed && products; }
  // "the program was cut off" or the reason that it gave.
  std::string why_ended() const;
};

// The event's kind, and its text.
struct EventText {
  std::string kind, text;
};
EventText event_of(const RunBegun& event);
EventText event_of(const RunPlanned& event);
EventText event_of(const LegDone& event);
EventText event_of(const ScanDone& event);
EventText event_of(const TourClosed& event);
EventText event_of(const StationDropped& event);
EventText event_of(const StationReplaced& event);
EventText event_of(const ViewsLeftOut& event);
EventText event_of(const RunEnded& event);
EventText event_of(const RunResumed& event);
EventText event_of(const Whereabouts& event);  // On the way.
EventText leaves_event(const std::string& to);
EventText stopped_event(const std::string& what);
EventText products_event();
EventText at_start_event();  // As a person said of the robot.

// Fails with errc::bad_message, naming the event, for what no run writes. `path` is for the text.
FileResult<RunHistory> read_history(const std::vector<JournalEvent>& events,
                                    const std::filesystem::path& path);

}  // namespace mission
