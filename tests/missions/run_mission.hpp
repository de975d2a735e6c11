// Runs the shipped vantaged as an operator would, and reads what it leaves behind.
#pragma once

#include <boost/json/value.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace missions {

struct MissionRun {
  int exit_code = -1;
  std::string output;  // stdout and stderr together
  double wall_s{};
  double peak_rss_mib{};  // Of the process.
  std::filesystem::path folder;
  boost::json::value summary;  // null when the run left none.

  const boost::json::object& object(std::string_view key) const {
    return summary.at(key).as_object();
  }
};

std::filesystem::path configs();  // configs/ of the sources

// vantaged MISSION --out FOLDER OPTIONS...; the folder is emptied before.
MissionRun run(const std::filesystem::path& mission, const std::string& folder_name,
               const std::vector<std::string>& options = {});

// The independent judge over a run; output and exit code only.
MissionRun judge(const std::filesystem::path& model, const std::filesystem::path& folder,
                 const std::filesystem::path& cells, int every);

std::string read_text(const std::filesystem::path& file);

}  // namespace missions
