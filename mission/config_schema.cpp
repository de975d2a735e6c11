#include "mission/config_schema.hpp"

#include <fmt/format.h>

namespace mission {
namespace {

constexpr double kSeedMax = 9223372036854775807.0;  // The largest whole number TOML can write.

// Builds the key tables of one struct: `part` finds the struct in the mission's config.
template <class Part>
class Keys {
 public:
  using Find = Part& (*)(MissionConfig&);
  explicit Keys(Find part) : part_(part) {}

  // A number, from min to max, ends included.
  template <class T>
  KeySpec number(std::string key, T Part::*member, double min, double max, std::string unit,
                 std::string help) const {
    return {std::move(key), slot(member), min, max, {}, std::move(unit), std::move(help)};
  }
  // A flag, a path, or text; text may be limited to some choices.
  template <class T>
  KeySpec other(std::string key, T Part::*member, std::string help,
                std::vector<std::string> choices = {}) const {
    return {std::move(key), slot(member), 0, 0, std::move(choices), "", std::move(help)};
  }

 private:
  template <class T>
  std::function<Slot(MissionConfig&)> slot(T Part::*member) const {
    return
        [part = part_, member](MissionConfig& config) -> Slot { return &(part(config).*member); };
  }
  Find part_;
};

SectionSpec mission_section() {
  using C = MissionConfig;
  const Keys<C> keys{[](C& c) -> C& { return c; }};
  return {ConfigFile::mission,
          "",
          "What to survey, and with what.",
          {keys.other("name", &C::name, "What reports call the mission; default: the file's name"),
           keys.other("robot", &C::robot_file,
                      "Robot file, relative to this file; without one, the robot keys' defaults"),
           keys.other("site", &C::site_folder,
                      "Folder with footprint.geojson, relative to this file; or give `--site DIR`"),
           keys.number("seed", &C::seed, 0, kSeedMax, "",
                       "Of every random choice: the same seed gives the same run"),
           keys.other("plan", &C::plan_file,
                      "Plan file (`vantage rehearse`), relative to this file: its stations are "
                      "toured and no others planned"),
           keys.number("margin_m", &C::margin_m, 0, 10'000, "m",
                       "From the obstacles to the boundary, where the map draws no boundary"),
           keys.other("return_home", &C::return_home, "Drive back to the start at the end"),
           keys.other("start", &C::start,
                      "As a service: wait for a person's release, or begin by itself where it was "
                      "shut down in order",
                      {"by-hand", "on-boot"})},
          {},
          {}};
}

SectionSpec phase1_section() {
  using P = Phase1Config;
  const Keys<P> keys{[](MissionConfig& c) -> P& { return c.phase1; }};
  return {
      ConfigFile::mission,
      "phase1",
      "The plan from the 2-D map (Algorithm 1).",
      {keys.other("cover", &P::cover,
                  "How stations are chosen: as in the paper, or from there on to fewer stations "
                  "and firmer links between scans",
                  {"greedy", "refined"}),
       keys.number("candidates", &P::candidates, 1, 1'000'000, "",
                   "Random stations to choose from, in each area"),
       keys.number("coverage_goal", &P::coverage_goal, 0.01, 1, "share",
                   "Of the target wall that any candidate can see; stop there"),
       keys.number("gain_min", &P::gain_min, 0, 1, "share",
                   "Of the target wall; stop when the next station adds less and less than "
                   "`gain_enough_m`"),
       keys.number("gain_enough_m", &P::gain_enough_m, 0, 1e6, "m",
                   "Of target wall; a station that adds so much is worth its time on a site of any "
                   "size"),
       keys.number("overlap_min", &P::overlap_min, 0, 0.95, "share",
                   "Of what a station sees that earlier stations must see too")},
      {},
      {}};
}

SectionSpec phase2_section() {
  using P = Phase2Config;
  const Keys<P> keys{[](MissionConfig& c) -> P& { return c.phase2; }};
  return {ConfigFile::mission,
          "phase2",
          "Next best views in the voxel map (Algorithm 2).",
          {keys.number("voxel_m", &P::voxel_m, 0.02, 20, "m", "Edge of a voxel"),
           keys.number("height_m", &P::height_m, 0.5, 500, "m",
                       "Of the voxel box above the lowest ground, at first"),
           keys.number("height_max_m", &P::height_max_m, 0, 500, "m",
                       "The box grows up to this height when scans see higher than it; "
                       "`height_m` or less: it never grows"),
           keys.number("gain_min_voxels", &P::gain_min_voxels, 1, 1e9, "voxels",
                       "Stop when no view would see this many boundary unseen voxels"),
           keys.number("views_max", &P::views_max, 0, 100'000, "",
                       "At most this many next best views; 0: Phase I only"),
           keys.other("carve_no_return", &P::carve_no_return,
                      "Beams that hit nothing show empty space up to the maximum range"),
           keys.other("foliage", &P::foliage,
                      "Views look through seen-occupied voxels that most beams pass, such as "
                      "thin vegetation"),
           keys.number("foliage_share_min", &P::foliage_share_min, 0.5, 1, "share",
                       "Of the beams into such a voxel that must have passed it"),
           keys.other("choose", &P::choose,
                      "The view that sees the most, or the most for the minutes that road (or "
                      "setting up) and scan take",
                      {"gain", "gain_per_minute"}),
           keys.number("views_ahead", &P::views_ahead, 0, 100, "",
                       "How many views the decision log looks ahead, with what each would add"),
           keys.number("density_min_ppm2", &P::density_min_ppm2, 0, 1e6, "points/m2",
                       "Surfaces that no scan put as many points on are worth seeing again; 0: no "
                       "such goal")},
          {},
          {}};
}

SectionSpec localize_section() {
  using L = LocalizeConfig;
  const Keys<L> keys{[](MissionConfig& c) -> L& { return c.localize; }};
  return {ConfigFile::mission,
          "localize",
          "Where the robot is.",
          {keys.other("match_map", &L::match_map,
                      "Lay the walls that a scan shows over those of the map: where satellites "
                      "are not seen, that holds the robot to the map"),
           keys.number("sigma_max_m", &L::sigma_max_m, 0.05, 1000, "m",
                       "1 sigma of the position, along its worse axis, beyond which the robot "
                       "stands: it no longer knows where it is")},
          {},
          {}};
}

SectionSpec register_section() {
  using R = RegisterConfig;
  const Keys<R> keys{[](MissionConfig& c) -> R& { return c.registration; }};
  return {ConfigFile::mission,
          "register",
          "Where scans really stood, by laying them over each other.",
          {keys.other("scans", &R::scans,
                      "Lay every scan over those that it overlaps; its pose is corrected by what "
                      "fits, and a scan that contradicts them is not merged"),
           keys.number("references_max", &R::references_max, 1, 50, "",
                       "Over so many scans at most, those that it overlaps most"),
           keys.number("in_hand_max", &R::in_hand_max, 1, 10'000, "",
                       "Thinned scans kept in memory to lay others over, about 3 MB each; then the "
                       "oldest goes"),
           keys.number("overlap_min", &R::overlap_min, 0.05, 1, "share",
                       "Of a scan's surface that another must show for the two to be tried"),
           keys.number("rms_max_m", &R::rms_max_m, 0.001, 1, "m",
                       "Of distances between surfaces; with more, two scans do not fit"),
           keys.other("retake", &R::retake, "Take a scan that is refused once more"),
           keys.other("tour_end", &R::tour_end,
                      "When a tour closes, and at the end, find the poses that fit all pairs of "
                      "scans best and fill the map anew from them")},
          {},
          {}};
}

SectionSpec disk_section() {
  using D = DiskConfig;
  const Keys<D> keys{[](MissionConfig& c) -> D& { return c.disk; }};
  return {ConfigFile::mission,
          "disk",
          "A disk that does not take what has to be kept: the robot stands, and goes on as soon as "
          "it does.",
          {keys.number("patience_s", &D::patience_s, 1, 540, "s",
                       "That it may fail without a break; then the mission ends, and can be "
                       "resumed"),
           keys.other("then", &D::then,
                      "Where it ends: where the robot stands, or at its start, to which it drives "
                      "without the disk, also when that works again on the way",
                      {"stands", "home"})},
          {},
          {}};
}

SectionSpec regions_section() {
  return {ConfigFile::mission,
          "regions",
          "Who scans which region of the map: `name = \"robot\"`, `\"manual\"` (a person carries "
          "the scanner there) or `\"skip\"`. A region that is not named is scanned by the robot if "
          "it starts there, and by hand otherwise.",
          {},
          {"robot", "manual", "skip"},
          {}};
}

SectionSpec robot_section() {
  using R = RobotConfig;
  const Keys<R> keys{[](MissionConfig& c) -> R& { return c.robot; }};
  return {ConfigFile::robot,
          "",
          "Which robot.",
          {keys.other("name", &R::name, "What reports call the robot"),
           keys.other("backend", &R::backend,
                      "What carries it out: a simulated world, or the devices "
                      "that the links lead to",
                      {"sim", "hardware"})},
          {},
          {}};
}

SectionSpec body_section() {
  using B = BodyConfig;
  const Keys<B> keys{[](MissionConfig& c) -> B& { return c.robot.body; }};
  return {
      ConfigFile::robot,
      "body",
      "Its size and speed.",
      {keys.number("radius_m", &B::radius_m, 0.05, 5, "m",
                   "Of the circle that holds the whole robot"),
       keys.number("track_m", &B::track_m, 0.05, 5, "m", "Between left and right wheels"),
       keys.number("speed_max_mps", &B::speed_max_mps, 0.01, 10, "m/s", "Driving straight"),
       keys.number("turn_max_degps", &B::turn_max_degps, 1, 360, "deg/s", "Turning"),
       keys.number("slope_max_deg", &B::slope_max_deg, 1, 45, "deg",
                   "Steepest ground that it drives on; what scans show to be steeper is closed "
                   "to it"),
       keys.number("step_max_m", &B::step_max_m, 0.03, 1, "m",
                   "Highest step that it drives up or down, likewise; a step that is no steeper "
                   "than `slope_max_deg` over 0.25 m counts as a slope")},
      {},
      {}};
}

SectionSpec drive_section() {
  using D = DriveConfig;
  const Keys<D> keys{[](MissionConfig& c) -> D& { return c.robot.drive; }};
  return {ConfigFile::robot,
          "drive",
          "What moves it.",
          {keys.other("device", &D::device, "An AgileX base, or two CiA 402 drives",
                      {"agilex-scout2", "agilex-scout-mini", "agilex-bunker", "cia402"}),
           keys.other("link", &D::link, "Where it is: can:can0, gs_usb:SERIAL/CHANNEL@500000"),
           keys.number("left_node", &D::left_node, 1, 126, "", "Node id of a CiA 402 drive"),
           keys.number("right_node", &D::right_node, 1, 126, "", "The same on the right"),
           keys.number("left_units_per_mps", &D::left_units_per_mps, -1e9, 1e9, "",
                       "Of its velocity; negative where the motor is mirrored"),
           keys.number("right_units_per_mps", &D::right_units_per_mps, -1e9, 1e9, "",
                       "The same on the right"),
           keys.number("left_counts_per_m", &D::left_counts_per_m, -1e9, 1e9, "",
                       "Of its position; negative where the motor is mirrored"),
           keys.number("right_counts_per_m", &D::right_counts_per_m, -1e9, 1e9, "",
                       "The same on the right")},
          {},
          {}};
}

SectionSpec pan_section() {
  using P = PanConfig;
  const Keys<P> keys{[](MissionConfig& c) -> P& { return c.robot.pan; }};
  return {ConfigFile::robot,
          "pan",
          "What turns the profile scanner.",
          {keys.other("device", &P::device, "A FLIR PTU", {"flir-ptu"}),
           keys.other("link", &P::link, "Where it is: serial:/dev/ttyUSB0@9600, tcp:HOST:4000"),
           keys.number("angle_max_deg", &P::angle_max_deg, 10, 360, "deg",
                       "To both sides; 159 where there is no slip ring"),
           keys.other("counter_clockwise", &P::counter_clockwise,
                      "Whether positive positions turn that way seen from above"),
           keys.other("stop_and_go", &P::stop_and_go,
                      "Stand still for every profile instead of turning evenly"),
           keys.number("late_s", &P::late_s, -1, 1, "s",
                       "How much later than the scanner's the unit's times are; found by scanning "
                       "both ways")},
          {},
          {}};
}

SectionSpec obstacles_section() {
  using O = ObstaclesConfig;
  const Keys<O> keys{[](MissionConfig& c) -> O& { return c.robot.obstacles; }};
  return {
      ConfigFile::robot,
      "obstacles",
      "What looks ahead while the robot drives: it slows down and stops for what is in the way, "
      "waits, and goes round.",
      {keys.other("device", &O::device,
                  "A Hokuyo that looks level; the `[scanner]` itself, where that is a VLP-16 or an "
                  "Ouster: then "
                  "of these keys only `patience_s` counts; or none",
                  {"none", "hokuyo", "scanner"}),
       keys.other("link", &O::link, "Where it is: tcp:HOST:10940, serial:/dev/ttyACM2@115200"),
       keys.other("model", &O::model, "How what it says it is begins, such as `UST-20LX`"),
       keys.number("height_m", &O::height_m, 0.02, 3, "m",
                   "Above the ground: it sees nothing lower"),
       keys.number("offset_x_m", &O::offset_x_m, -2, 2, "m", "Ahead of the robot's middle"),
       keys.number("patience_s", &O::patience_s, 0, 600, "s",
                   "What is in the way for longer is gone round")},
      {},
      {}};
}

SectionSpec imu_section() {
  using I = ImuConfig;
  const Keys<I> keys{[](MissionConfig& c) -> I& { return c.robot.imu; }};
  return {ConfigFile::robot,
          "imu",
          "What feels turning.",
          {keys.other("device", &I::device, "A VectorNav VN-100", {"vn100"}),
           keys.other("link", &I::link, "Where it is: serial:/dev/ttyUSB1@115200")},
          {},
          {}};
}

SectionSpec gnss_section() {
  using G = GnssConfig;
  const Keys<G> keys{[](MissionConfig& c) -> G& { return c.robot.gnss; }};
  return {ConfigFile::robot,
          "gnss",
          "What hears satellites.",
          {keys.other("device", &G::device, "A u-blox, any NMEA receiver, or a gpsd",
                      {"ublox", "nmea", "gpsd"}),
           keys.other("link", &G::link, "Where it is: serial:/dev/ttyACM0@38400, tcp:HOST:2947")},
          {},
          {}};
}

SectionSpec corrections_section() {
  using C = CorrectionsConfig;
  const Keys<C> keys{[](MissionConfig& c) -> C& { return c.robot.corrections; }};
  return {
      ConfigFile::robot,
      "corrections",
      "Where a u-blox receiver gets its corrections (RTCM 3); without them a fix is good to a "
      "metre or two.",
      {keys.other("device", &C::device, "A caster that speaks NTRIP, or none", {"none", "ntrip"}),
       keys.other("link", &C::link, "Where the caster is: tcp:HOST:2101"),
       keys.other("mountpoint", &C::mountpoint, "Which of its streams; RTCM 3, within 30 km"),
       keys.other("account", &C::account,
                  "File with one line USER:PASSWORD, which only its owner may read, relative to "
                  "this file; without it none are sent"),
       keys.number("version", &C::version, 1, 2, "", "Of NTRIP that the caster is asked in"),
       keys.other("tells_position", &C::tells_position,
                  "Whether the mountpoint must be told where the robot is, as one of a network "
                  "(VRS) must")},
      {},
      {}};
}

SectionSpec power_section() {
  using P = PowerConfig;
  const Keys<P> keys{[](MissionConfig& c) -> P& { return c.robot.power; }};
  return {ConfigFile::robot,
          "power",
          "Supply, relays and safety inputs over Modbus; leave out what the robot has not.",
          {keys.other("battery_link", &P::battery_link,
                      "A Victron battery service: modbus-tcp:HOST:502/UNIT"),
           keys.other("board_link", &P::board_link,
                      "A Waveshare relay board: modbus-rtu:/dev/ttyUSB2@9600N/UNIT"),
           keys.other("safety_link", &P::safety_link, "A Pilz PNOZmulti: modbus-tcp:HOST:502/1")},
          {},
          {}};
}

SectionSpec console_section() {
  using O = ConsoleConfig;
  const Keys<O> keys{[](MissionConfig& c) -> O& { return c.robot.console; }};
  return {ConfigFile::robot,
          "console",
          "Where an operator may sit; without these keys there is no console.",
          {keys.other("serial", &O::serial, "A serial port, 115200 8N1: /dev/ttyS0"),
           keys.other("socket", &O::socket,
                      "A UNIX socket for `vantage console`: /run/vantage/console.sock"),
           keys.other("password", &O::password,
                      "File that keeps the password's argon2id hash; made by `set-password`")},
          {},
          {}};
}

SectionSpec scanner_section() {
  using S = ScannerConfig;
  const Keys<S> keys{[](MissionConfig& c) -> S& { return c.robot.scanner; }};
  return {ConfigFile::robot,
          "scanner",
          "What one scan sees.",
          {keys.number("height_m", &S::height_m, 0.05, 20, "m", "Above the ground"),
           keys.number("range_min_m", &S::range_min_m, 0, 100, "m", "Nothing nearer is measured"),
           keys.number("range_max_m", &S::range_max_m, 0.5, 2000, "m", "Nothing farther"),
           keys.number("grazing_max_deg", &S::grazing_max_deg, 1, 90, "deg",
                       "Largest angle between beam and surface normal that gives good points"),
           keys.number("fov_deg", &S::fov_deg, 1, 360, "deg", "Horizontal, centred ahead"),
           keys.number("azimuth_step_deg", &S::azimuth_step_deg, 0.005, 10, "deg",
                       "Between neighbouring columns of beams"),
           keys.number("elevation_min_deg", &S::elevation_min_deg, -90, 90, "deg",
                       "Lowest beam; 0 is the horizon"),
           keys.number("elevation_max_deg", &S::elevation_max_deg, -90, 90, "deg", "Highest beam"),
           keys.number("elevation_step_deg", &S::elevation_step_deg, 0.005, 10, "deg",
                       "Between neighbouring beams of a column"),
           keys.number("scan_s", &S::scan_s, 0, 86'400, "s",
                       "Time one scan takes, for plans; the devices take what they take"),
           keys.other("device", &S::device, "What measures",
                      {"sick-lms5xx", "sick-lms1xx", "hokuyo", "vlp16", "ouster"}),
           keys.other("link", &S::link,
                      "Where it is: tcp:HOST:PORT, serial:/dev/ttyACM1@115200, or udp:PORT for "
                      "vlp16 and ouster, which need no pan unit"),
           keys.other("model", &S::model,
                      "Of a Hokuyo: how what it says it is begins, such as `UST-20LX`"),
           keys.other("api_link", &S::api_link,
                      "Of an Ouster: where it serves its settings, tcp:HOST:80; without it they "
                      "are not asked, and what the metadata file says is believed"),
           keys.other("metadata", &S::metadata,
                      "Of an Ouster: file with what it serves at /api/v1/sensor/metadata, relative "
                      "to this file"),
           keys.number("tilt_deg", &S::tilt_deg, -90, 180, "deg",
                       "How high a profile scanner's straight ahead looks; 90 is up"),
           keys.number("roll_deg", &S::roll_deg, -10, 10, "deg",
                       "How far a profile scanner leans over to the right"),
           keys.number("yaw_deg", &S::yaw_deg, -180, 180, "deg",
                       "How far a profile scanner is turned to the left when the pan unit is at 0"),
           keys.number("offset_x_m", &S::offset_x_m, -2, 2, "m",
                       "Of a profile scanner's origin ahead of the pan axis"),
           keys.number("offset_y_m", &S::offset_y_m, -2, 2, "m", "The same to the left"),
           keys.number("offset_z_m", &S::offset_z_m, -2, 2, "m",
                       "The same upwards, where height_m is not of its origin")},
          {},
          {}};
}

SectionSpec battery_section() {
  using B = BatteryConfig;
  const Keys<B> keys{[](MissionConfig& c) -> B& { return c.robot.battery; }};
  return {ConfigFile::robot,
          "battery",
          "What plans and missions reckon with. Watts are all that the robot draws in that state, "
          "computers and scanner included.",
          {keys.number("capacity_wh", &B::capacity_wh, 1, 1e6, "Wh", "That may be used up"),
           keys.number("drive_w", &B::drive_w, 0, 1e5, "W", "While driving"),
           keys.number("scan_w", &B::scan_w, 0, 1e5, "W", "Standing, while the robot scans"),
           keys.number("idle_w", &B::idle_w, 0, 1e5, "W",
                       "Standing, while a person carries the scanner and scans"),
           keys.number("reserve_share", &B::reserve_share, 0, 0.9, "share",
                       "Of the capacity that a mission keeps at every decision, besides what the "
                       "way home takes")},
          {},
          {}};
}

SectionSpec sim_section() {
  using S = SimConfig;
  const Keys<S> keys{[](MissionConfig& c) -> S& { return c.robot.sim; }};
  return {ConfigFile::robot,
          "sim",
          "How the simulated world misbehaves; one-sigma values.",
          {keys.number("range_sigma_m", &S::range_sigma_m, 0, 1, "m", "Noise of a range"),
           keys.number("slip_sigma", &S::slip_sigma, 0, 0.5, "share",
                       "Of the travel of each side that the wheels slip"),
           keys.number("gyro_sigma_degps", &S::gyro_sigma_degps, 0, 10, "deg/s",
                       "Noise of a gyro sample"),
           keys.number("gyro_bias_degps", &S::gyro_bias_degps, 0, 10, "deg/s", "Bias of the gyro"),
           keys.number("gnss_sigma_m", &S::gnss_sigma_m, 0, 100, "m",
                       "Noise of a satellite fix, per axis"),
           keys.other("gnss_outage", &S::gnss_outage,
                      "Region of the map in which no satellite is seen, as in a courtyard; empty: "
                      "none"),
           keys.number("placement_sigma_m", &S::placement_sigma_m, 0, 10, "m",
                       "Survey error of a scanner set up by hand"),
           keys.number("placement_heading_sigma_deg", &S::placement_heading_sigma_deg, 0, 45, "deg",
                       "The same for its heading"),
           keys.number("placement_s", &S::placement_s, 0, 86'400, "s",
                       "Time to carry the scanner to a station and set it up"),
           keys.number("people", &S::people, 0, 100, "",
                       "Who walk about in the area where the robot starts")},
          {},
          {}};
}

SectionSpec plan_section() {
  using P = SavedPlan;
  const Keys<P> keys{[](MissionConfig& c) -> P& { return c.plan; }};
  return {ConfigFile::plan,
          "",
          "Stations chosen before, by `vantage rehearse` or `vantage plan --out`.",
          {keys.other("site", &P::site, "Name of the site that they were chosen on"),
           keys.other("made_by", &P::made_by, "What chose them"),
           keys.number("seed", &P::seed, 0, kSeedMax, "", "With which seed")},
          {},
          {}};
}

SectionSpec station_section() {
  using S = SavedStation;
  const Keys<S> keys{[](MissionConfig& c) -> S& { return c.plan.stations.back(); }};
  return {ConfigFile::plan,
          "station",
          "One place to scan from; `[[station]]` for each. Within an area they count in the order "
          "of the file; the tour visits them in the order that is shortest.",
          {keys.other("area", &S::area, "The free area that it stands in; must be given"),
           keys.other("name", &S::name, "What reports call it; default: the area and a number"),
           keys.number("x_m", &S::x_m, -1e6, 1e6, "m", "East; must be given"),
           keys.number("y_m", &S::y_m, -1e6, 1e6, "m", "North; must be given"),
           keys.number("heading_deg", &S::heading_deg, -360, 360, "deg",
                       "Of the scanner, from east to north")},
          {},
          [](MissionConfig& c, const ConfigPlace& place) {
            c.plan.stations.emplace_back().place = place;
          }};
}

std::string value_text(const Slot& slot) {
  const auto text = [](const auto* value) -> std::string {
    using T = std::remove_cvref_t<decltype(*value)>;
    if constexpr (std::is_same_v<T, std::filesystem::path>)
      return value->generic_string();
    else
      return fmt::format("{}", *value);
  };
  return std::visit(text, slot);
}

std::string type_text(const KeySpec& spec, const Slot& slot) {
  if (std::holds_alternative<bool*>(slot)) return "`true` or `false`";
  if (std::holds_alternative<std::filesystem::path*>(slot)) return "path";
  if (std::holds_alternative<std::string*>(slot)) {
    std::string text;
    for (const auto& choice : spec.choices)
      text += (text.empty() ? "`\"" : " or `\"") + choice + "\"`";
    return text.empty() ? "text" : text;
  }
  const bool whole = !std::holds_alternative<double*>(slot);
  if (spec.max >= kSeedMax) return fmt::format("whole number, {} or more", spec.min);
  return fmt::format("{}{} to {}", whole ? "whole number, " : "", spec.min, spec.max);
}

std::string heading(const SectionSpec& section) {
  const std::string brackets =
      section.add_entry ? fmt::format("[[{}]]", section.name) : fmt::format("[{}]", section.name);
  if (!section.name.empty()) return fmt::format("### `{}`\n\n{}\n\n", brackets, section.help);
  const std::string title = section.file == ConfigFile::mission ? "Mission file"
                            : section.file == ConfigFile::robot ? "Robot file"
                                                                : "Plan file";
  return fmt::format("## {}\n\n{} These keys stand above the first `[table]`.\n\n", title,
                     section.help);
}

}  // namespace

std::string_view name(ConfigFile file) {
  return file == ConfigFile::mission ? "mission" : file == ConfigFile::robot ? "robot" : "plan";
}

const std::vector<SectionSpec>& config_schema() {
  static const std::vector<SectionSpec> schema{
      mission_section(),   phase1_section(),  phase2_section(),  localize_section(),
      register_section(),  disk_section(),    regions_section(), robot_section(),
      body_section(),      drive_section(),   scanner_section(), pan_section(),
      obstacles_section(), imu_section(),     gnss_section(),    corrections_section(),
      power_section(),     console_section(), battery_section(), sim_section(),
      plan_section(),      station_section()};
  return schema;
}

std::string member_path(const SectionSpec& section, std::string_view key) {
  std::string path =
      section.file == ConfigFile::mission ? "" : fmt::format("{}.", name(section.file));
  if (!section.name.empty()) path += section.name + ".";
  return path.append(key);
}

std::string config_reference() {
  MissionConfig defaults;
  std::string text;
  for (const auto& section : config_schema()) {
    text += heading(section);
    if (section.keys.empty()) continue;
    if (section.add_entry) section.add_entry(defaults, {});
    text += "| key | unit | allowed | default | meaning |\n|---|---|---|---|---|\n";
    for (const auto& spec : section.keys) {
      const Slot slot = spec.slot(defaults);
      const std::string value = value_text(slot);
      const bool none = value.empty() || value == "nan";
      text += fmt::format("| `{}` | {} | {} | {} | {} |\n", spec.key, spec.unit,
                          type_text(spec, slot), none ? "" : "`" + value + "`", spec.help);
    }
    text += "\n";
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

std::vector<EffectiveValue> effective_values(const MissionConfig& config) {
  MissionConfig copy = config;  // Slots point into something that may be written.
  std::vector<EffectiveValue> values;
  const auto origin = [&](const std::string& path) -> std::string {
    const auto found = config.written.find(path);
    if (found == config.written.end()) return "default";
    const auto& place = found->second;
    return place.line > 0 ? fmt::format("{}:{}", place.file, place.line) : place.file;
  };
  for (const auto& section : config_schema())
    for (const auto& spec : section.keys) {
      if (section.file == ConfigFile::plan) continue;  // As many as there are stations.
      const auto path = member_path(section, spec.key);
      values.push_back({path, value_text(spec.slot(copy)), spec.unit, origin(path)});
    }
  for (const auto& [region, mode] : config.regions)
    values.push_back({"regions." + region, mode, "", origin("regions." + region)});
  return values;
}

}  // namespace mission
