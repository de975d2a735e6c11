// `vantage` as a person or a script runs it.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/temp_folder.hpp"

namespace test {

struct Outcome {
  int code = -1;
  std::string out;
  std::string err;

  boost::json::value json() const { return boost::json::parse(out); }
};

inline std::string read_text(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(text).str();
}

// PREFIX build/PROGRAM ARGUMENTS, run by a shell; stderr goes through a file in `folder`.
inline Outcome run_program(const std::string& program, const std::string& arguments,
                           const std::filesystem::path& folder, const std::string& prefix = "") {
  const auto err = folder / "stderr";
  const std::string command = prefix + std::string(VANTAGE_BINARY_DIR) + "/" + program + " " +
                              arguments + " 2>" + err.string();
  FILE* pipe = popen(command.c_str(), "r");
  Outcome outcome;
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer{};
  while (const auto read = fread(buffer.data(), 1, buffer.size(), pipe))
    outcome.out.append(buffer.data(), read);
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.err = read_text(err);
  return outcome;
}

class VantageTest : public testing::Test {
 protected:
  Outcome run(const std::string& arguments) const {
    return run_program("vantage", arguments, folder_.path());
  }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    const auto file = folder_.path() / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  static std::string site(const std::string& name) {
    return std::string(VANTAGE_SOURCE_DIR) + "/configs/sites/" + name;
  }

  TempFolder folder_;
};

}  // namespace test
