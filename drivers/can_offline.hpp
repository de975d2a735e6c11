// Captures of CAN and Modbus devices for people.
#pragma once

#include <memory>

#include "drivers/offline.hpp"

namespace drivers {

// Finds out the dialect by itself.
std::unique_ptr<OfflineDecoder> agilex_offline();
// Names the objects of CiA 301 and 402 and a drive's state.
std::unique_ptr<OfflineDecoder> canopen_offline();
// RTU or TCP, whichever gives a whole frame first. Replies are shown with what was asked.
std::unique_ptr<OfflineDecoder> modbus_offline();

}  // namespace drivers
