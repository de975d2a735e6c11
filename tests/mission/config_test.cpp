// What a mission file may say, and what a person is told when it says something else.
#include "mission/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "mission/config_schema.hpp"
#include "mission/suggest.hpp"

namespace {

using mission::ConfigError;
using mission::ConfigFile;
using testing::HasSubstr;

namespace fs = std::filesystem;

std::string all_text(const std::vector<ConfigError>& errors) {
  std::string text;
  for (const auto& error : errors) text += error.text() + "\n";
  return text;
}

mission::LoadedMission parse(std::string_view mission_text, std::string_view robot_text = "") {
  return mission::parse_mission(mission_text, "m.toml", robot_text, "r.toml");
}

// A folder that is gone after the test.
class Folder {
 public:
  Folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = fs::temp_directory_path() / ("vantage_" + std::string(test->name()));
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path write(const std::string& name, std::string_view text) const {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

TEST(Config, EmptyTextGivesTheDefaults) {
  const auto loaded = parse("");
  EXPECT_EQ(all_text(loaded.errors), "");
  const mission::MissionConfig defaults;
  EXPECT_EQ(loaded.config.name, "m");
  EXPECT_EQ(loaded.config.seed, defaults.seed);
  EXPECT_EQ(loaded.config.phase1.candidates, defaults.phase1.candidates);
  EXPECT_TRUE(loaded.config.written.empty());
}

TEST(Config, DefaultsOfEveryKeyLieInTheirOwnRange) {
  mission::MissionConfig config;
  for (const auto& section : mission::config_schema()) {
    if (section.add_entry) section.add_entry(config, {});
    for (const auto& spec : section.keys) {
      const auto slot = spec.slot(config);
      if (const auto* const* number = std::get_if<double*>(&slot);
          number != nullptr && !std::isnan(**number)) {  // NaN: there is no default.
        EXPECT_GE(**number, spec.min) << spec.key;
        EXPECT_LE(**number, spec.max) << spec.key;
      }
      if (const auto* const* number = std::get_if<int*>(&slot)) {
        EXPECT_GE(**number, spec.min) << spec.key;
        EXPECT_LE(**number, spec.max) << spec.key;
      }
      EXPECT_FALSE(spec.help.empty()) << spec.key;
    }
  }
}

TEST(Config, EveryKeyIsReadIntoItsMember) {
  const auto loaded = parse(R"(name = "n"
robot = "robots/r.toml"
site = "../sites/s"
seed = 9223372036854775807
plan = "p.toml"
margin_m = 12
return_home = false
start = "on-boot"
[regions]
moat = "manual"
"inner court" = "robot"
attic = "skip"
[phase1]
cover = "greedy"
candidates = 7
coverage_goal = 0.5
gain_min = 0
gain_enough_m = 4
overlap_min = 0.25
[phase2]
voxel_m = 0.5
height_m = 12.5
height_max_m = 50
gain_min_voxels = 3
views_max = 4
carve_no_return = false
foliage = true
foliage_share_min = 0.75
choose = "gain_per_minute"
views_ahead = 2
density_min_ppm2 = 25
[localize]
match_map = false
sigma_max_m = 2
[register]
scans = false
references_max = 3
in_hand_max = 20
overlap_min = 0.5
rms_max_m = 0.125
retake = false
tour_end = false
[disk]
patience_s = 60
then = "home"
)",
                            R"(name = "rn"
backend = "sim"
[body]
radius_m = 0.25
track_m = 0.3
speed_max_mps = 2
turn_max_degps = 90
slope_max_deg = 20
step_max_m = 0.15
[drive]
device = "cia402"
link = "can:can1"
left_node = 3
right_node = 4
left_units_per_mps = 500
right_units_per_mps = -500
left_counts_per_m = 2000
right_counts_per_m = -2000
[pan]
device = "flir-ptu"
link = "tcp:ptu:4000"
angle_max_deg = 159
counter_clockwise = true
stop_and_go = true
late_s = 0.004
[obstacles]
device = "hokuyo"
link = "tcp:ahead:10940"
model = "UST"
height_m = 0.2
offset_x_m = 0.4
patience_s = 7
[imu]
device = "vn100"
link = "serial:/dev/imu@115200"
[gnss]
device = "gpsd"
link = "tcp:localhost:2947"
[corrections]
device = "ntrip"
link = "tcp:caster:2102"
mountpoint = "M"
account = "a.txt"
version = 1
tells_position = true
[power]
battery_link = "modbus-tcp:cerbo:502/225"
board_link = "modbus-rtu:/dev/relays@9600N/1"
safety_link = "modbus-tcp:pilz:502/1"
[console]
serial = "/dev/ttyS0"
socket = "/run/vantage/console.sock"
password = "/etc/vantage/password"
[scanner]
device = "sick-lms1xx"
link = "tcp:lms:2112"
model = "UST"
api_link = "tcp:os:80"
metadata = "os.json"
tilt_deg = 90
roll_deg = 1
yaw_deg = 2
offset_x_m = 0.1
offset_y_m = 0.2
offset_z_m = 0.3
height_m = 1
range_min_m = 2
range_max_m = 50
grazing_max_deg = 60
fov_deg = 180
azimuth_step_deg = 0.5
elevation_min_deg = -10
elevation_max_deg = 20
elevation_step_deg = 0.25
scan_s = 60
[battery]
capacity_wh = 900
drive_w = 150
scan_w = 40
idle_w = 20
reserve_share = 0.3
[sim]
range_sigma_m = 0.1
slip_sigma = 0.2
gyro_sigma_degps = 0.3
gyro_bias_degps = 0.4
gnss_sigma_m = 0.5
gnss_outage = "yard"
placement_sigma_m = 0.6
placement_heading_sigma_deg = 0.7
placement_s = 8
people = 3
)");
  EXPECT_EQ(all_text(loaded.errors), "");
  const auto values = mission::effective_values(loaded.config);
  std::string text;
  for (const auto& value : values) text += value.path + "=" + value.value + "\n";
  EXPECT_EQ(text, R"(name=n
robot=robots/r.toml
site=../sites/s
seed=9223372036854775807
plan=p.toml
margin_m=12
return_home=false
start=on-boot
phase1.cover=greedy
phase1.candidates=7
phase1.coverage_goal=0.5
phase1.gain_min=0
phase1.gain_enough_m=4
phase1.overlap_min=0.25
phase2.voxel_m=0.5
phase2.height_m=12.5
phase2.height_max_m=50
phase2.gain_min_voxels=3
phase2.views_max=4
phase2.carve_no_return=false
phase2.foliage=true
phase2.foliage_share_min=0.75
phase2.choose=gain_per_minute
phase2.views_ahead=2
phase2.density_min_ppm2=25
localize.match_map=false
localize.sigma_max_m=2
register.scans=false
register.references_max=3
register.in_hand_max=20
register.overlap_min=0.5
register.rms_max_m=0.125
register.retake=false
register.tour_end=false
disk.patience_s=60
disk.then=home
robot.name=rn
robot.backend=sim
robot.body.radius_m=0.25
robot.body.track_m=0.3
robot.body.speed_max_mps=2
robot.body.turn_max_degps=90
robot.body.slope_max_deg=20
robot.body.step_max_m=0.15
robot.drive.device=cia402
robot.drive.link=can:can1
robot.drive.left_node=3
robot.drive.right_node=4
robot.drive.left_units_per_mps=500
robot.drive.right_units_per_mps=-500
robot.drive.left_counts_per_m=2000
robot.drive.right_counts_per_m=-2000
robot.scanner.height_m=1
robot.scanner.range_min_m=2
robot.scanner.range_max_m=50
robot.scanner.grazing_max_deg=60
robot.scanner.fov_deg=180
robot.scanner.azimuth_step_deg=0.5
robot.scanner.elevation_min_deg=-10
robot.scanner.elevation_max_deg=20
robot.scanner.elevation_step_deg=0.25
robot.scanner.scan_s=60
robot.scanner.device=sick-lms1xx
robot.scanner.link=tcp:lms:2112
robot.scanner.model=UST
robot.scanner.api_link=tcp:os:80
robot.scanner.metadata=os.json
robot.scanner.tilt_deg=90
robot.scanner.roll_deg=1
robot.scanner.yaw_deg=2
robot.scanner.offset_x_m=0.1
robot.scanner.offset_y_m=0.2
robot.scanner.offset_z_m=0.3
robot.pan.device=flir-ptu
robot.pan.link=tcp:ptu:4000
robot.pan.angle_max_deg=159
robot.pan.counter_clockwise=true
robot.pan.stop_and_go=true
robot.pan.late_s=0.004
robot.obstacles.device=hokuyo
robot.obstacles.link=tcp:ahead:10940
robot.obstacles.model=UST
robot.obstacles.height_m=0.2
robot.obstacles.offset_x_m=0.4
robot.obstacles.patience_s=7
robot.imu.device=vn100
robot.imu.link=serial:/dev/imu@115200
robot.gnss.device=gpsd
robot.gnss.link=tcp:localhost:2947
robot.corrections.device=ntrip
robot.corrections.link=tcp:caster:2102
robot.corrections.mountpoint=M
robot.corrections.account=a.txt
robot.corrections.version=1
robot.corrections.tells_position=true
robot.power.battery_link=modbus-tcp:cerbo:502/225
robot.power.board_link=modbus-rtu:/dev/relays@9600N/1
robot.power.safety_link=modbus-tcp:pilz:502/1
robot.console.serial=/dev/ttyS0
robot.console.socket=/run/vantage/console.sock
robot.console.password=/etc/vantage/password
robot.battery.capacity_wh=900
robot.battery.drive_w=150
robot.battery.scan_w=40
robot.battery.idle_w=20
robot.battery.reserve_share=0.3
robot.sim.range_sigma_m=0.1
robot.sim.slip_sigma=0.2
robot.sim.gyro_sigma_degps=0.3
robot.sim.gyro_bias_degps=0.4
robot.sim.gnss_sigma_m=0.5
robot.sim.gnss_outage=yard
robot.sim.placement_sigma_m=0.6
robot.sim.placement_heading_sigma_deg=0.7
robot.sim.placement_s=8
robot.sim.people=3
regions.attic=skip
regions.inner court=robot
regions.moat=manual
)");
  for (const auto& value : values) EXPECT_NE(value.origin, "default") << value.path;
}

TEST(Config, OriginNamesTheLineOrSaysDefault) {
  const auto loaded = parse("\nseed = 3\n", "[body]\nradius_m = 1\n");
  for (const auto& value : mission::effective_values(loaded.config)) {
    const bool seed = value.path == "seed", radius = value.path == "robot.body.radius_m";
    EXPECT_EQ(value.origin, seed ? "m.toml:2" : radius ? "r.toml:2" : "default") << value.path;
  }
}

// One broken text: the first error must stand at this place and say this.
struct Broken {
  std::string text;
  int line;
  int column;
  std::string says;
};

std::vector<Broken> broken_missions() {
  return {
#include "tests/mission/broken_missions.inc"
  };
}

std::vector<Broken> broken_robots() {
  return {
#include "tests/mission/broken_robots.inc"
  };
}

void expect_error(const Broken& broken, const mission::LoadedMission& loaded,
                  const std::string& file) {
  ASSERT_FALSE(loaded.errors.empty()) << broken.text;
  const auto& error = loaded.errors.front();
  EXPECT_EQ(error.file, file) << broken.text << all_text(loaded.errors);
  EXPECT_EQ(error.line, broken.line) << broken.text << all_text(loaded.errors);
  EXPECT_EQ(error.column, broken.column) << broken.text << all_text(loaded.errors);
  EXPECT_THAT(error.message, HasSubstr(broken.says)) << broken.text;
  EXPECT_EQ(loaded.errors.size(), 1u) << broken.text << all_text(loaded.errors);
}

TEST(Config, EveryBrokenMissionIsToldLineColumnAndRemedy) {
  for (const auto& broken : broken_missions()) expect_error(broken, parse(broken.text), "m.toml");
}

TEST(Config, EveryBrokenRobotIsToldLineColumnAndRemedy) {
  for (const auto& broken : broken_robots()) expect_error(broken, parse("", broken.text), "r.toml");
}

TEST(Config, TheTablesOfBrokenTextsHoldAtLeast80) {
  EXPECT_GE(broken_missions().size() + broken_robots().size(), 80u);
}

TEST(Config, EveryErrorIsReportedInOneRunInOrder) {
  const auto loaded = parse(
      "sede = 1\nmargin_m = -1\nreturn_home = 1\n[phase1]\nfoo = \n[phase2]\nvoxel_m = \"1\"\n",
      "[body]\nradius_m = 100\n[scanner]\nrange_min_m = 60\nrange_max_m = 50\n");
  EXPECT_EQ(all_text(loaded.errors),
            R"(m.toml:1:1: unknown key 'sede'; did you mean 'seed'?
m.toml:2:12: 'margin_m' must be a number from 0 to 10000 m, found the number -1
m.toml:3:15: 'return_home' must be true or false, found the number 1
m.toml:5:7: not TOML: key-value pair: expected value, saw the end of the line; write a value after the '='
m.toml:7:11: 'voxel_m' must be a number from 0.02 to 20 m, found text '1'; write it without quotes
r.toml:2:12: 'radius_m' must be a number from 0.05 to 5 m, found the number 100
r.toml:5:1: 'range_min_m' (60 m) must be less than 'range_max_m' (50 m)
)");
}

TEST(Config, ARuleIsNotCheckedOnAValueThatWasRefused) {
  const auto loaded = parse("", "[scanner]\nrange_min_m = 99\nrange_max_m = \"50\"\n");
  EXPECT_EQ(loaded.errors.size(), 1u) << all_text(loaded.errors);
}

TEST(Config, ABrokenHeaderDoesNotBlameTheKeysBelowIt) {
  const auto loaded = parse("seed = 1\n[phase1\ncandidates = 5\n[phase2]\nvoxel_m = 0\n");
  ASSERT_EQ(loaded.errors.size(), 2u) << all_text(loaded.errors);
  EXPECT_EQ(loaded.errors[0].line, 2);
  EXPECT_EQ(loaded.errors[1].line, 5);
}

// Every deletion, swap, doubling and two replacements of every letter of every key.
std::vector<std::string> one_edit_typos(const std::string& key) {
  std::vector<std::string> typos;
  for (std::size_t i = 0; i < key.size(); ++i) {
    typos.push_back(key.substr(0, i) + key.substr(i + 1));
    typos.push_back(key.substr(0, i + 1) + key.substr(i));
    for (const char c : {'x', 'e'}) {
      typos.push_back(key.substr(0, i) + c + key.substr(i + 1));
      typos.push_back(key.substr(0, i) + c + key.substr(i));
    }
    if (i + 1 < key.size()) {
      typos.push_back(key);
      std::swap(typos.back()[i], typos.back()[i + 1]);
    }
  }
  return typos;
}

TEST(Config, OneEditTyposOfEveryKeyGetTheRightGuess) {
  int tried = 0, right = 0;
  std::string wrong;
  for (const auto& section : mission::config_schema())
    for (const auto& spec : section.keys)
      for (const auto& typo : one_edit_typos(spec.key)) {
        const bool is_key = std::any_of(section.keys.begin(), section.keys.end(),
                                        [&](const auto& known) { return known.key == typo; });
        if (is_key || typo.empty()) continue;
        const std::string head = section.name.empty() ? "" : "[" + section.name + "]\n";
        const std::string text = head + typo + " = 1\n";
        const auto loaded = section.file == ConfigFile::mission ? parse(text) : parse("", text);
        ++tried;
        const bool good =
            loaded.errors.size() == 1 &&
            loaded.errors[0].message.find("did you mean '" + spec.key + "'") != std::string::npos;
        right += good;
        if (!good) wrong += typo + ": " + all_text(loaded.errors);
      }
  RecordProperty("tried", tried);
  RecordProperty("right", right);
  EXPECT_GT(tried, 2000);
  EXPECT_GE(right, tried * 9 / 10) << wrong;
}

TEST(Config, PathsAreRelativeToTheFileThatNamesThem) {
  const Folder folder;
  fs::create_directories(folder / "sites/s");
  folder.write("robots/r.toml", "name = 'crawler'\n");
  const auto file =
      folder.write("missions/m.toml", "robot = '../robots/r.toml'\nsite = '../sites/s'\n");
  const auto loaded = mission::load_mission(file);
  EXPECT_EQ(all_text(loaded.errors), "");
  EXPECT_EQ(loaded.config.robot.name, "crawler");
  EXPECT_EQ(loaded.config.site_folder, folder / "sites/s");
  EXPECT_EQ(loaded.config.name, "m");
}

TEST(Config, MissingFilesAreNamedWithThePathTried) {
  const Folder folder;
  folder.write("robots/crawler.toml", "");
  const auto file =
      folder.write("m.toml", "seed = 2\nrobot = 'robots/crowler.toml'\nsite = 'sites/s'\n");
  const auto loaded = mission::load_mission(file);
  ASSERT_EQ(loaded.errors.size(), 2u) << all_text(loaded.errors);
  EXPECT_EQ(loaded.errors[0].line, 2);
  EXPECT_THAT(loaded.errors[0].message, HasSubstr((folder / "robots/crowler.toml").string()));
  EXPECT_THAT(loaded.errors[0].message, HasSubstr("did you mean 'crawler.toml'?"));
  EXPECT_EQ(loaded.errors[1].line, 3);
  EXPECT_THAT(loaded.errors[1].message, HasSubstr((folder / "sites/s").string()));
}

TEST(Config, AMissionWithoutASiteAsksForOne) {
  const Folder folder;
  const auto loaded = mission::load_mission(folder.write("m.toml", "seed = 2\n"));
  ASSERT_EQ(loaded.errors.size(), 1u);
  EXPECT_THAT(loaded.errors[0].message, HasSubstr("--site"));
}

TEST(Config, OverridesReplaceTheSiteAndTheSeed) {
  const Folder folder;
  fs::create_directories(folder / "here");
  const auto file = folder.write("m.toml", "site = 'is/not/there'\nseed = 2\n");
  mission::Overrides overrides;
  overrides.site_folder = folder / "here";
  overrides.has_seed = true;
  overrides.seed = 77;
  const auto loaded = mission::load_mission(file, overrides);
  EXPECT_EQ(all_text(loaded.errors), "");
  EXPECT_EQ(loaded.config.site_folder, folder / "here");
  EXPECT_EQ(loaded.config.seed, 77u);
}

TEST(Config, AnOverriddenSiteMustExist) {
  const Folder folder;
  mission::Overrides overrides;
  overrides.site_folder = folder / "nowhere";
  const auto loaded = mission::load_mission(folder.write("m.toml", ""), overrides);
  ASSERT_EQ(loaded.errors.size(), 1u);
  EXPECT_EQ(loaded.errors[0].text(),
            "--site: site folder '" + (folder / "nowhere").string() + "' does not exist");
}

TEST(Config, AMissingMissionFileIsOneError) {
  const Folder folder;
  const auto loaded = mission::load_mission(folder / "m.toml");
  ASSERT_EQ(loaded.errors.size(), 1u);
  EXPECT_THAT(loaded.errors[0].text(), HasSubstr("m.toml: mission file cannot be read"));
  EXPECT_EQ(mission::load_mission(folder / ".").errors.size(), 1u);
}

std::vector<fs::path> toml_files(const std::string& folder) {
  std::vector<fs::path> files;
  const auto path = fs::path(VANTAGE_SOURCE_DIR) / "configs" / folder;
  if (!fs::exists(path)) return files;
  for (const auto& entry : fs::directory_iterator(path))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  return files;
}

std::string read_text(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return std::move(text).str();
}

TEST(Config, EveryShippedMissionAndRobotLoads) {
  const auto missions = toml_files("missions");
  const auto robots = toml_files("robots");
  EXPECT_FALSE(missions.empty());
  EXPECT_FALSE(robots.empty());
  for (const auto& file : missions) {
    const auto text = read_text(file);
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 20) << file << " has more than 20 lines";
    const auto parsed = parse(text);
    mission::Overrides overrides;  // A mission may leave its site to the command line.
    if (parsed.config.site_folder.empty()) overrides.site_folder = VANTAGE_SOURCE_DIR;
    EXPECT_EQ(all_text(mission::load_mission(file, overrides).errors), "") << file;
  }
  for (const auto& file : robots)
    EXPECT_EQ(all_text(parse("", read_text(file)).errors), "") << file;
}

TEST(Config, ReadmeOfConfigsHoldsTheGeneratedReference) {
  const auto text = read_text(fs::path(VANTAGE_SOURCE_DIR) / "configs/README.md");
  EXPECT_THAT(text, HasSubstr(mission::config_reference()))
      << "update it: build/release/vantage keys, below the line <!-- keys -->";
}

TEST(Suggest, EditDistanceCountsASwapOfNeighboursOnce) {
  EXPECT_EQ(mission::edit_distance("", ""), 0);
  EXPECT_EQ(mission::edit_distance("abc", ""), 3);
  EXPECT_EQ(mission::edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(mission::edit_distance("seed", "sede"), 1);
  EXPECT_EQ(mission::edit_distance("ca", "abc"), 3);
}

TEST(Suggest, UnitsCaseAndWordOrderAreSmallDifferences) {
  EXPECT_EQ(mission::unlikeness("Range-Max-M", "range_max_m"), 0);
  EXPECT_EQ(mission::unlikeness("rangeMaxM", "range_max_m"), 0);
  EXPECT_EQ(mission::unlikeness("range_max", "range_max_m"), 0.5);
  EXPECT_EQ(mission::unlikeness("range_max_cm", "range_max_m"), 0.5);
  EXPECT_EQ(mission::unlikeness("max_range_m", "range_max_m"), 0.7);
  EXPECT_EQ(mission::unlikeness("banana", "range_max_m"), mission::kUnlike);
}

}  // namespace
