#include "drivers/modbus_errors.hpp"

namespace drivers::modbus {
namespace {

namespace errc = boost::system::errc;

struct Pair {
  std::uint8_t exception;
  errc::errc_t error;
};
constexpr Pair kPairs[] = {
    {1, errc::function_not_supported}, {2, errc::bad_address},
    {3, errc::invalid_argument},       {4, errc::io_error},
    {5, errc::operation_in_progress},  {6, errc::device_or_resource_busy},
    {10, errc::network_unreachable},   {11, errc::host_unreachable},
};

}  // namespace

boost::system::error_code error_of(std::uint8_t exception) {
  for (const Pair& pair : kPairs)
    if (pair.exception == exception) return errc::make_error_code(pair.error);
  return errc::make_error_code(errc::protocol_error);
}

std::uint8_t exception_of(boost::system::error_code error) {
  for (const Pair& pair : kPairs)
    if (error == errc::make_error_condition(pair.error)) return pair.exception;
  return 4;
}

}  // namespace drivers::modbus
