#include "mission/disk_fault.hpp"

#include <cerrno>

namespace mission {

FaultCode disk_fault(boost::system::error_code why) {
  namespace errc = boost::system::errc;
  for (const auto full : {errc::no_space_on_device, errc::file_too_large})
    if (why == full) return FaultCode::disk_full;
  if (why == boost::system::error_code(EDQUOT, boost::system::system_category()))
    return FaultCode::disk_full;
  for (const auto closed : {errc::read_only_file_system, errc::permission_denied})
    if (why == closed) return FaultCode::disk_read_only;
  return FaultCode::disk_failed;
}

std::string fault_text(const FileError& error) {
  return std::string(entry_of(disk_fault(error.code)).id) + ": " + error.text();
}

}  // namespace mission
