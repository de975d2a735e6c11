// Links of this machine that end at peers of ours: no hardware needed.
#pragma once

#include <memory>
#include <vector>

#include "tests/links/promises/datagram_promises.hpp"
#include "tests/links/promises/register_promises.hpp"
#include "tests/links/promises/stream_promises.hpp"

namespace links_test {

std::unique_ptr<StreamRig> make_tcp_rig();
std::unique_ptr<StreamRig> make_serial_rig();  // Over a pseudo terminal.
std::unique_ptr<DatagramRig> make_udp_rig();
std::unique_ptr<RegisterRig> make_modbus_tcp_rig();  // Against our unit.
std::unique_ptr<RegisterRig> make_modbus_rtu_rig();  // Against our unit, over a pty.
std::unique_ptr<RegisterRig> make_libmodbus_rig();   // Against libmodbus's own server.

}  // namespace links_test
