// Links of this machine keep the promises.
#include "tests/links/promises/real_rigs.hpp"
#include "tests/links/promises_test.hpp"

namespace links_test {
namespace {

const bool kRealHeld =
    hold<StreamRig>("Tcp", stream_promises(), make_tcp_rig) &&
    hold<StreamRig>("SerialPort", stream_promises(), make_serial_rig) &&
    hold<DatagramRig>("Udp", datagram_promises(), make_udp_rig) &&
    hold<RegisterRig>("ModbusTcp", register_promises(), make_modbus_tcp_rig) &&
    hold<RegisterRig>("ModbusRtu", register_promises(), make_modbus_rtu_rig) &&
    hold<RegisterRig>("ModbusTcpOfLibmodbus", register_promises(), make_libmodbus_rig);

}  // namespace
}  // namespace links_test
