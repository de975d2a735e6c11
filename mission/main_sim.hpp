// The simulation backend of vantaged: a world behind the devices, and its judgement afterwards.
// Like main.cpp it may know everything.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mission/config.hpp"
#include "mission/main_gate.hpp"
#include "mission/main_units.hpp"
#include "mission/plan.hpp"
#include "mission/record.hpp"
#include "mission/site_model.hpp"
#include "mission/survey.hpp"
#include "sim/event_loop.hpp"
#include "sim/mesh.hpp"
#include "sim/placement.hpp"
#include "sim/scene.hpp"
#include "sim/sim_clock.hpp"
#include "sim/witnessed_scanner.hpp"
#include "sim/world.hpp"

namespace mission {

// The site's true surfaces, or why there are none.
struct SimSite {
  sim::Mesh mesh;
  std::vector<std::string> notes;
  std::vector<std::string> errors;
};

SimSite load_sim_site(const std::filesystem::path& model_file);

// For maps that say nothing of the ground's height: what the model's walls stand on. Changes the
// map and its regions, and says so in the notes.
void assume_ground(SimSite& site, nav::SiteMap& map);

// Adds a level ground where the model has none under the places where the robot or a person stands.
void complete_ground(SimSite& site, const nav::SiteMap& map, const std::vector<AreaTask>& tasks);

// The true site, with the robot at its start.
class SimWorld {
 public:
  // Throws std::runtime_error when the robot cannot stand at its start.
  SimWorld(const MissionConfig& config, const SiteTasks& tasks, SimSite site, int threads);

  const sim::Mesh& mesh() const { return site_.mesh; }
  const sim::Scene& scene() const { return scene_; }
  sim::World& world() { return world_; }
  const sim::World& world() const { return world_; }

 private:
  SimSite site_;
  sim::Scene scene_;
  sim::World world_;
};

class SimBackend {
 public:
  // Throws std::runtime_error when the robot cannot stand at its start.
  SimBackend(const MissionConfig& config, const SiteTasks& tasks, SimSite site, int threads);

  sim::SimClock& clock() { return clock_; }
  hal::Devices& devices() { return devices_; }
  boost::asio::any_io_executor executor() { return loop_.get_executor(); }
  RobotDrivers& drivers() { return robot_.drivers(); }
  RobotUnits& units() { return robot_.units(); }
  SimulatedRobot& robot() { return robot_; }
  GatedDrive& gate() { return gate_; }
  sim::World& world() { return true_site_.world(); }
  // Where the robot really is, and where its last scan was taken.
  Survey::Truths truths() const;
  // Before it runs. Throws std::runtime_error when the robot cannot stand there.
  void put_robot(const hal::Pose2& pose, double ground_z_m);
  // Told of each of events().
  void on_event(std::function<void(const std::string&)> tell) { on_event_ = std::move(tell); }
  // What stopped and released the robot, in words.
  const std::vector<std::string>& events() const { return events_; }
  // Starts units and drivers, and runs until done() holds. False when they ended by themselves, or
  // nothing is left to run: failure() may say why.
  bool run(const std::function<bool()>& done);
  const std::string& failure() const { return failure_; }

  // Puts the true poses beside the believed ones and counts the surface that was to be seen. Writes
  // the scanner positions that it judged from, one "x_m,y_m,z_m" a line, the scans first, where
  // cells_file is not empty.
  Truth judge(RunRecord& record, const SiteModel& model, const std::vector<AreaTask>& tasks,
              const std::filesystem::path& cells_file) const;

 private:
  hal::Task<void> run_robot();
  std::string complaints();
  void judge_poses(RunRecord& record, Truth& truth) const;
  void judge_surface(const RunRecord& record, const SiteModel& model,
                     const std::vector<Eigen::Vector3d>& positions, Truth& truth) const;
  std::function<bool(const Eigen::Vector2d&)> reachable_ground(const RunRecord& record,
                                                               const AreaTask& task) const;
  std::vector<Eigen::Vector3d> scanner_positions(const RunRecord& record, const SiteModel& model,
                                                 const std::vector<AreaTask>& tasks) const;

  const MissionConfig config_;
  const int threads_;
  SimWorld true_site_;
  sim::EventLoop loop_;
  sim::SimClock clock_{loop_};
  SimulatedRobot robot_;
  std::vector<std::string> events_;
  std::function<void(const std::string&)> on_event_;
  GatedDrive gate_;
  sim::WitnessedScanner scanner_;
  sim::SimPlacement placement_;
  hal::Devices devices_;
  bool started_ = false;
  std::string failure_;
};

}  // namespace mission
