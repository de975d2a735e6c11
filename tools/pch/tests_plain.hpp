// The same for tests that run programs or whole missions: nothing to optimize in them.
#pragma once

#include "tools/pch/tests.hpp"
