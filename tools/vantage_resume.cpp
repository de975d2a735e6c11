// vantage resume: what an unfinished run would go on with.
#include <fmt/format.h>

#include <memory>

#include "mission/resume.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct ResumeOptions {
  std::filesystem::path folder;
  bool json = false;
};

int resume_command(const ResumeOptions& options) {
  const auto left = mission::find_left_run(options.folder);
  if (!left) throw Refusal(left.error().text());
  if (options.json) {
    boost::json::object answer{{"ok", true}, {"unfinished", left->has_value()}};
    if (left->has_value()) answer["run"] = mission::offer_json(**left, options.folder);
    print_json(answer);
  } else if (left->has_value()) {
    fmt::print("{}", mission::offer_text(**left, options.folder));
  } else {
    fmt::print("no unfinished run with a scan is in {}\n", options.folder.string());
  }
  return kFine;
}

}  // namespace

void add_resume_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<ResumeOptions>();
  auto* command = app.add_subcommand(
      "resume", "Says whether a folder holds an unfinished run, how far it came, and why it ended");
  command->footer(
      "Examples:\n"
      "  vantage resume runs/fort\n"
      "  vantage resume runs/fort --json\n"
      "`vantaged MISSION --out FOLDER --resume` goes on with it.");
  command->add_option("folder", options->folder, "Folder of the run")->required();
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return resume_command(*options); }); };
  });
}

}  // namespace vantage
