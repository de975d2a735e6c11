#include "run_mission.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/json.hpp>
#include <chrono>
#include <fstream>
#include <sstream>

namespace missions {
namespace {

// Starts the program with both outputs in a file; the child's own resources tell its memory.
void execute(const std::vector<std::string>& words, const std::filesystem::path& log,
             MissionRun& run) {
  const auto began = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child == 0) {
    const int fd = open(log.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644);
    dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  run.peak_rss_mib = static_cast<double>(usage.ru_maxrss) / 1024;
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

}  // namespace

std::filesystem::path configs() {
  return std::filesystem::path(VANTAGE_SOURCE_DIR) / "configs";
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

MissionRun judge(const std::filesystem::path& model, const std::filesystem::path& folder,
                 const std::filesystem::path& cells, int every) {
  MissionRun run;
  const auto log = cells.string() + ".log";
  execute({std::string(VANTAGE_BINARY_DIR) + "/tests/judge", model.string(), folder.string(),
           cells.string(), "--every", std::to_string(every)},
          log, run);
  run.output = read_text(log);
  std::filesystem::remove(log);
  return run;
}

MissionRun run(const std::filesystem::path& mission, const std::string& folder_name,
               const std::vector<std::string>& options) {
  const auto base =
      std::filesystem::temp_directory_path() / ("vantage-missions-" + std::to_string(getpid()));
  std::filesystem::create_directories(base);
  MissionRun run;
  run.folder = base / folder_name;
  std::filesystem::remove_all(run.folder);
  std::vector<std::string> words{std::string(VANTAGE_BINARY_DIR) + "/vantaged", mission.string(),
                                 "--out", run.folder.string()};
  words.insert(words.end(), options.begin(), options.end());
  const auto log = base / (folder_name + ".log");
  execute(words, log, run);
  run.output = read_text(log);
  const std::string summary = read_text(run.folder / "summary.json");
  if (!summary.empty()) run.summary = boost::json::parse(summary);
  return run;
}

}  // namespace missions
