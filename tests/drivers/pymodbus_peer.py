"""Modbus servers by pymodbus: a gateway with a battery monitor on TCP, a relay board on a serial line.

    pymodbus_peer.py tcp PORT | rtu DEVICE
"""
import asyncio
import sys

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.server import StartAsyncSerialServer, StartAsyncTcpServer
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer

# 26.40 V, -1.2 A, -32 W, 21.5 C, 87.3 %, 72000 s, and the alarm for a low voltage as a warning.
BATTERY = {256: 0xFFFF, 257: 0xFFE0, 258: 0xFFE0, 259: 2640, 260: 0xFFFF, 261: 0xFFF4, 262: 215, 263: 0xFFFF,
           264: 0xFFFF, 265: 35, 266: 873, 303: 720, 304: 1000} | {at: int(at == 268) for at in range(267, 280)}
GATEWAY = {800: 0x4851, 801: 0x3132, 802: 0x3334, 803: 0, 804: 0, 805: 0}
# The e-stop's two contacts as they are while it is released.
BOARD_INPUTS = {0: 1} | {at: 0 for at in range(1, 8)}
BOARD_RELAYS = {at: 0 for at in range(8)} | {0x0200 + at: 0 for at in range(8)}
BOARD_REGISTERS = {0x1000 + at: 0 for at in range(8)} | {0x8000: 200}


def slave(**blocks):
    return ModbusSlaveContext(zero_mode=True, **{name: ModbusSparseDataBlock(block) for name, block in blocks.items()})


async def main():
    kind, where = sys.argv[1:3]
    print("ready", flush=True)
    if kind == "tcp":
        units = {100: slave(hr=GATEWAY), 226: slave(hr=BATTERY)}
        await StartAsyncTcpServer(ModbusServerContext(slaves=units, single=False), address=("127.0.0.1", int(where)),
                                  framer=ModbusSocketFramer)
    else:
        units = {1: slave(di=BOARD_INPUTS, co=BOARD_RELAYS, hr=BOARD_REGISTERS)}
        await StartAsyncSerialServer(ModbusServerContext(slaves=units, single=False), port=where,
                                     framer=ModbusRtuFramer, baudrate=9600)


asyncio.run(main())
