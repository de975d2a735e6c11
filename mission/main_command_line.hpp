// A program's command line: CLI11 behind plain values, compiled once here and not in every program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace mission {

// What an option is besides its name and its help.
struct OptionRule {
  bool required = false;
  std::optional<std::pair<int, int>> within = {};  // Both ends may be.
  bool pair = false;                               // Two values, "a,b".
  bool shows_default = false;                      // In the help.
  std::string needs = {}, excludes = {};           // Another option's name.
};

class CommandLine {
 public:
  // Where a value goes. A list takes one value each time that its option is given.
  using Target = std::variant<bool*, int*, double*, std::uint64_t*, std::optional<std::uint64_t>*,
                              std::string*, std::filesystem::path*, std::vector<std::string>*>;

  explicit CommandLine(const std::string& about, const std::string& footer = {});
  ~CommandLine();

  // `name` as in "--out", "--can-pair,--gs-usb", or "mission" for an argument without a name; the
  // target must outlive parse().
  void add(const std::string& name, Target target, const std::string& help,
           const OptionRule& rule = {});

  // Fills the targets. False: the program is to end with exit_code(), and what there was to say
  // (the help, or what is wrong) is printed.
  bool parse(int argc, char** argv);
  bool asked_for_help() const { return exit_code_ == 0; }
  int exit_code() const { return exit_code_; }

 private:
  struct App;
  std::unique_ptr<App> app_;
  int exit_code_ = 0;
};

}  // namespace mission
