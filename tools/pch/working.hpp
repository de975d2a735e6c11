// The same for folders that wait and have much to do in between: compiled with every pass.
#pragma once

#include "tools/pch/waiting.hpp"
