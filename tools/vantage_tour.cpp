// vantage tour: the order of visit for an instance of TSPLIB.
#include <fmt/format.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "planning/tour.hpp"
#include "tools/tsplib.hpp"
#include "tools/vantage_command.hpp"

namespace vantage {
namespace {

namespace json = boost::json;

struct TourOptions {
  std::filesystem::path file;
  int start = 1;  // As the file numbers its nodes.
  bool open = false;
  bool json = false;
  planning::TourConfig config;
};

// Nodes as the file numbers them.
json::array numbered(const std::vector<int>& nodes) {
  json::array numbers;
  for (const int node : nodes) numbers.push_back(node + 1);
  return numbers;
}

json::object tour_json(const tools::TspInstance& tsp, const planning::Tour& tour) {
  return {{"name", tsp.name},
          {"nodes", tsp.problem.cost.size()},
          {"closed", tsp.problem.closed},
          {"length", tour.cost},
          {"proven", tour.proven},
          {"order", numbered(tour.order)},
          {"unreachable", numbered(tour.unreachable)}};
}

std::string tour_text(const tools::TspInstance& tsp, const planning::Tour& tour) {
  std::string order;
  for (const int node : tour.order)
    order += fmt::format("{}{}", order.empty() ? "" : " ", node + 1);
  return fmt::format("{}: {} nodes, {} tour of length {}, {}\n{}\n", tsp.name,
                     tsp.problem.cost.size(), tsp.problem.closed ? "closed" : "open", tour.cost,
                     tour.proven ? "proven the shortest" : "not proven the shortest", order);
}

int tour_command(const TourOptions& options) {
  tools::LoadedTsp loaded = tools::load_tsp(options.file);
  planning::TourProblem& problem = loaded.tsp.problem;
  const auto nodes = static_cast<int>(problem.cost.size());
  if (loaded.errors.empty() && (options.start < 1 || options.start > nodes))
    loaded.errors.push_back({"--start", 0, 0,
                             fmt::format("{} is not a node of {}; give one from 1 to {}",
                                         options.start, options.file.string(), nodes)});
  if (!loaded.errors.empty()) throw Refusal(loaded.errors);
  problem.start = options.start - 1;
  problem.closed = !options.open;
  const planning::Tour tour = planning::solve_tour(problem, options.config);
  if (options.json)
    print_json(tour_json(loaded.tsp, tour));
  else
    fmt::print("{}", tour_text(loaded.tsp, tour));
  return kFine;
}

}  // namespace

void add_tour_command(CLI::App& app, Run& run) {
  const auto options = std::make_shared<TourOptions>();
  auto* command = app.add_subcommand(
      "tour", "Finds a short tour through the nodes of a TSPLIB file, as the planner does");
  command->footer(
      "Examples:\n"
      "  vantage tour berlin52.tsp\n"
      "  vantage tour pcb442.tsp --json\n"
      "  vantage tour burma14.tsp --open --start 3");
  command->add_option("file", options->file, "Instance (TSPLIB95, TYPE TSP or ATSP)")->required();
  command->add_option("--start", options->start, "Node to start from")->capture_default_str();
  command->add_flag("--open", options->open, "End anywhere instead of coming back");
  command
      ->add_option("--exact", options->config.exact_nodes_max,
                   "Up to that many nodes prove the tour the shortest")
      ->check(CLI::Range(0, planning::kExactNodesCap))
      ->capture_default_str();
  command->add_option("--seed", options->config.seed, "Of the search's perturbations")
      ->capture_default_str();
  add_json_flag(*command, options->json);
  command->callback([options, &run] {
    run = [options] { return answer(options->json, [&] { return tour_command(*options); }); };
  });
}

}  // namespace vantage
