// A mission made ready, and a mission run in simulation: what vantaged and `vantage` share. Like
// main.cpp it may know everything.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <vector>

#include "mission/check_report.hpp"
#include "mission/main_sim.hpp"
#include "mission/summary.hpp"
#include "mission/survey.hpp"

namespace mission {

// How much of the site's 3-D model is wanted.
enum class WorldUse {
  none,    // The map alone.
  ground,  // Where the map does not tell the ground's height, the model does, if there is one.
  world,   // The model is the world to simulate: without one there is an error.
  backend  // As the robot file says: the world for "sim"; for "hardware" the ground, and then what
           // only real devices need is checked too: links, and where the site lies on the earth.
};

// Everything that must be right before anything starts or is written.
struct Prepared {
  std::filesystem::path mission_file;  // May be empty: none.
  MissionConfig config;
  nav::RepairedSite site;
  std::optional<GeoOrigin> origin;  // Of the site, if its map tells.
  SiteTasks tasks;
  SimSite sim;                     // With WorldUse::world.
  std::vector<std::string> notes;  // Of site and model; the tasks have their own.
  std::vector<ConfigError> errors;
};

// Reads and checks mission, robot, plan and site; `model_file` replaces the site's model when not
// empty. Never throws for what files hold.
Prepared prepare(const std::filesystem::path& mission_file, const Overrides& overrides,
                 WorldUse use, const std::filesystem::path& model_file = {});

class Service;

struct RunOptions {
  std::filesystem::path out;           // Folder for the run's products.
  bool resume = false;                 // Go on with the unfinished run that is in it,
  std::vector<std::string> skip = {};  // without these of its stations,
  bool from_start = false;             // by a robot that stands at its start now.
  std::filesystem::path judge_cells;   // See SimBackend::judge.
  int threads = 1;
  std::ostream* progress = nullptr;              // Null: says nothing.
  bool terminal = false;                         // Whether `progress` is one.
  std::function<void(SimBackend&)> watch = {};   // Called as time goes on, to break something.
  Service* service = nullptr;                    // Hardware: what it is run by; null: by a person.
  std::function<Prepared()> prepare_again = {};  // With a service: for its reload.
};

struct RunOutcome {
  RunRecord record;
  std::filesystem::path report;
  std::string failure;   // Not empty: what ended it early.
  bool stopped = false;  // By a signal: not for anything that went wrong.
  bool held = false;     // The robot had been stopped, and nobody had released it since.
};

// A run's folder, open, and its journal; `past` when it goes on with what lies there.
struct OpenedRun {
  RunStore store;
  JournalFile journal;
  std::optional<RunHistory> past;
};
// Begins a run, or goes on with one, and says so in its journal. Throws boost::system::system_error
// when the folder cannot be used or a scan other than the last is damaged, CannotResume when there
// is nothing to go on with, or other inputs.
OpenedRun open_run(const Prepared& prepared, const RunOptions& options);

struct CannotResume : std::runtime_error {
  using runtime_error::runtime_error;
};

// Runs the whole mission in simulation and writes its products. Uses up prepared.sim. Throws
// boost::system::system_error when the folder cannot be written, std::runtime_error when the robot
// cannot stand at its start.
RunOutcome run_in_simulation(Prepared& prepared, const RunOptions& options);

// What a run is judged and reported by, whatever carried it out: writes its products, and then
// that they are there. Nothing else uses the journal any more. Returns what could not be written;
// else nothing.
std::string save_products(RunStore& store, const Survey& survey, Journal& journal);

// Threads to use for 0: one a core.
int threads_or_all(int threads);

}  // namespace mission
