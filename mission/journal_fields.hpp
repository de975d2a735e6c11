// What the program says, as the system's journal keeps it: fields that can be searched for.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mission {

// The kinds of messages that something else may wait for, as MESSAGE_ID (see `man journald`).
namespace message_id {
inline constexpr std::string_view kStopped = "9ac620c361c042e5b86e148f38c40887";
inline constexpr std::string_view kReleased = "5392faf6c260412f9c98e83d8c7dcea3";
inline constexpr std::string_view kHangs = "5a26d175d7724d2d9e8fd7552861948a";
inline constexpr std::string_view kDevices = "5ff21cc33c63448890aa12d7ac14e1e6";
}  // namespace message_id

// MESSAGE, PRIORITY (as syslog's), and where they apply FAULT_ID (the first fault whose whole id
// the text has) and MESSAGE_ID: "MESSAGE=the robot is stopped: F010-...", one a string. A fault
// that stops the robot is an error, one that holds it or sends it home a warning. Pure.
std::vector<std::string> journal_fields(std::string_view text);

}  // namespace mission
