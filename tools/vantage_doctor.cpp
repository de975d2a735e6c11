// vantage doctor: which devices of a robot are there, who they are, and what is wrong with them.
#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>

#include "drivers/real_clock.hpp"
#include "mission/main_links.hpp"
#include "mission/main_realtime.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct DoctorOptions {
  std::filesystem::path robot;
  double wait_s = 20;
  bool json = false;
};

std::string_view name(drivers::DeviceState state) {
  switch (state) {
    case drivers::DeviceState::off:
      return "off";
    case drivers::DeviceState::starting:
      return "starting";
    case drivers::DeviceState::running:
      return "running";
    case drivers::DeviceState::lost:
      return "lost";
  }
  return "";
}

mission::MissionConfig robot_config(const std::filesystem::path& file) {
  mission::LoadedMission loaded = mission::load_mission(
      {}, {.site_folder = {}, .robot_file = file, .has_seed = false, .seed = 0});
  // A robot alone needs no site.
  std::erase_if(loaded.errors, [&](const mission::ConfigError& error) {
    return std::filesystem::path(error.file) != file;
  });
  if (loaded.errors.empty()) loaded.errors = mission::robot_problems(loaded.config);
  if (loaded.errors.empty()) loaded.errors = mission::link_problems(loaded.config);
  if (!loaded.errors.empty()) throw Refusal(loaded.errors);
  return loaded.config;
}

// Links first: what is wrong with a cable explains what is wrong behind it.
std::vector<drivers::Trouble> troubles_of(const mission::NamedDevice& named,
                                          const mission::HardwareLinks& links) {
  std::vector<drivers::Trouble> all = links.troubles(named.role);
  const auto of_device = named.device->troubles();
  all.insert(all.end(), of_device.begin(), of_device.end());
  return all;
}

bool healthy(const mission::NamedDevice& named, const mission::HardwareLinks& links) {
  return named.device->state() == drivers::DeviceState::running &&
         troubles_of(named, links).empty();
}

void print_device(const mission::NamedDevice& named, const mission::HardwareLinks& links) {
  const drivers::Identity& who = named.device->identity();
  fmt::print("{:11} {:18} {:34} {}\n", named.role, named.device->model(), named.link,
             healthy(named, links) ? "healthy" : name(named.device->state()));
  if (!who.model.empty() || !who.maker.empty())
    fmt::print("         {} {}, serial {}, firmware {}\n", who.maker, who.model,
               who.serial.empty() ? "?" : who.serial, who.firmware.empty() ? "?" : who.firmware);
  if (const std::string condition = named.device->condition(); !condition.empty())
    fmt::print("         {}\n", condition);
  for (const drivers::Trouble& trouble : troubles_of(named, links))
    fmt::print("         {}{}{}\n           because: {}\n           do: {}\n", trouble.fault->name,
               trouble.detail.empty() ? "" : ": ", trouble.detail, trouble.fault->cause,
               trouble.fault->remedy);
}

boost::json::object device_json(const mission::NamedDevice& named,
                                const mission::HardwareLinks& links) {
  const drivers::Identity& who = named.device->identity();
  boost::json::array troubles;
  for (const drivers::Trouble& trouble : troubles_of(named, links))
    troubles.push_back(boost::json::object{{"name", trouble.fault->name},
                                           {"detail", trouble.detail},
                                           {"cause", trouble.fault->cause},
                                           {"remedy", trouble.fault->remedy}});
  return {{"role", named.role},
          {"device", named.device->model()},
          {"link", named.link},
          {"state", name(named.device->state())},
          {"healthy", healthy(named, links)},
          {"maker", who.maker},
          {"model", who.model},
          {"serial", who.serial},
          {"firmware", who.firmware},
          {"condition", named.device->condition()},
          {"troubles", std::move(troubles)}};
}

// Who uses how much memory: the doctor before and after it opened the devices, and every vantaged
// that runs here.
class Memory {
 public:
  Memory() { add("doctor at the start", getpid()); }
  void look() {
    add("doctor with all devices open", getpid());
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator("/proc", none)) {
      std::string name;
      std::getline(std::ifstream(entry.path() / "comm"), name);
      if (name != "vantaged") continue;
      const std::string id = entry.path().filename().string();
      add("vantaged " + id, std::stoi(id));
    }
  }
  void print() const {
    for (const auto& [who, use] : uses_) fmt::print("memory   {}: {}\n", who, text_of(use));
  }
  boost::json::array json() const {
    boost::json::array all;
    for (const auto& [who, use] : uses_)
      all.push_back(boost::json::object{{"who", who},
                                        {"resident_kb", use.resident_kb},
                                        {"peak_kb", use.peak_kb},
                                        {"locked_kb", use.locked_kb}});
    return all;
  }

 private:
  void add(const std::string& who, pid_t process) {
    if (const auto use = mission::memory_use(process)) uses_.emplace_back(who, *use);
  }
  std::vector<std::pair<std::string, mission::MemoryUse>> uses_;
};

// Until all devices are healthy, or time is up.
hal::Task<void> look(const mission::RobotDrivers& drivers, const mission::HardwareLinks& links,
                     hal::Clock& clock, double wait_s) {
  const hal::Time late = clock.now() + hal::from_seconds(wait_s);
  const auto all_healthy = [&] {
    return std::ranges::all_of(drivers.devices(),
                               [&](const auto& named) { return healthy(named, links); });
  };
  while (clock.now() < late && !all_healthy())
    co_await clock.sleep_for(std::chrono::milliseconds(100));
}

int diagnose(const DoctorOptions& options) {
  const mission::MissionConfig config = robot_config(options.robot);
  boost::asio::io_context io{1};
  drivers::RealClock clock;
  std::exception_ptr failure;
  int sick = 0;
  Memory memory;
  {
    mission::HardwareLinks links(config.robot, io.get_executor(), clock);
    mission::RobotDrivers drivers(config.robot, std::nullopt, clock, links.ends());
    const auto on_end = [&](std::exception_ptr error) {
      if (error && !failure) failure = error;
      io.stop();
    };
    boost::asio::co_spawn(io, drivers.run(), on_end);
    boost::asio::co_spawn(io, look(drivers, links, clock, options.wait_s), on_end);
    io.run();
    if (failure) std::rethrow_exception(failure);
    memory.look();
    boost::json::array devices;
    for (const mission::NamedDevice& named : drivers.devices()) {
      sick += !healthy(named, links);
      if (options.json)
        devices.push_back(device_json(named, links));
      else
        print_device(named, links);
    }
    if (options.json)
      print_json(boost::json::object{
          {"ok", sick == 0}, {"devices", std::move(devices)}, {"memory", memory.json()}});
    else
      fmt::print("{}\n", sick == 0
                             ? "all healthy"
                             : fmt::format("{} of {} not healthy", sick, drivers.devices().size()));
    if (!options.json) memory.print();
  }
  return sick == 0 ? kFine : kFailed;
}

}  // namespace

void add_doctor_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<DoctorOptions>();
  auto* command = app.add_subcommand(
      "doctor", "Opens every device of a robot: found, identified, healthy, or why not");
  command->footer(
      "Takes the devices for itself while it looks; moves nothing but a pan unit that must find "
      "its\n"
      "zero. Example:\n"
      "  vantage doctor configs/robots/scout_lms511.toml");
  command->add_option("robot", options->robot, "Robot file (TOML)")->required();
  command->add_option("--wait", options->wait_s, "Seconds to wait for all to be healthy")
      ->check(CLI::Range(0.1, 600.0));
  add_json_flag(*command, options->json);
  command->callback([&run, options] {
    run = [options] { return answer(options->json, [&] { return diagnose(*options); }); };
  });
}

}  // namespace vantage
