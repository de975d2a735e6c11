// Keeps ARCHITECTURE.md's rules true: who may include whom, and what stays out of pure code.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = VANTAGE_SOURCE_DIR;

struct Include {
  std::string file;  // From the root: "nav/roadmap.cpp"
  int line{};
  std::string target;  // "nav/geometry.hpp" or "<vector>"
};

std::vector<Include> includes_of(std::istream& text, const std::string& file) {
  static const std::regex pattern(R"(^\s*#\s*include\s*(?:"([^"]+)\"|(<[^>]+>)).*)");
  std::vector<Include> includes;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    std::smatch match;
    if (!std::regex_match(line, match, pattern)) continue;
    includes.push_back({file, number, match[1].matched ? match[1].str() : match[2].str()});
  }
  return includes;
}

std::vector<fs::path> sources(const std::string& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(kRoot / folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    const auto extension = entry.path().extension();
    if (extension == ".hpp" || extension == ".cpp" || extension == ".inc")
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<Include> includes_in(const std::string& folder) {
  std::vector<Include> all;
  for (const auto& file : sources(folder)) {
    std::ifstream text(file);
    const auto found = includes_of(text, file.lexically_relative(kRoot).generic_string());
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

const std::map<std::string, std::set<std::string>> kMayInclude{
    {"hal", {"hal"}},
    {"drivers", {"drivers", "hal"}},
    {"nav", {"nav", "hal"}},
    {"planning", {"planning", "nav", "hal"}},
    {"mission", {"mission", "planning", "nav", "hal"}},
    {"sim", {"sim", "drivers", "hal"}},  // Of drivers only the codecs: see waiting_part().
};

// mission/main*.cpp is where everything meets.
bool knows_everything(const std::string& file) {
  return file.starts_with("mission/main");
}

// Why this include breaks a rule, or "".
std::string objection(const Include& include) {
  const auto folder = include.file.substr(0, include.file.find('/'));
  const auto& target = include.target;
  if (target.starts_with('<')) return "";
  const auto slash = target.find('/');
  if (slash == std::string::npos) return "write the path from the root of the project";
  const auto target_folder = target.substr(0, slash);
  if (!kMayInclude.contains(target_folder)) return "no such folder for includes";
  if (knows_everything(include.file)) return "";
  return kMayInclude.at(folder).contains(target_folder)
             ? ""
             : folder + " may not include " + target_folder;
}

// Headers that wait, talk or touch files: not for pure code. Planning may use threads.
std::string impurity(const Include& include) {
  static const std::vector<std::string> kNever{
      "asio",     "beast",         "<fstream>",   "<filesystem>", "<sys/",      "<netinet/",
      "<arpa/",   "<unistd.h>",    "<fcntl.h>",   "<poll.h>",     "<chrono",    "toml++",
      "hal/task", "hal/clock.hpp", "hal/devices", "<ctime>",      "<iostream>", "<random_device"};
  static const std::vector<std::string> kThreads{"<thread>", "<mutex>", "<atomic>",
                                                 "<condition_variable>", "<future>"};
  const auto names = [&](const std::string& part) {
    return include.target.find(part) != std::string::npos;
  };
  if (std::any_of(kNever.begin(), kNever.end(), names)) return "not for pure code";
  const bool planning = include.file.starts_with("planning/");
  if (!planning && std::any_of(kThreads.begin(), kThreads.end(), names))
    return "threads are for planning";
  return "";
}

// The header through which a file comes to what waits (tasks, links, devices), or "".
std::string waiting_part(const std::string& file, std::set<std::string> seen = {}) {
  if (file.starts_with("hal/"))
    return file == "hal/values.hpp" || file == "hal/frames.hpp" ? "" : file;
  if (!seen.insert(file).second) return "";
  std::ifstream text(kRoot / file);
  for (const auto& include : includes_of(text, file)) {
    if (include.target.find("boost/asio") != std::string::npos) return include.target;
    if (include.target.starts_with('<')) continue;
    if (const auto part = waiting_part(include.target, seen); !part.empty()) return part;
  }
  return "";
}

std::string at(const Include& include) {
  return include.file + ":" + std::to_string(include.line) + ": " + include.target;
}

TEST(Architecture, EveryFolderIncludesOnlyWhatItMay) {
  for (const auto& [folder, allowed] : kMayInclude)
    for (const auto& include : includes_in(folder))
      EXPECT_EQ(objection(include), "") << at(include);
}

TEST(Architecture, NavAndPlanningTouchNoFileSocketClockOrEventLoop) {
  for (const std::string folder : {"nav", "planning"}) {
    EXPECT_FALSE(includes_in(folder).empty()) << folder;
    for (const auto& include : includes_in(folder)) EXPECT_EQ(impurity(include), "") << at(include);
  }
}

TEST(Architecture, SimulatedUnitsShareCodecsButNotLoopsWithDrivers) {
  for (const auto& include : includes_in("sim")) {
    if (!include.target.starts_with("drivers/")) continue;
    EXPECT_EQ(waiting_part(include.target), "") << at(include);
  }
  EXPECT_EQ(waiting_part("drivers/gs_usb_codec.hpp"), "");
  EXPECT_NE(waiting_part("drivers/device.hpp"), "");
}

TEST(Architecture, EveryIncludedFileOfOursExists) {
  for (const std::string folder :
       {"hal", "drivers", "nav", "planning", "mission", "sim", "tools", "tests"})
    for (const auto& include : includes_in(folder)) {
      if (include.target.starts_with('<')) continue;
      const bool beside = folder == "tools" || folder == "tests";
      const auto here = (kRoot / include.file).parent_path() / include.target;
      EXPECT_TRUE(fs::exists(kRoot / include.target) || (beside && fs::exists(here)))
          << at(include) << ": no such file";
    }
}

TEST(Architecture, EveryHeaderIsGuarded) {
  for (const auto& [folder, allowed] : kMayInclude)
    for (const auto& file : sources(folder)) {
      if (file.extension() != ".hpp") continue;
      std::ostringstream text;
      text << std::ifstream(file).rdbuf();
      EXPECT_NE(text.str().find("#pragma once\n"), std::string::npos) << file;
    }
}

TEST(Architecture, NoHeaderOpensANamespaceToEveryone) {
  const std::regex pattern(R"(^using namespace .*)");
  for (const auto& [folder, allowed] : kMayInclude)
    for (const auto& file : sources(folder)) {
      if (file.extension() != ".hpp") continue;
      std::ifstream text(file);
      for (std::string line; std::getline(text, line);)
        EXPECT_FALSE(std::regex_match(line, pattern)) << file << ": " << line;
    }
}

// Every name in backquotes that looks like a path must be there; a source may be named without its
// extension.
TEST(Architecture, WhatArchitectureMdNamesExists) {
  std::ifstream text(kRoot / "ARCHITECTURE.md");
  ASSERT_TRUE(text) << "ARCHITECTURE.md is missing";
  const std::regex pattern(
      "`((?:hal|drivers|nav|planning|mission|sim|tests|configs|tools)/[^`*<> ]*)`");
  int named = 0;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    for (std::sregex_iterator it(line.begin(), line.end(), pattern), end; it != end; ++it) {
      const auto path = (*it)[1].str();
      const auto exists = [&](const char* extension) {
        return fs::exists(kRoot / (path + extension));
      };
      EXPECT_TRUE(exists("") || exists(".hpp") || exists(".cpp"))
          << "ARCHITECTURE.md:" << number << ": " << path << " does not exist";
      ++named;
    }
  }
  EXPECT_GT(named, 10);
}

// The tree at the top of the page: "folder/   what it holds".
TEST(Architecture, FoldersOfTheTreeInArchitectureMdExist) {
  std::ifstream text(kRoot / "ARCHITECTURE.md");
  ASSERT_TRUE(text) << "ARCHITECTURE.md is missing";
  const std::regex pattern(R"(^([a-z]+)/ +\S.*)");
  std::set<std::string> named;
  for (std::string line; std::getline(text, line);) {
    std::smatch match;
    if (!std::regex_match(line, match, pattern)) continue;
    named.insert(match[1].str());
    const bool announced = line.find("empty until") != std::string::npos;
    EXPECT_TRUE(announced || fs::is_directory(kRoot / match[1].str())) << line;
  }
  for (const auto& [folder, allowed] : kMayInclude)
    EXPECT_TRUE(named.contains(folder)) << folder << "/ is not on the page";
}

// The rules themselves, on lines that must not pass.
TEST(Architecture, TheRulesSeeViolations) {
  const auto include = [](const std::string& file, const std::string& line) {
    std::istringstream text(line + "\n");
    const auto found = includes_of(text, file);
    return found.empty() ? Include{file, 0, "nothing"} : found[0];
  };
  EXPECT_NE(objection(include("nav/x.hpp", "#include \"planning/cover.hpp\"")), "");
  EXPECT_NE(objection(include("planning/x.cpp", "  # include \"mission/config.hpp\"  // why")), "");
  EXPECT_NE(objection(include("sim/x.cpp", "#include \"nav/follow.hpp\"")), "");
  EXPECT_NE(objection(include("mission/survey.cpp", "#include \"sim/world.hpp\"")), "");
  EXPECT_NE(objection(include("nav/x.cpp", "#include \"geometry.hpp\"")), "");
  EXPECT_EQ(objection(include("mission/main.cpp", "#include \"sim/world.hpp\"")), "");
  EXPECT_EQ(objection(include("sim/x.cpp", "#include \"hal/values.hpp\"")), "");
  EXPECT_NE(impurity(include("nav/x.hpp", "#include <boost/asio/awaitable.hpp>")), "");
  EXPECT_NE(impurity(include("planning/x.cpp", "#include <fstream>")), "");
  EXPECT_NE(impurity(include("nav/x.cpp", "#include <thread>")), "");
  EXPECT_NE(impurity(include("nav/x.cpp", "#include \"hal/clock.hpp\"")), "");
  EXPECT_EQ(impurity(include("planning/x.cpp", "#include <thread>")), "");
  EXPECT_EQ(impurity(include("nav/x.cpp", "#include <vector>")), "");
}

}  // namespace
