#pragma once

#include <functional>

namespace drivers {

// Makes the connection that a link holds end, so that the link makes it anew.
using DropLink = std::function<void()>;

}  // namespace drivers
