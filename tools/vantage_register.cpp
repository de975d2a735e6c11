// vantage register: where one scan lies in the frame of another, and how far that can be trusted.
#include <fmt/format.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "hal/angles.hpp"
#include "mission/files.hpp"
#include "nav/registration/cloud_file.hpp"
#include "nav/registration/registration.hpp"
#include "planning/voxel_parallel.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

using hal::kDeg;

namespace json = boost::json;

struct RegisterOptions {
  std::filesystem::path reference, reading;
  std::vector<double> guess;  // x y z (m) roll pitch yaw (deg)
  bool merged = false, json = false;
  int threads = 0;
  nav::RegistrationConfig config;
};

nav::Points read_cloud(const std::filesystem::path& path) {
  const auto bytes = mission::read_file(path);
  if (!bytes) throw Refusal(bytes.error().text());
  const auto points = nav::parse_cloud(*bytes, path.string());
  if (points) return *points;
  const nav::CloudError& error = points.error();
  throw Refusal({{error.file, error.line, 0, error.what}});
}

Eigen::Isometry3d guess_of(const std::vector<double>& numbers) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (numbers.empty()) return T;
  T.translation() << numbers[0], numbers[1], numbers[2];
  T.linear() = (Eigen::AngleAxisd(numbers[5] * kDeg, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(numbers[4] * kDeg, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(numbers[3] * kDeg, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return T;
}

Eigen::Vector3d roll_pitch_yaw_deg(const Eigen::Matrix3d& R) {
  return Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)),
                         std::atan2(R(1, 0), R(0, 0))) /
         kDeg;
}

json::array numbers(const auto& values) {
  json::array array;
  for (const double value : values) array.push_back(value);
  return array;
}

json::array axes_json(const std::array<nav::HeldAxis, 3>& axes, const char* sigma, double unit) {
  json::array array;
  for (const nav::HeldAxis& axis : axes)
    array.push_back(json::object{{"direction", numbers(axis.direction)},
                                 {"strength", axis.strength},
                                 {sigma, axis.sigma / unit},
                                 {"free", axis.is_free}});
  return array;
}

json::object result_json(const nav::Registration& r) {
  json::array rows;
  for (int row = 0; row < 4; ++row)
    rows.push_back(numbers(Eigen::Vector4d(r.T_reference_reading.matrix().row(row))));
  return {{"verdict", std::string(nav::name(r.verdict))},
          {"reason", r.reason},
          {"T_reference_reading", rows},
          {"translation_m", numbers(Eigen::Vector3d(r.T_reference_reading.translation()))},
          {"roll_pitch_yaw_deg", numbers(roll_pitch_yaw_deg(r.T_reference_reading.linear()))},
          {"rms_m", r.rms_m},
          {"cloud_to_cloud_m", r.cloud_to_cloud_m},
          {"overlap_percent", 100 * r.overlap},
          {"fit_percent", 100 * r.fit},
          {"conflict_percent", 100 * r.conflict},
          {"moved_m", r.moved_m},
          {"moved_deg", r.moved_rad / kDeg},
          {"pairs", r.pairs},
          {"steps", r.steps},
          {"guess_tried", r.guess_tried},
          {"shift", axes_json(r.shift, "sigma_m", 1)},
          {"turn", axes_json(r.turn, "sigma_deg", kDeg)}};
}

std::string axes_text(const std::array<nav::HeldAxis, 3>& axes, std::string_view along,
                      std::string_view unit_name, double unit) {
  std::string text;
  for (const nav::HeldAxis& axis : axes)
    text += fmt::format("  {} {:<20} strength {:5.3f}   sigma {:.4f} {}{}\n", along,
                        nav::in_words(axis.direction), axis.strength, axis.sigma / unit, unit_name,
                        axis.is_free ? "   FREE: stands where the guess had it" : "");
  return text;
}

std::string result_text(const nav::Registration& r) {
  const Eigen::Vector3d t = r.T_reference_reading.translation();
  const Eigen::Vector3d angles = roll_pitch_yaw_deg(r.T_reference_reading.linear());
  std::string text =
      fmt::format("{}{}{}\n", nav::name(r.verdict), r.reason.empty() ? "" : ": ", r.reason);
  text += fmt::format("x y z            {:.4f} {:.4f} {:.4f} m\n", t.x(), t.y(), t.z());
  text += fmt::format("roll pitch yaw   {:.4f} {:.4f} {:.4f} deg\n", angles.x(), angles.y(),
                      angles.z());
  text += fmt::format("from the guess   {:.3f} m {:.2f} deg\n", r.moved_m, r.moved_rad / kDeg);
  text += fmt::format(
      "RMS {:.4f} m   cloud to cloud {:.4f} m   overlap {:.0f} %   in plane {:.0f} %   "
      "conflict {:.1f} %\n",
      r.rms_m, r.cloud_to_cloud_m, 100 * r.overlap, 100 * r.fit, 100 * r.conflict);
  text += axes_text(r.shift, "along", "m", 1) + axes_text(r.turn, "about", "deg", kDeg);
  return text;
}

nav::RunPieces on_threads(int threads) {
  if (threads == 0) threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return [threads](std::size_t count, const std::function<void(std::size_t)>& work) {
    planning::for_pieces(threads, count, 1,
                         [&](int, std::size_t begin, std::size_t) { work(begin); });
  };
}

int register_command(RegisterOptions options) {
  options.config.scanner_at_origin = !options.merged;
  const auto run = on_threads(options.threads);
  const nav::PreparedScan reference(read_cloud(options.reference), options.config, run);
  const nav::PreparedScan reading(read_cloud(options.reading), options.config, run,
                                  nav::PreparedScan::Use::reading_only);
  const auto result =
      nav::register_scans(reference, reading, guess_of(options.guess), options.config, run);
  if (options.json)
    print_json(result_json(result));
  else
    fmt::print("{}", result_text(result));
  return result.verdict == nav::Verdict::refused ? kFailed : kFine;
}

}  // namespace

void add_register_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<RegisterOptions>();
  auto* command = app.add_subcommand(
      "register", "Finds where one scan lies in the frame of another, and judges the result");
  command->footer(
      "Files: PLY, PCD, CSV or XYZ; metres, in the frame of their scanner; returns nearer than "
      "--near are left out.\n"
      "Strength: 1 where surfaces face every way alike, 0 where the reading could slide.\n"
      "Examples:\n"
      "  vantage register scan1.ply scan2.ply\n"
      "  vantage register scan1.pcd scan2.pcd --guess 4.2 0.4 0 0 0 1.3 --json\n"
      "Exit: 0 accepted (or held in part), 1 refused, with the reason, 2 bad input.");
  command->add_option("reference", options->reference, "The scan that stays")->required();
  command->add_option("reading", options->reading, "The scan that is moved onto it")->required();
  command
      ->add_option("--guess", options->guess,
                   "Where the reading may lie: x y z (m) roll pitch yaw (deg); default: all 0")
      ->expected(6);
  command->add_option("--near", options->config.near_m, "Nearest range that is used, m")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command->add_option("--far", options->config.far_m, "Farthest range that is used, m")
      ->check(CLI::Range(1.0, 20000.0))
      ->capture_default_str();
  command->add_flag("--merged", options->merged,
                    "The clouds are not one scan each: do not judge by what hides what");
  command->add_option("--threads", options->threads, "0: as many as there are processors")
      ->check(CLI::Range(0, 256));
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return register_command(*options); }); };
  });
}

}  // namespace vantage
