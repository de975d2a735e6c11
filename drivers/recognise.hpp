// Who is on the line, from what was heard: to name a wrong port by what is really there.
#pragma once

#include <string>

#include "drivers/bytes.hpp"

namespace drivers {

// "a satellite receiver that sends NMEA (GNGGA)", "a VectorNav", ...; empty where nobody that is
// known speaks. Only whole messages with their checksum count.
std::string recognise(ByteView heard);

}  // namespace drivers
