// What can be wrong with a link, by name, with what to do about it.
#pragma once

#include <boost/system/error_code.hpp>
#include <string>
#include <vector>

#include "drivers/device.hpp"

namespace drivers {

// What every real link can say of itself.
class Link {
 public:
  virtual ~Link() = default;
  virtual std::string address() const = 0;            // As parse_link_address() reads it.
  virtual std::vector<Trouble> troubles() const = 0;  // Present now; empty when healthy.
};

// Values of link_faults().
enum class LinkFault : std::uint32_t {
  absent = 1,
  forbidden,
  busy,
  refused,
  unreachable,
  no_answer,
  unknown_name,
  lost,
  bad_settings,
  address_in_use,
  interface_down,
  bus_off,
  bus_passive,
  not_acknowledged,
  damaged,
  other_device,
  refused_by_unit,
  no_driver,
  other,
};
std::span<const Fault> link_faults();

Trouble trouble(LinkFault fault, std::string detail);

// For the error with which opening `what` ended. With the path of a device file it says which group
// may open it, and who holds it: reads /proc, a few milliseconds.
Trouble trouble_of(boost::system::error_code error, const std::string& what,
                   const std::string& path = "");

}  // namespace drivers
