// vantage localize: where the robot was, from recorded logs.
#include <fmt/format.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "hal/angles.hpp"
#include "nav/localizer.hpp"
#include "nav/smoother.hpp"
#include "nav/start_finder.hpp"
#include "tools/vantage_command.hpp"
#include "tools/vantage_localize_logs.hpp"

namespace vantage {
namespace {

using hal::kDeg;

namespace json = boost::json;

constexpr double kStartSigma_m = 0.05, kStartSigmaRad = 1 * kDeg;  // Of a surveyed start.

struct LocalizeOptions {
  std::filesystem::path odometry, imu, gnss, out;
  std::vector<double> start, origin, antenna;
  double imu_offset_s = 0, gnss_offset_s = 0;
  bool json = false, smooth = false;
  nav::LocalizerConfig config;
};

struct Outcome {
  std::string tum;
  std::size_t poses{}, fixes{}, refused{}, resets{};
  std::optional<double> start_s;  // After the first event; of a start that had to be found.
  std::vector<nav::LocalizerFault> faults;  // At the end.
  hal::Pose2 last;
  Eigen::Vector3d sigma{0, 0, 0};
  std::string waiting_for;  // Nothing came of it: no start.
};

// Follows one log after its start is known.
class Follower {
 public:
  Follower(const nav::LocalizerConfig& config, const logs::Clock& clock, bool smooth)
      : config_(config), clock_(clock), finder_(config, {}), smooth_(smooth) {}

  void start(const hal::Pose2& pose, const Eigen::Matrix3d& covariance) {
    start_ = {pose, covariance};
    localizer_.emplace(config_, pose, covariance);
  }

  void add(const nav::LocalizerEvent& event) {
    if (!localizer_) return find_start(event);
    const auto correction = localizer_->add(event);
    if (std::holds_alternative<nav::GnssPosition>(event)) {
      ++outcome_.fixes;
      outcome_.refused += correction.gate == nav::Gate::rejected;
      outcome_.resets += correction.gate == nav::Gate::reset;
    }
    if (smooth_)
      followed_.push_back(event);
    else if (std::holds_alternative<hal::WheelTravel>(event))
      write(nav::stamp_of(event), localizer_->T_W_B());
  }

  Outcome take() {
    if (!localizer_) {
      outcome_.waiting_for = finder_.waiting_for();
      return std::move(outcome_);
    }
    if (smooth_)
      for (const auto& pose : nav::smooth(config_, start_.pose, start_.covariance, followed_).poses)
        write(pose.stamp, pose.T_W_B);
    outcome_.faults = localizer_->faults();
    outcome_.last = localizer_->pose();
    outcome_.sigma = localizer_->covariance().diagonal().cwiseSqrt();
    return std::move(outcome_);
  }

 private:
  void find_start(const nav::LocalizerEvent& event) {
    finder_.add(event);
    if (!std::holds_alternative<nav::GnssPosition>(event)) return;
    const auto found = finder_.found();
    if (!found) return;
    outcome_.start_s = hal::seconds(found->stamp);
    start(found->pose, found->covariance);
  }

  void write(hal::Time stamp, const Eigen::Isometry3d& T) {
    const Eigen::Quaterniond q(T.linear());
    outcome_.tum +=
        fmt::format("{:.6f} {:.4f} {:.4f} {:.4f} {:.6f} {:.6f} {:.6f} {:.6f}\n",
                    clock_.zero_s + hal::seconds(stamp), T.translation().x(), T.translation().y(),
                    T.translation().z(), q.x(), q.y(), q.z(), q.w());
    ++outcome_.poses;
  }

  nav::LocalizerConfig config_;
  logs::Clock clock_;
  nav::StartFinder finder_;
  bool smooth_;
  struct {
    hal::Pose2 pose;
    Eigen::Matrix3d covariance;
  } start_;
  std::optional<nav::Localizer> localizer_;
  std::vector<nav::LocalizerEvent> followed_;  // Since the start, where they are smoothed.
  Outcome outcome_;
};

json::object outcome_json(const Outcome& outcome) {
  json::array faults;
  for (const auto& fault : outcome.faults) faults.push_back(json::string(fault.text));
  json::object object{{"poses", outcome.poses},
                      {"fixes", outcome.fixes},
                      {"fixes_refused", outcome.refused},
                      {"resets", outcome.resets},
                      {"faults", faults},
                      {"x_m", outcome.last.position_m.x()},
                      {"y_m", outcome.last.position_m.y()},
                      {"heading_deg", outcome.last.heading_rad / kDeg},
                      {"sigma_x_m", outcome.sigma.x()},
                      {"sigma_y_m", outcome.sigma.y()},
                      {"sigma_heading_deg", outcome.sigma.z() / kDeg}};
  if (outcome.start_s) object["start_found_after_s"] = *outcome.start_s;
  return object;
}

std::string outcome_text(const Outcome& outcome) {
  std::string text;
  if (outcome.start_s)
    text += fmt::format("start found from fixes after {:.1f} s\n", *outcome.start_s);
  text += fmt::format("{} poses; {} satellite fixes, {} refused, {} resets\n", outcome.poses,
                      outcome.fixes, outcome.refused, outcome.resets);
  text += fmt::format(
      "at the end x {:.3f} y {:.3f} m, heading {:.2f} deg; sigma {:.3f} {:.3f} m, "
      "{:.2f} deg\n",
      outcome.last.position_m.x(), outcome.last.position_m.y(), outcome.last.heading_rad / kDeg,
      outcome.sigma.x(), outcome.sigma.y(), outcome.sigma.z() / kDeg);
  for (const auto& fault : outcome.faults) text += fault.text + "\n";
  return text;
}

int localize_command(LocalizeOptions options) {
  if (options.start.empty() && options.gnss.empty())
    throw Refusal("no start: give --start x y heading, or --gnss to find it while driving");
  if (!options.antenna.empty())
    options.config.B_antenna_m << options.antenna[0], options.antenna[1], options.antenna[2];
  logs::Geo geo;
  if (!options.origin.empty())
    geo.anchor = {options.origin[0], options.origin[1], options.origin[2], 0};
  std::vector<std::vector<logs::Timed>> all{
      logs::read_odometry(options.odometry, options.config.track_m)};
  if (!options.imu.empty()) all.push_back(logs::read_imu(options.imu, options.imu_offset_s));
  if (!options.gnss.empty())
    all.push_back(logs::read_gnss(options.gnss, options.gnss_offset_s, geo));
  logs::Clock clock;
  const auto events = logs::stamped(std::move(all), clock);
  Follower follower(options.config, clock, options.smooth);
  if (!options.start.empty())
    follower.start(
        {{options.start[0], options.start[1]}, options.start[2] * kDeg},
        Eigen::Vector3d(kStartSigma_m, kStartSigma_m, kStartSigmaRad).cwiseAbs2().asDiagonal());
  for (const auto& event : events) follower.add(event);
  const Outcome outcome = follower.take();
  if (!outcome.waiting_for.empty()) {
    fmt::print(stderr, "vantage: no start found: {}\n", outcome.waiting_for);
    return kFailed;
  }
  write_product(options.out, outcome.tum);
  if (options.json)
    print_json(outcome_json(outcome));
  else
    fmt::print("{}", outcome_text(outcome));
  return kFine;
}

void add_files(CLI::App& command, LocalizeOptions& options) {
  command.add_option("--odometry", options.odometry, "CSV of wheel travel or speeds")->required();
  command.add_option("--imu", options.imu, "CSV, or what a VN-100 sent (binary)");
  command.add_option("--gnss", options.gnss, "CSV, or what a receiver sent (UBX, NMEA)");
  command.add_option("--out", options.out, "Trajectory in TUM format, one pose a row of odometry")
      ->required();
  command.add_option("--start", options.start, "Surveyed start: x y (m) heading (deg from x)")
      ->expected(3);
  command
      .add_option("--origin", options.origin,
                  "W's origin: latitude longitude (deg) height (m); default: the first fix")
      ->expected(3);
  command.add_flag("--smooth", options.smooth,
                   "Each pose also with what came after it, to the end of the logs");
}

}  // namespace

void add_localize_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<LocalizeOptions>();
  auto* command = app.add_subcommand("localize", "Finds where the robot was, from recorded logs");
  command->footer(
      "Columns (a header names them; times of one clock, in seconds):\n"
      "  odometry  time_s left_m right_m            travel of each side since the row before\n"
      "       or   time_s forward_mps turn_radps    speeds since the row before\n"
      "  imu       time_s yaw_rate_radps\n"
      "       or   time_s rate_x_radps rate_y_radps rate_z_radps [accel_x_mps2 ...y... ...z...]\n"
      "  gnss      time_s x_m y_m sigma_m           in W, sigma per axis\n"
      "       or   time_s latitude_deg longitude_deg sigma_m\n"
      "            [velocity_x_mps velocity_y_mps velocity_sigma_mps]\n"
      "Receivers' times are UTC since 1970, a VN-100's are since it was switched on: bring them "
      "to\n"
      "the odometry's clock with --gnss-offset and --imu-offset.\n"
      "Examples:\n"
      "  vantage localize --odometry wheels.csv --imu gyro.csv --gnss fixes.csv --out way.tum\n"
      "  vantage localize --odometry wheels.csv --gnss rover.ubx --start 0 0 90 --out way.tum\n"
      "Exit: 0 fine, 1 no start found, 2 bad input.");
  add_files(*command, *options);
  command->add_option("--antenna", options->antenna, "On the body: x y z (m)")->expected(3);
  command->add_option("--track", options->config.track_m, "Between left and right wheels, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--slip", options->config.slip_sigma, "Of a side's travel, 1 sigma")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--imu-offset", options->imu_offset_s, "Added to its times, s");
  command->add_option("--gnss-offset", options->gnss_offset_s, "Added to its times, s");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return localize_command(*options); }); };
  });
}

}  // namespace vantage
