"""A USB device in user space on the kernel's vhci_hcd: USB/IP requests over a socket pair, no usbip tool."""
import collections
import socket
import struct
import threading

HIGH_SPEED = 3


def _receive(sock, size):
    data = b''
    while len(data) < size:
        piece = sock.recv(size - len(data))
        if not piece:
            raise EOFError
        data += piece
    return data


def _string(text):
    raw = text.encode('utf-16le')
    return bytes([len(raw) + 2, 3]) + raw


class Adapter:
    """One interface with bulk IN 0x81 and bulk OUT 0x02. Subclasses answer vendor requests and take what comes out."""

    vendor, product, interface_class = 0, 0, 0xff
    strings = {0: b'\x04\x03\x09\x04', 1: _string('vantage'), 2: _string('simulated adapter'), 3: _string('SN1')}

    def __init__(self, port=0):
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        with open('/sys/devices/platform/vhci_hcd.0/attach', 'w') as attach:
            attach.write('%d %d %d %d' % (port, theirs.fileno(), (1 << 16) | 2, HIGH_SPEED))
        theirs.close()
        self.sock = ours
        self.to_host = collections.deque()  # What waits to be read.
        self.asked = collections.deque()    # Reads that wait: sequence number, length.
        self.lock = threading.Lock()

    def vendor_request(self, request_type, request, value, index, out):
        """The answer's bytes, or None for a stall."""
        raise NotImplementedError

    def take(self, data):
        raise NotImplementedError

    def send(self, data):
        self.to_host.append(data)
        self._pump()

    def serve(self):
        while True:
            command, seq, _, direction, endpoint = struct.unpack('>5I', _receive(self.sock, 20))
            rest = _receive(self.sock, 28)
            with self.lock:
                if command == 1:
                    self._submit(seq, direction, endpoint, rest)
                elif command == 2:
                    self._unlink(seq, struct.unpack('>I', rest[:4])[0])

    def _answer(self, seq, status, data, length):
        self.sock.sendall(struct.pack('>IIIIIiIIII8x', 3, seq, 0, 0, 0, status, length, 0, 0, 0) + data)

    def _submit(self, seq, direction, endpoint, rest):
        length = struct.unpack('>i', rest[4:8])[0]
        out = _receive(self.sock, length) if direction == 0 and length > 0 else b''
        if endpoint == 0:
            data = self._control(rest[20:], out)
            if data is None:
                self._answer(seq, -32, b'', 0)
            else:
                self._answer(seq, 0, data if direction else b'', len(data) if direction else length)
        elif direction == 0:
            self._answer(seq, 0, b'', length)
            self.take(out)
        else:
            self.asked.append((seq, length))
            self._pump()

    def _pump(self):
        while self.to_host and self.asked:
            seq, length = self.asked.popleft()
            piece = self.to_host.popleft()[:length]
            self._answer(seq, 0, piece, len(piece))

    def _unlink(self, seq, target):
        hit = [read for read in self.asked if read[0] == target]
        for read in hit:
            self.asked.remove(read)
        self.sock.sendall(struct.pack('>IIIIIi24x', 4, seq, 0, 0, 0, -104 if hit else 0))

    def _control(self, setup, out):
        request_type, request, value, index, length = struct.unpack('<BBHHH', setup)
        if request_type & 0x60:
            data = self.vendor_request(request_type, request, value, index, out)
            return None if data is None else data[:length]
        if request == 6:
            kind, number = value >> 8, value & 255
            table = {1: self._device(), 2: self._configuration()}
            data = self.strings.get(number) if kind == 3 else table.get(kind)
            return None if data is None else data[:length]
        if request == 0:
            return b'\x00\x00'[:length]
        if request == 8:
            return b'\x01'
        return b'' if request in (1, 3, 5, 9, 11) else None

    def _device(self):
        return struct.pack('<BBHBBBBHHHBBBB', 18, 1, 0x0200, 0, 0, 0, 64, self.vendor, self.product, 0, 1, 2, 3, 1)

    def _configuration(self):
        interface = struct.pack('<9B', 9, 4, 0, 0, 2, self.interface_class, 0xff, 0xff, 0)
        ends = struct.pack('<BBBBHB', 7, 5, 0x81, 2, 512, 0) + struct.pack('<BBBBHB', 7, 5, 0x02, 2, 512, 0)
        return struct.pack('<BBHBBBBB', 9, 2, 32, 1, 1, 0, 0x80, 50) + interface + ends
