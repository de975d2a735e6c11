#include "drivers/link_trouble.hpp"

#include <dirent.h>
#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/system/errc.hpp>
#include <cctype>
#include <fstream>
#include <memory>
#include <utility>

namespace drivers {
namespace {

namespace errc = boost::system::errc;

constexpr std::uint32_t code(LinkFault fault) {
  return static_cast<std::uint32_t>(fault);
}

constexpr Fault kFaults[] = {
    {code(LinkFault::absent), "not there", "unplugged, not powered, or the address is wrong",
     "plug it in; compare the address with what `ls /dev/serial/by-id`, `ip link` or `lsusb` show"},
    {code(LinkFault::forbidden), "not permitted", "the user may not open it",
     "add the user to the group that is named (`usermod -aG GROUP USER`) and log in again"},
    {code(LinkFault::busy), "in use", "another program holds it",
     "stop the program that is named, or give the device a link of its own"},
    {code(LinkFault::refused), "connection refused",
     "the host is there, but nothing listens on that port",
     "check the port; switch the interface on in the device's settings"},
    {code(LinkFault::unreachable), "unreachable", "no route to the device",
     "check cable, the robot's own IP address and the device's"},
    {code(LinkFault::no_answer), "no answer", "no power, cut cable, or nobody has that address",
     "check power, cable and address"},
    {code(LinkFault::unknown_name), "unknown host name", "no address for that name",
     "write the IP address, or check the name"},
    {code(LinkFault::lost), "lost", "cable, power, or the other side closed it",
     "check cable and power; it is opened again by itself"},
    {code(LinkFault::bad_settings), "settings not taken", "the port cannot do that speed or format",
     "check the settings with the adapter's manual"},
    {code(LinkFault::address_in_use), "port in use", "another program listens on that port",
     "stop it: `ss -ulpn` names it"},
    {code(LinkFault::interface_down), "interface down", "nobody has started the interface",
     "`ip link set IFACE up type can bitrate RATE restart-ms 100`"},
    {code(LinkFault::bus_off), "bus off", "too many errors: the controller left the bus",
     "check cable, termination (60 ohm between CAN-H and CAN-L) and bit rate"},
    {code(LinkFault::bus_passive), "many bus errors", "disturbed bus or a wrong bit rate",
     "check bit rate, cable and termination"},
    {code(LinkFault::not_acknowledged), "nobody acknowledges",
     "no other node is on, or all have another bit rate",
     "switch the base on; check the CAN plug and the bit rate"},
    {code(LinkFault::damaged), "damaged data", "wrong speed or format, or a disturbed line",
     "check speed, parity, wiring and termination; an adapter that echoes must not"},
    {code(LinkFault::other_device), "another device", "not what the address promises",
     "check the address"},
    {code(LinkFault::refused_by_unit), "refused by the unit",
     "it has no such register, value or function",
     "check model and firmware, and the unit's number, against its register list"},
    {code(LinkFault::no_driver), "not supported here", "the kernel lacks it",
     "load the module that is named, or use another kind of link"},
    {code(LinkFault::other), "failed", "see the detail", "see the detail"},
};

struct Meaning {
  errc::errc_t error;
  LinkFault fault;
};
constexpr Meaning kMeanings[] = {
    {errc::no_such_file_or_directory, LinkFault::absent},
    {errc::no_such_device, LinkFault::absent},
    {errc::no_such_device_or_address, LinkFault::absent},
    {errc::permission_denied, LinkFault::forbidden},
    {errc::operation_not_permitted, LinkFault::forbidden},
    {errc::device_or_resource_busy, LinkFault::busy},
    {errc::resource_unavailable_try_again, LinkFault::busy},  // flock
    {errc::connection_refused, LinkFault::refused},
    {errc::host_unreachable, LinkFault::unreachable},
    {errc::network_unreachable, LinkFault::unreachable},
    {errc::timed_out, LinkFault::no_answer},
    {errc::connection_reset, LinkFault::lost},
    {errc::broken_pipe, LinkFault::lost},
    {errc::io_error, LinkFault::lost},
    {errc::not_connected, LinkFault::lost},
    {errc::invalid_argument, LinkFault::bad_settings},
    {errc::inappropriate_io_control_operation, LinkFault::other_device},
    {errc::not_a_directory, LinkFault::absent},
    {errc::is_a_directory, LinkFault::other_device},
    {errc::address_in_use, LinkFault::address_in_use},
    {errc::address_not_available, LinkFault::unreachable},
    {errc::network_down, LinkFault::interface_down},
    {errc::address_family_not_supported, LinkFault::no_driver},
    {errc::protocol_not_supported, LinkFault::no_driver},
};

LinkFault meaning_of(boost::system::error_code error) {
  if (error == boost::asio::error::eof) return LinkFault::lost;
  if (error.category() == boost::asio::error::get_netdb_category()) return LinkFault::unknown_name;
  for (const Meaning& meaning : kMeanings)
    if (error == errc::make_error_condition(meaning.error)) return meaning.fault;
  return LinkFault::other;
}

std::string group_of(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return "";
  const group* const found = getgrgid(status.st_gid);
  return found != nullptr ? found->gr_name : std::to_string(status.st_gid);
}

using Folder = std::unique_ptr<DIR, int (*)(DIR*)>;

bool holds(const std::string& process, const struct stat& wanted) {
  const std::string files = "/proc/" + process + "/fd";
  const Folder folder(opendir(files.c_str()), closedir);
  if (!folder) return false;
  while (const dirent* const entry = readdir(folder.get())) {
    struct stat status {};
    if (stat((files + "/" + entry->d_name).c_str(), &status) == 0 && S_ISCHR(status.st_mode) &&
        status.st_rdev == wanted.st_rdev)
      return true;
  }
  return false;
}

// "gpsd, process 1234"; empty when it is not to be seen.
std::string holder_of(const std::string& path) {
  struct stat wanted {};
  if (stat(path.c_str(), &wanted) != 0 || !S_ISCHR(wanted.st_mode)) return "";
  const std::string own = std::to_string(getpid());
  const Folder folder(opendir("/proc"), closedir);
  std::string ours;
  while (const dirent* const entry = folder ? readdir(folder.get()) : nullptr) {
    const std::string process = entry->d_name;
    if (std::isdigit(static_cast<unsigned char>(process[0])) == 0 || !holds(process, wanted))
      continue;
    std::string name;
    std::getline(std::ifstream("/proc/" + process + "/comm"), name);
    if (process != own) return name + ", process " + process;
    ours = "this program itself";
  }
  return ours;
}

}  // namespace

std::span<const Fault> link_faults() {
  return kFaults;
}

Trouble trouble(LinkFault fault, std::string detail) {
  return {fault_of(kFaults, code(fault)), std::move(detail)};
}

Trouble trouble_of(boost::system::error_code error, const std::string& what,
                   const std::string& path) {
  const LinkFault fault = meaning_of(error);
  std::string detail = what + ": " + error.message();
  if (!path.empty() && fault == LinkFault::forbidden)
    if (const auto group = group_of(path); !group.empty())
      detail += "; group " + group + " may open it";
  if (!path.empty() && fault == LinkFault::busy)
    if (const auto holder = holder_of(path); !holder.empty()) detail += "; held by " + holder;
  return trouble(fault, std::move(detail));
}

}  // namespace drivers
