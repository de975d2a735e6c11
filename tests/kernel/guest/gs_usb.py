"""A gs_usb adapter (candleLight) with two channels on one bus. Frame 7F0#0FF0 drives its channel off the bus."""
import struct

from adapter import Adapter

FROM_BUS = 0xffffffff


class GsUsb(Adapter):
    vendor, product = 0x1d50, 0x606f

    def __init__(self):
        super().__init__()
        self.running = [0, 0]

    def vendor_request(self, request_type, request, value, index, out):
        if request == 0:
            return b''
        if request == 5:
            return struct.pack('<4BII', 0, 0, 0, 1, 2, 1)
        if request == 4:
            return struct.pack('<10I', 0x1 | 0x2 | 0x8, 48000000, 1, 16, 1, 8, 4, 1, 1024, 1)
        if request == 1:
            return b''
        if request == 2:
            self.running[value] = struct.unpack('<II', out)[0]
            return b''
        return None

    def received(self, channel, can_id, data):
        self.send(struct.pack('<IIBBBB8s', FROM_BUS, can_id, len(data), channel, 0, 0, data))

    def take(self, out):
        _, can_id, size, channel, _, _, data = struct.unpack('<IIBBBB8s', out[:20])
        if can_id == 0x7f0 and data[:size] == b'\x0f\xf0':
            self.received(channel, 0x20000204, b'\0\x08\0\0\0\0\x60\0')
            self.received(channel, 0x20000204, b'\0\x20\0\0\0\0\x80\0')
            self.received(channel, 0x20000040, bytes(8))
            return
        self.send(out[:20])
        if self.running[1 - channel]:
            self.received(1 - channel, can_id, data[:size])


GsUsb().serve()
