// What a file that could not be written or read means for a mission.
#pragma once

#include <string>

#include "mission/faults.hpp"
#include "mission/files.hpp"

namespace mission {

// disk_full, disk_read_only, or disk_failed.
FaultCode disk_fault(boost::system::error_code why);

// "F700-disk-full: cannot write runs/7/scans/0003.ply: No space left on device"
std::string fault_text(const FileError& error);

}  // namespace mission
