// vantage decode DEVICE FILE: what a device said, from a capture.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace vantage {

// Adds the command; when it is named, sets `run`, which returns the exit code: 0 fine, 1 no message
// of the device in the file, 2 refused.
void add_decode_command(CLI::App& app, std::function<int()>& run);

}  // namespace vantage
