"""A ucan adapter (driver ucan.c: bus-off with restart). Every frame is acknowledged and comes back with id ^ 0x400.
Frame 7F0#0FF0 drives the bus off: warning, passive, off, and is never sent. While "hold" lies in /tmp nothing is
acknowledged, as on a bus without another node."""
import os
import struct

from adapter import Adapter


class Ucan(Adapter):
    vendor, product = 0x2294, 0x425a

    def vendor_request(self, request_type, request, value, index, out):
        if request_type == 0xc0 and request == 0:
            return b'vantage-ucan 1.0\0'
        if request_type == 0xc1 and request == 5:
            if value == 1:
                return struct.pack('<I', 3)
            if value == 0:
                return struct.pack('<I6BHIIHHH', 48000000, 16, 4, 1, 16, 1, 8, 1, 1, 1024, 0x1f, 0, 1)
        return b'' if request_type == 0x41 else None

    def received(self, can_id, data):
        self.send(struct.pack('<HBBI', 8 + len(data), 2, 0, can_id) + data)

    def take(self, out):
        length, _, echo, can_id = struct.unpack('<HBBI', out[:8])
        data = out[8:length]
        if os.path.exists('/tmp/hold'):
            return
        if can_id == 0x7f0 and data == b'\x0f\xf0':
            self.received(0x20000004, b'\0\x08\0\0\0\0\x60\0')
            self.received(0x20000004, b'\0\x20\0\0\0\0\x80\0')
            self.received(0x20000040, bytes(8))
            self.send(struct.pack('<HBBBBxx', 6, 1, 0, echo, 0))
        else:
            self.send(struct.pack('<HBBBBxx', 6, 1, 0, echo, 1))
            self.received(can_id ^ 0x400, data)


Ucan().serve()
