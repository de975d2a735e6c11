// vantage explain: what a fault means, what it does and what to do about it.
#include <fmt/format.h>

#include <memory>

#include "mission/faults.hpp"
#include "mission/suggest.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

struct ExplainOptions {
  std::string id;
  bool all = false, markdown = false, json = false;
};

boost::json::object fault_json(const mission::FaultEntry& fault) {
  const auto text = [](std::string_view of) { return boost::json::string(of.data(), of.size()); };
  return {{"id", text(fault.id)},
          {"action", text(mission::name(fault.action))},
          {"cause", text(fault.cause)},
          {"effect", text(fault.effect)},
          {"remedy", text(fault.remedy)}};
}

std::string fault_text(const mission::FaultEntry& fault) {
  return fmt::format("{}: {}\n  cause   {}\n  effect  {}\n  remedy  {}\n", fault.id,
                     mission::name(fault.action), fault.cause, fault.effect, fault.remedy);
}

// Ids with and without their number: people remember either.
const mission::FaultEntry& asked_fault(const std::string& id) {
  if (const auto* found = mission::find_fault(id)) return *found;
  constexpr std::size_t kNumberLength = 5;  // "F012-"
  std::vector<std::string> known;
  for (const auto& fault : mission::all_faults()) known.emplace_back(fault.id);
  std::vector<std::string> meant = mission::closest(id, known);
  for (std::string& each : known) each.erase(0, kNumberLength);
  if (meant.empty()) meant = mission::closest(id, known);
  throw Refusal(fmt::format("no fault '{}'{}; `vantage explain --all` lists them", id,
                            mission::did_you_mean(meant)));
}

int explain_all(const ExplainOptions& options) {
  if (options.markdown) {
    fmt::print("{}", mission::faults_page());
    return kFine;
  }
  boost::json::array all;
  for (const auto& fault : mission::all_faults()) {
    if (options.json)
      all.push_back(fault_json(fault));
    else
      fmt::print("{:<32} {:<7} {}\n", fault.id, mission::name(fault.action), fault.cause);
  }
  if (options.json) print_json({{"ok", true}, {"faults", std::move(all)}});
  return kFine;
}

int explain_command(const ExplainOptions& options) {
  if (options.all == !options.id.empty())
    throw Refusal("give one fault's ID, or --all: `vantage explain F012`");
  if (options.markdown && !options.all) throw Refusal("--markdown needs --all");
  if (options.all) return explain_all(options);
  const mission::FaultEntry& fault = asked_fault(options.id);
  if (options.json)
    print_json({{"ok", true}, {"fault", fault_json(fault)}});
  else
    fmt::print("{}", fault_text(fault));
  return kFine;
}

}  // namespace

void add_explain_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<ExplainOptions>();
  auto* command = app.add_subcommand(
      "explain", "Says what a fault means, what it makes the robot do, and the remedy");
  command->footer(
      "Examples:\n"
      "  vantage explain F012\n"
      "  vantage explain drive-silent --json\n"
      "  vantage explain --all --markdown > docs/faults.md");
  command->add_option("id", options->id, "Id, number or name of a fault");
  command->add_flag("--all", options->all, "All faults");
  command->add_flag("--markdown", options->markdown, "With --all: the manual's page");
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return explain_command(*options); }); };
  });
}

}  // namespace vantage
