// What tests with a slow and obviously right version read.
#pragma once

#include "tools/pch/tests.hpp"
