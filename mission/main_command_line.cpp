#include "mission/main_command_line.hpp"

#include <CLI/CLI.hpp>

namespace mission {

struct CommandLine::App {
  CLI::App cli;
};

CommandLine::CommandLine(const std::string& about, const std::string& footer)
    : app_(std::make_unique<App>()) {
  app_->cli.description(about);
  app_->cli.footer(footer);
}

CommandLine::~CommandLine() = default;

void CommandLine::add(const std::string& name, Target target, const std::string& help,
                      const OptionRule& rule) {
  CLI::App& cli = app_->cli;
  CLI::Option* option = nullptr;
  if (bool** flag = std::get_if<bool*>(&target))
    option = cli.add_flag(name, **flag, help);
  else
    option = std::visit([&](auto* value) { return cli.add_option(name, *value, help); }, target);
  if (std::holds_alternative<std::vector<std::string>*>(target)) option->allow_extra_args(false);
  option->required(rule.required);
  if (rule.within) option->check(CLI::Range(rule.within->first, rule.within->second));
  if (rule.pair) option->delimiter(',')->expected(2);
  if (rule.shows_default) option->capture_default_str();
  if (!rule.needs.empty()) option->needs(cli.get_option(rule.needs));
  if (!rule.excludes.empty()) option->excludes(cli.get_option(rule.excludes));
}

bool CommandLine::parse(int argc, char** argv) {
  try {
    app_->cli.parse(argc, argv);
    return true;
  } catch (const CLI::ParseError& error) {
    exit_code_ = app_->cli.exit(error);
    return false;
  }
}

}  // namespace mission
