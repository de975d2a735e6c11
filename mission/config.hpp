// A mission as a person writes it: one TOML file that names a robot file and a site folder. Every
// key has a working default; units are in the key; angles are degrees here and radians in the code.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mission {

// [body] of the robot file.
struct BodyConfig {
  double radius_m = 0.5;
  double track_m = 0.6;
  double speed_max_mps = 1.0;
  double turn_max_degps = 45;
  // Of the ground that it drives on; steeper ground and higher steps are closed to it when a scan
  // shows them.
  double slope_max_deg = 15;
  double step_max_m = 0.1;
};

// [scanner] of the robot file.
struct ScannerConfig {
  double height_m = 1.8;
  double range_min_m = 1.0;
  double range_max_m = 80.0;
  double grazing_max_deg = 70.0;
  double fov_deg = 360.0;
  double azimuth_step_deg = 0.2;
  double elevation_min_deg = -60.0;
  double elevation_max_deg = 90.0;
  double elevation_step_deg = 0.1667;
  double scan_s = 90.0;
  std::string device = "sick-lms5xx";
  std::string link = "tcp:192.168.0.1:2112";
  std::string model;               // Of a Hokuyo: how what it says it is begins; empty: any.
  std::filesystem::path metadata;  // Of an Ouster: file, relative to the robot file.
  std::string api_link;            // Of an Ouster: where it serves its settings; empty: not asked.
  // How a profile scanner hangs on the pan axis, as drivers::SweepMount has it.
  double tilt_deg = 35.0;  // How high its straight ahead looks.
  double roll_deg = 0, yaw_deg = 0;
  double offset_x_m = 0, offset_y_m = 0, offset_z_m = 0;  // From the pan axis, at pan angle 0.
};

// [drive] of the robot file.
struct DriveConfig {
  std::string device = "agilex-scout2";
  std::string link = "can:can0";
  // Of two CiA 402 drives; found at commissioning.
  int left_node = 1, right_node = 2;
  double left_units_per_mps = 1000, right_units_per_mps = 1000;
  double left_counts_per_m = 10'000, right_counts_per_m = 10'000;
};

// [pan]: what turns a profile scanner.
struct PanConfig {
  std::string device = "flir-ptu";
  std::string link = "serial:/dev/ttyUSB0@9600";
  double angle_max_deg = 185;  // To both sides: a slip-ring model; others reach 159.
  bool counter_clockwise = false;
  bool stop_and_go = false;
  double late_s = 0;  // How much later than the profiles' the pan readings' times are.
};

// [imu], [gnss]
struct ImuConfig {
  std::string device = "vn100";
  std::string link = "serial:/dev/ttyUSB1@115200";
};
struct GnssConfig {
  std::string device = "ublox";
  std::string link = "serial:/dev/ttyACM0@38400";
};

// [corrections]: what makes a satellite fix exact. Without them it is good to a metre or two.
struct CorrectionsConfig {
  std::string device = "none";  // or "ntrip"
  std::string link = "tcp:rtk.example.org:2101";
  std::string mountpoint;
  std::filesystem::path account;  // File with "user:password"; empty: the caster asks for none.
  int version = 2;                // Of NTRIP.
  bool tells_position = false;    // The mountpoint is of a network that must know where it is.
};

// [obstacles]: a Hokuyo that looks level while the robot drives, or its [scanner]: see look.hpp.
// Without one it drives by its map and learns of what that lacks from its scans, or by touching it.
struct ObstaclesConfig {
  std::string device = "none";  // or "hokuyo", "scanner"
  std::string link = "tcp:192.168.0.10:10940";
  std::string model;  // How what it says it is begins; empty: any.
  double height_m = 0.3;
  double offset_x_m = 0;  // Ahead of the robot's middle.
  double patience_s = 5;  // What stands in the way for longer is gone round.
};

// [power]: links of Modbus units; empty where the robot has none.
struct PowerConfig {
  std::string battery_link;  // A Victron battery service.
  std::string board_link;    // A Waveshare relay board with the e-stop's contacts.
  std::string safety_link;   // A Pilz safety controller.
};

// [sim] of the robot file: how the simulated world misbehaves. One-sigma values.
struct SimConfig {
  double range_sigma_m = 0.01;
  double slip_sigma = 0.02;  // Of the travel of each side.
  double gyro_sigma_degps = 0.05;
  double gyro_bias_degps = 0.02;
  double gnss_sigma_m = 0.03;
  std::string gnss_outage;          // Region of the map where no satellite is seen; empty: none.
  double placement_sigma_m = 0.01;  // A scanner set up by hand on surveyed marks.
  double placement_heading_sigma_deg = 0.05;
  double placement_s = 900.0;  // Time to carry it there and set it up.
  int people = 0;              // Who walk about in the robot's area.
};

// [console] of the robot file: where an operator may sit; empty: there is no such place.
struct ConsoleConfig {
  std::string serial;                                          // A port, at 115200 8N1.
  std::string socket;                                          // Of `vantage console`.
  std::string password = "/var/lib/vantage/console.password";  // The file that keeps its hash.
};

// [battery] of the robot file: what plans and missions reckon with. Watts are all that the robot
// draws in that state, scanner and computers included.
struct BatteryConfig {
  double capacity_wh = 720;
  double drive_w = 180;
  double scan_w = 70;
  double idle_w = 50;          // While a person carries the scanner.
  double reserve_share = 0.1;  // Kept at every decision, besides what the way home takes.
};

struct RobotConfig {
  std::string name = "robot";
  std::string backend = "sim";
  BodyConfig body;
  DriveConfig drive;
  ScannerConfig scanner;
  PanConfig pan;
  ObstaclesConfig obstacles;
  ImuConfig imu;
  GnssConfig gnss;
  CorrectionsConfig corrections;
  PowerConfig power;
  ConsoleConfig console;
  BatteryConfig battery;
  SimConfig sim;
};

// [phase1]
struct Phase1Config {
  std::string cover = "refined";  // or "greedy": the paper's
  int candidates = 1000;
  double coverage_goal = 0.98;
  double gain_min = 0.02;
  double gain_enough_m = 5;
  double overlap_min = 0.2;
};

// [phase2]
struct Phase2Config {
  double voxel_m = 1.0;
  double height_m = 30.0;       // Of the voxel box above the lowest ground, at first.
  double height_max_m = 120.0;  // The box grows up to here when scans see higher.
  int gain_min_voxels = 100;
  int views_max = 100;
  bool carve_no_return = true;
  bool foliage = false;  // Tell thin vegetation from walls (planning/voxel_foliage.hpp).
  double foliage_share_min = 0.8;
  std::string choose = "gain";  // "gain" (the paper's) | "gain_per_minute"
  int views_ahead = 5;          // That the decision log looks ahead.
  double density_min_ppm2 = 0;  // Points per m^2 that every surface should get; 0: no such goal.
};

// [localize]
struct LocalizeConfig {
  bool match_map = true;     // Every scan's walls against those of the map.
  double sigma_max_m = 1.0;  // Of the pose, along its worse axis: less sure, the robot stands.
};

// [register]
struct RegisterConfig {
  bool scans = true;          // Every scan against those that it overlaps.
  int references_max = 4;     // Scans that a new one is laid against: those that it overlaps most.
  int in_hand_max = 150;      // Thinned clouds kept; then the oldest is no reference any more.
  double overlap_min = 0.25;  // Of a scan with another where the localizer has it, to be tried.
  double rms_max_m = 0.06;
  bool retake = true;    // A scan that is refused is taken once more.
  bool tour_end = true;  // All pairs together when a tour closes; the map is filled anew.
};

// [disk]
struct DiskConfig {
  double patience_s = 300;      // That it may fail before the robot does what follows.
  std::string then = "stands";  // "stands": the mission ends where it stands | "home"
  bool home() const { return then == "home"; }
};

// Where a key was written. Line and column count from 1; 0 says "the whole file" (or no file).
struct ConfigPlace {
  std::string file;
  int line{};
  int column{};
};

// [[station]] of a plan file: a place to scan from, as chosen before.
struct SavedStation {
  std::string area;                                       // Name of the free area.
  std::string name;                                       // "" : numbered within its area.
  double x_m = std::numeric_limits<double>::quiet_NaN();  // Until it is read.
  double y_m = std::numeric_limits<double>::quiet_NaN();
  double heading_deg{};
  ConfigPlace place;  // Of the [[station]].
};

// A plan file: the stations of a rehearsal, or of an earlier survey, to be visited again.
struct SavedPlan {
  std::string site;                    // What made it, for people: the site,
  std::string made_by;                 // the command,
  std::uint64_t seed{};                // and the seed.
  std::vector<SavedStation> stations;  // Within an area in the order chosen.
};

struct MissionConfig {
  std::string name;                   // Default: the file's name without extension.
  std::filesystem::path robot_file;   // Key `robot`, relative to the mission file.
  std::filesystem::path site_folder;  // Key `site`, relative to the mission file.
  std::filesystem::path plan_file;    // Key `plan`, relative to the mission file; may be empty.
  std::uint64_t seed = 1;
  double margin_m = 30.0;  // From the obstacles to the boundary where the map has none.
  bool return_home = true;
  std::string start = "by-hand";               // As a service: "by-hand" or "on-boot".
  std::map<std::string, std::string> regions;  // [regions] name = "robot" | "manual" | "skip"
  Phase1Config phase1;
  Phase2Config phase2;
  LocalizeConfig localize;
  RegisterConfig registration;  // [register]
  DiskConfig disk;
  RobotConfig robot;  // Read from robot_file.
  SavedPlan plan;     // Read from plan_file; without one Phase I is planned.

  // Where each value that is not a default came from, by the path of the member it set: "seed",
  // "robot" and "site" (the keys), "phase2.voxel_m", "regions.moat", "robot.scanner.range_max_m".
  std::map<std::string, ConfigPlace> written;
  std::string file;  // The mission file's name, for messages.
};

// One thing wrong with a config, as people.md wants it: file, line, column, what, remedy.
struct ConfigError {
  std::string file;
  int line{};
  int column{};
  std::string message;

  std::string text() const;  // "file:line:column: message"; without line 0
};

struct LoadedMission {
  MissionConfig config;
  std::vector<ConfigError> errors;  // Not empty: refuse to start.
};

// What the command line may replace: --site DIR, --robot FILE and --seed N.
struct Overrides {
  std::filesystem::path site_folder;
  std::filesystem::path robot_file;
  bool has_seed{};
  std::uint64_t seed{};
  // Of a run whose files are not at hand: where its robot could stand, and where its site ended.
  std::optional<double> radius_m = std::nullopt;
  std::optional<double> margin_m = std::nullopt;
};

// Reads the mission file, and the robot file and the plan file that it names. Without a mission
// file (empty path) every key of it has its default. Never throws for what a file says. Errors are
// sorted: mission file, robot file, plan file, command line; by line and column within. Paths in
// the result are relative to the working folder (or absolute), not to the file that named them.
LoadedMission load_mission(const std::filesystem::path& file, const Overrides& overrides = {});

// The same from text, for tests and fuzzing; `robot` keys are read from robot_text when not empty.
// Looks at no disk: files and folders that the keys name need not exist, nor must a site be named.
LoadedMission parse_mission(std::string_view mission_text, const std::string& mission_name,
                            std::string_view robot_text, const std::string& robot_name);

}  // namespace mission
