// `vantage tour FILE.tsp`: the order of visit for an instance of TSPLIB.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace vantage {

// Adds the command; when the user names it, `run` is set to what does it and gives the exit code.
void add_tour_command(CLI::App& app, std::function<int()>& run);

}  // namespace vantage
