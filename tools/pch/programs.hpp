// The same for programs with a command line.
#pragma once

#include <CLI/CLI.hpp>

#include "tools/pch/waiting.hpp"
