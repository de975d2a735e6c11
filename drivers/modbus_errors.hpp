// What a unit's exceptions are as error codes. Pure.
//
//   1 function              function_not_supported     6 busy               device_or_resource_busy
//   2 address               bad_address               10 gateway path       network_unreachable
//   3 value                 invalid_argument          11 gateway's target   host_unreachable
//   4 device failure        io_error                  others                protocol_error
//   5 acknowledged, works   operation_in_progress
#pragma once

#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>

namespace drivers::modbus {

boost::system::error_code error_of(std::uint8_t exception);
// The other way; 4 for what no exception means.
std::uint8_t exception_of(boost::system::error_code error);

}  // namespace drivers::modbus
